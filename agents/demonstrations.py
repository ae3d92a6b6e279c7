"""Demonstrations: what a scripted behaviour does on training layouts, for a training run to begin from."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import gymnasium
import numpy as np

from dirt_env.config.loading import merge
from dirt_env.policy import Policy, complaint, load_policy
from dirt_env.split import training_seeds

from .course import worlds_of
from .fineness import from_blade
from .frames import Frames
from .mirror import Mirror
from .settings import Settings

BEGINS, LASTS = 0.03, (2, 8)  # chance of a disturbance in a step; its length [steps], less than the second
TAKES = 0.7  # share of the action that it is


class Demonstrations(NamedTuple):
    """What was seen and what the teacher would have done there: arrays by name [n, ...], actions f4[n, 3]."""

    observations: dict[str, np.ndarray]
    actions: np.ndarray


def demonstrate(settings: Settings) -> Iterator[tuple[int, Demonstrations]]:
    """Let the teacher play; gives how many steps are done and what they showed, a step of all worlds at a time.

    It is disturbed, by noise in every step and by bursts of random driving now and then, so that it shows how to get
    back on course too; what is learned is what it wanted, not what was done. Which layouts and disturbances follows
    from the run's seed.
    """
    teacher, generator = settings.teacher, np.random.default_rng([settings.seed, 1])
    options = merge(worlds_of(settings, settings.stages[-1]), {"observation": {"map": True}})
    env = gymnasium.make_vec("dirt_env:DirtPush-v0", teacher.worlds, autoreset_mode="SameStep", info="none", **options)
    policies = [load_policy(teacher.policy, one.config) for one in env.envs]
    for policy in policies:
        policy.reset(int(generator.integers(2**31)))
    observations, _ = env.reset(seed=training_seeds(generator, teacher.worlds))
    frames, mirror, ended = Frames(settings.worlds.frames), Mirror(settings.worlds.mirror), None
    disturbed, left = np.zeros((teacher.worlds, 3)), np.zeros(teacher.worlds, int)
    try:
        for step in range(-(-teacher.steps // teacher.worlds)):
            wanted = np.clip(_asked(teacher.policy, policies, observations), -1.0, 1.0)
            seen = mirror.show(frames.add(_seen(observations), ended))
            shown = from_blade(mirror.steer(wanted), settings.worlds.fineness)
            yield (step + 1) * teacher.worlds, Demonstrations(seen, shown)
            begins = (left == 0) & (generator.random(teacher.worlds) < BEGINS)
            left[begins] = generator.integers(*LASTS, begins.sum())
            disturbed[begins] = generator.uniform(-1.0, 1.0, (begins.sum(), 3))
            done = wanted + (left > 0)[:, None] * TAKES * (disturbed - wanted)
            done += generator.normal(0.0, teacher.noise, done.shape)
            left[left > 0] -= 1
            observations, _, terminated, truncated, _ = env.step(done)
            ended = terminated | truncated
            for world in np.flatnonzero(ended):
                policies[world].reset(int(generator.integers(2**31)))
    finally:
        env.close()


def _asked(name: str, policies: Sequence[Policy], observations: dict[str, np.ndarray]) -> np.ndarray:
    """What the teachers want to do, f4[n, 3]; ValueError that names the policy where one fails."""
    try:
        asked = [np.asarray(policy.act(_of(observations, world)), float) for world, policy in enumerate(policies)]
    except Exception as error:
        raise ValueError(f"teacher.policy is {name!r}, which failed: {complaint(error)}") from error
    if wrong := [actions.shape for actions in asked if actions.shape != (3,)]:
        raise ValueError(f"teacher.policy is {name!r}, which gives actions of the shape {wrong[0]}; allowed: (3,)")
    return np.stack(asked).astype(np.float32)


def _of(observations: dict[str, np.ndarray], world: int) -> dict[str, np.ndarray]:
    return {name: array[world] for name, array in observations.items()}


def _seen(observations: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What the network looks at."""
    return {name: array for name, array in observations.items() if name != "map"}
