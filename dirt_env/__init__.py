"""DirtPush: machines that push soil. Importing this registers `DirtPush-v0`, so `gymnasium.make` knows it."""

from gymnasium.envs.registration import register

__version__ = "0.1.0"

register(
    id="DirtPush-v0",
    entry_point="dirt_env.env:DirtPushEnv",
    vector_entry_point="dirt_env.vector:DirtPushVectorEnv",
    max_episode_steps=600,
)
