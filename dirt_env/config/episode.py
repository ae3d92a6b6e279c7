"""The start of an episode: the scene's fixed layout, or a random one."""

from functools import lru_cache

import numpy as np

from dirt_env.config.scene import SceneConfig
from dirt_env.scene import fixed, vary
from dirt_env.scene.layout import Layout
from dirt_env.scene.sampling import sample
from dirt_env.scene.zone import zone_map


def layout(config: SceneConfig, rng: np.random.Generator) -> Layout:
    """A new layout; its arrays belong to the caller. Only `rng` makes one differ from another of the same scene."""
    if config.vary is not None:
        return vary.lay_out(parts(config), config.vary, config.setting, rng)
    if config.layout is not None:
        drawn = sample(config.layout, config.setting, config.ground, rng)
    else:
        drawn = fixed.lay_out(plan(config), config.pose, rng)
    return drawn._replace(zone=zone_map([zone.region for zone in config.zones], config.grid))


def parts(config: SceneConfig) -> vary.Parts:
    """What a fixed scene has written down."""
    return vary.Parts(
        config.ground, config.starts, config.goals, config.design, config.obstacles, config.hollows, config.pose,
        tuple(zone.region for zone in config.zones),
    )  # fmt: skip


@lru_cache(maxsize=32)
def plan(config: SceneConfig) -> fixed.Plan:
    """What all episodes of a fixed scene share; worked out once."""
    return fixed.plan(
        config.setting,
        config.ground,
        config.starts,
        config.goals,
        config.design,
        config.obstacles,
        config.pose == "random",
        config.hollows,
    )
