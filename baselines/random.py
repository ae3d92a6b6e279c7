"""Acts at random, every control step anew: what a policy does that has learned nothing."""

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.policy import Observation


class Random:
    """Draws every action evenly from the action space."""

    sees = "nothing"

    def __init__(self) -> None:
        self._generator = np.random.default_rng()

    def reset(self, seed: int | None = None) -> None:
        """The same seed gives the same actions."""
        self._generator = np.random.default_rng(seed)

    def act(self, observation: Observation) -> np.ndarray:
        """Action (3,), each entry from [-1, 1)."""
        return self._generator.uniform(-1.0, 1.0, 3).astype(np.float32)


def make(config: SceneConfig) -> Random:
    """The behaviour for a scene."""
    return Random()
