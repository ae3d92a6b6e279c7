"""A scene: frozen, validated configuration. TOML or plain mappings in; an error with the key and both numbers out.

config = load("heap", level=2, soil={"repose": 30})
start = layout(config, np.random.default_rng(1))
"""

from dirt_env.config.episode import layout
from dirt_env.config.loading import load, scene_names
from dirt_env.config.scene import SceneConfig
from dirt_env.config.tables import Observation, Reward, Site, Task

__all__ = ["Observation", "Reward", "SceneConfig", "Site", "Task", "layout", "load", "scene_names"]
