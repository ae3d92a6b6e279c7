"""`dirt-push speed`: steps per second of every way to run worlds, beside CartPole in the same run."""
