"""Error against run time: problems with known answers, methods, and the command that runs one on the other."""
