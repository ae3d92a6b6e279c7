"""What is learned from: of PPO the steps of a rollout; of SAC the last ones of all worlds, what is large as f2."""

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.buffers import DictReplayBuffer, DictRolloutBuffer

LARGE = ("patch", "overview")


class Rollout(DictRolloutBuffer):
    """The buffer of stable-baselines3 without its copies: drawn in random order, the steps can stay as they lie."""

    @staticmethod
    def swap_and_flatten(arr: np.ndarray) -> np.ndarray:
        """[steps, worlds, ...] as [steps worlds, ...]: a view."""
        return arr.reshape(arr.shape[0] * arr.shape[1], *(arr.shape[2:] or (1,)))

    def to_torch(self, array: np.ndarray, copy: bool = True) -> torch.Tensor:
        """The array, which was drawn for this alone, without a copy unless it goes to another device."""
        return super().to_torch(array, copy=False)


class Replay(DictReplayBuffer):
    """The buffer of stable-baselines3, with patches and overviews as f2: 2 mm of 4 m, and half the memory."""

    def __init__(self, buffer_size: int, observation_space: spaces.Dict, *arguments, **options) -> None:
        """Room for `buffer_size` steps of all worlds together."""
        small = {name: _halved(space) if name in LARGE else space for name, space in observation_space.spaces.items()}
        super().__init__(buffer_size, spaces.Dict(small), *arguments, **options)

    def to_torch(self, array: np.ndarray, copy: bool = True) -> torch.Tensor:
        """The array as f4."""
        return super().to_torch(array.astype(np.float32, copy=False), copy)

    def state(self) -> dict[str, np.ndarray]:
        """The steps that are kept, by name, and where the next one goes."""
        rows = self.buffer_size if self.full else self.pos
        return {**{name: array[:rows] for name, array in self._arrays().items()}, "next": np.array(self.pos)}

    def set_state(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a state of `state`, in a buffer of the same size."""
        for name, array in self._arrays().items():
            array[: len(state[name])] = state[name]
        self.pos, self.full = int(state["next"]), len(state["rewards"]) == self.buffer_size

    def _arrays(self) -> dict[str, np.ndarray]:
        """All there is, [rows, worlds, ...] by name."""
        before = {f"before.{name}": array for name, array in self.observations.items()}
        after = {f"after.{name}": array for name, array in self.next_observations.items()}
        rest = {name: getattr(self, name) for name in ("actions", "rewards", "dones", "timeouts")}
        return {**before, **after, **rest}


def _halved(space: spaces.Box) -> spaces.Box:
    return spaces.Box(space.low.astype(np.float16), space.high.astype(np.float16), dtype=np.float16)
