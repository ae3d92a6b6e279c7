"""What a job is: actions in, observations, what is still to move, and reward out. Knows the simulator, no gymnasium."""
