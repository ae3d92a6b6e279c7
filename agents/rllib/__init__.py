"""PPO by Ray RLlib, on one machine or a cluster; in an environment of its own, since ray pins gymnasium 1.2.2."""
