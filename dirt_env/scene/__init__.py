"""Initial ground, start and goal regions, design surfaces, obstacles: what one episode starts from. Plain numpy."""
