"""The worlds of an env runner: the native batch, on training layouts only."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dirt_env.split import training_seeds
from dirt_env.vector import DirtPushVectorEnv, Observations

from .settings import ClusterSettings, scene_of, variants_of


class TrainingWorlds(DirtPushVectorEnv):
    """`DirtPushVectorEnv` whose `reset(seed=S)` starts the worlds from training layouts that S draws.

    RLlib seeds its env runners with S, S + 1, ..., and a batch its worlds so too: without this, world 1 of a runner
    would play the layouts of world 0 of the next one.
    """

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Observations, dict[str, Any]]:
        """Start new episodes; every world's generator goes on from its training layout's seed."""
        seeds = None if seed is None else training_seeds(np.random.default_rng(seed), self.num_envs)
        return super().reset(seed=seeds, options=options)


def make_worlds(context: Mapping[str, Any]) -> TrainingWorlds:
    """What RLlib calls in every env runner, with its `env_config` and `num_envs`."""
    return TrainingWorlds(**context)


def env_config(settings: ClusterSettings) -> dict[str, Any]:
    """Arguments of the worlds; episodes last as long as the longest of the jobs takes."""
    worlds, variants = settings.worlds, variants_of(settings.worlds)
    return {
        **worlds.set,
        "scene": worlds.scene,
        "variants": variants,
        "max_episode_steps": max(scene_of(worlds, variant).steps for variant in variants),
        "info": "end",
        "threads": 1,
    }
