"""The ways to run worlds whose speed is compared: each begins on layouts and is stepped with rows of actions."""

from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Protocol

import gymnasium
import numpy as np

from dirt_env.bench.speed.bare import BareWorlds, commands_of
from dirt_env.bench.speed.drives import config, scene


class Runner(Protocol):
    """A number of worlds that step together."""

    def reset(self, seeds: Sequence[int]) -> None:
        """Start an episode in every world, world i on the layout of seeds[i]."""

    def steps(self, actions: np.ndarray) -> None:
        """Control steps of every world; f4[steps, num_envs, 3]."""

    def close(self) -> None:
        """Let go of threads and windows."""


class Single:
    """One environment of `gymnasium.make`."""

    def __init__(self, size: int, num_envs: int, threads: int) -> None:
        self._env = gymnasium.make("DirtPush-v0", **scene(size))

    def reset(self, seeds: Sequence[int]) -> None:
        """See Runner."""
        self._env.reset(seed=seeds[0])

    def steps(self, actions: np.ndarray) -> None:
        """See Runner."""
        step = self._env.step
        for action in actions[:, 0]:
            step(action)

    def close(self) -> None:
        """See Runner."""
        self._env.close()


class Vector:
    """A vector environment of `gymnasium.make_vec`."""

    def __init__(self, size: int, num_envs: int, **options: Any) -> None:
        self._env = gymnasium.make_vec("DirtPush-v0", num_envs=num_envs, **options, **scene(size))

    def reset(self, seeds: Sequence[int]) -> None:
        """See Runner."""
        self._env.reset(seed=list(seeds))

    def steps(self, actions: np.ndarray) -> None:
        """See Runner."""
        for row in actions:
            self._env.step(row)

    def close(self) -> None:
        """See Runner."""
        self._env.close()


def native(size: int, num_envs: int, threads: int) -> Runner:
    """The native batch."""
    return Vector(size, num_envs, threads=threads)


def sync(size: int, num_envs: int, threads: int) -> Runner:
    """Gymnasium's loop over single environments."""
    return Vector(size, num_envs, vectorization_mode="sync")


class Adapter:
    """The VecEnv of stable-baselines3 over the native batch, as one trains with it."""

    def __init__(self, size: int, num_envs: int, threads: int) -> None:
        adapter = import_module("dirt_env.agents.vec_env").DirtPushVecEnv
        self._env = adapter(num_envs, info="end", threads=threads, **scene(size))

    def reset(self, seeds: Sequence[int]) -> None:
        """See Runner."""
        self._env.set_options([{"layout_seed": seed} for seed in seeds])
        self._env.reset()

    def steps(self, actions: np.ndarray) -> None:
        """See Runner."""
        for row in actions:
            self._env.step(row)

    def close(self) -> None:
        """See Runner."""
        self._env.close()


class Bare:
    """The physics alone, all steps in one compiled call."""

    def __init__(self, size: int, num_envs: int, threads: int) -> None:
        self._worlds, self._machine = BareWorlds(config(size), num_envs), config(size).machine

    def reset(self, seeds: Sequence[int]) -> None:
        """See Runner."""
        self._worlds.begin(seeds)

    def steps(self, actions: np.ndarray) -> None:
        """See Runner."""
        self._worlds.drive(commands_of(actions, self._machine))

    def close(self) -> None:
        """Nothing to let go of."""


CASES: dict[str, Callable[[int, int, int], Runner]] = {
    "single": Single,
    "native": native,
    "sync": sync,
    "sb3": Adapter,
    "world": Bare,
}
ALONE = ("single",)  # cases of one world, whatever is asked for
ONE_THREAD = ("single", "sync", "world")


NO_ADAPTER = 'case sb3 needs stable-baselines3: pip install ".[train]" in the checkout'


def has_adapter() -> bool:
    """Whether stable-baselines3 is there."""
    return find_spec("stable_baselines3") is not None


def need_adapter() -> None:
    """Raise ImportError with a sentence that helps where stable-baselines3 is missing."""
    if not has_adapter():
        raise ImportError(NO_ADAPTER)
