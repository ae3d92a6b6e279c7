"""Whatever learns; it may import torch and stable-baselines3 (`network` does without), the library may not. Installed as `dirt_env.agents`."""
