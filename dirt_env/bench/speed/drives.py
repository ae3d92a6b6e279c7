"""What the machines do while they are timed: actions drawn or recorded beforehand, the same in every case."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from dirt_env.config import SceneConfig, load
from dirt_env.env import DirtPushEnv
from dirt_env.policy import load_policy

DRIVES = ("idle", "random", "adaptive_push")
STEPS = 500  # of an episode that are timed: fewer than after which it would be truncated
TAPES = 64  # different rows of actions
RECORDED = 8  # layouts on which a scripted behaviour is recorded
CELL = 0.5  # m


class Tapes(NamedTuple):
    """Actions f4[steps, tapes, 3]; world i follows tape i, and begins on the layout of seed i, both modulo `layouts`.

    None of these episodes ends before the tapes do.
    """

    actions: np.ndarray
    layouts: int | None

    def seed(self, world: int) -> int:
        """Seed of a world's layout."""
        return world if self.layouts is None else world % self.layouts

    def rows(self, worlds: range) -> np.ndarray:
        """Actions of these worlds, f4[steps, worlds, 3]."""
        return np.ascontiguousarray(self.actions[:, np.arange(worlds.start, worlds.stop) % self.actions.shape[1]])


def scene(size: int, **overrides: Any) -> dict[str, Any]:
    """The default scene on a site of size x size cells."""
    return {"scene": "heap", "level": 1, "site": {"size": [size * CELL] * 2, "cell": CELL}, **overrides}


@cache
def tapes(drive: str, size: int) -> Tapes:
    """The actions of a drive: samples of the action space, with a lifted blade if idle; or a behaviour's."""
    if drive not in ("idle", "random"):
        recorded = [record(drive, size, seed) for seed in range(RECORDED)]
        steps = min(map(len, recorded))
        return Tapes(np.stack([actions[:steps] for actions in recorded], axis=1), RECORDED)
    space = DirtPushEnv(**scene(size)).action_space
    space.seed(0)
    actions = np.array([[space.sample() for _ in range(TAPES)] for _ in range(STEPS)])
    if drive == "idle":
        actions[..., 2] = 1.0
    return Tapes(actions, None)


def record(policy: str, size: int, seed: int, steps: int = STEPS, env: DirtPushEnv | None = None) -> np.ndarray:
    """Actions f4[n, 3] of a policy on the layout of that seed, at most `steps`, without the one that ends the job."""
    env = env or DirtPushEnv(**scene(size, observation={"map": True}))
    driver = load_policy(policy, env.config)
    observation, _ = env.reset(seed=seed)
    driver.reset(seed)
    actions, terminated = [], False
    while not terminated and len(actions) < steps:
        actions.append(np.asarray(driver.act(observation), np.float32))
        observation, _, terminated, _, _ = env.step(actions[-1])
    return np.array(actions[:-1] if terminated else actions)


@cache
def config(size: int) -> SceneConfig:
    """The scene's configuration."""
    return load(**scene(size))
