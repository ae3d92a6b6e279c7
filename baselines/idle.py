"""Does nothing: stands with its blade up. The zero of every comparison."""

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.policy import Observation


class Idle:
    """Stands still."""

    sees = "nothing"

    def reset(self, seed: int | None = None) -> None:
        """Nothing to forget."""

    def act(self, observation: Observation) -> np.ndarray:
        """No steering, no speed, blade at travel height."""
        return np.array([0.0, 0.0, 1.0], np.float32)


def make(config: SceneConfig) -> Idle:
    """The behaviour for a scene."""
    return Idle()
