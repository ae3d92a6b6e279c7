"""Pure physics: the ground, the blade, the machine. Knows no gymnasium, no files, no pictures."""
