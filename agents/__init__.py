"""Whatever learns, installed as `dirt_env.agents`; it may import torch and stable-baselines3, the library may not.

`network` runs what was learned, and does without them.
"""
