"""The training worlds: a stage of the curriculum at a time, on training layouts only."""

import hashlib
import json
from collections import deque
from collections.abc import Sequence
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from dirt_env.config import load
from dirt_env.config.data import data_digests
from dirt_env.config.loading import merge
from dirt_env.split import training_seeds
from dirt_env.vector import DirtPushVectorEnv

from .fineness import to_blade
from .frames import STACKED, Frames
from .mirror import Mirror
from .settings import Settings, Stage, at_level
from .vec_env import DirtPushVecEnv

JUDGED = 100  # episodes of each level that decide whether a stage is done


class Ended(NamedTuple):
    """One training episode: level (None where the scene has none), return, share in the goal, success, steps."""

    level: int | None
    reward: float
    share: float
    success: bool
    steps: int


class Course(DirtPushVecEnv):
    """The worlds of a training run; world i of a stage has the level i of its list, from the beginning again.

    Every world's generator starts from a training layout's seed (`dirt_env.split`) and draws its later episodes too,
    so layouts for selection or evaluation never come up.
    """

    def __init__(self, settings: Settings, number: int = 0) -> None:
        """Make the worlds of stage `number`."""
        self.settings, self.number = settings, number
        super().__init__(settings.worlds.count, info="end", **worlds_of(settings, self.stage))
        self.scene = _digests(self.native)
        self.frames = Frames(settings.worlds.frames)
        self.mirror = Mirror(settings.worlds.mirror)
        self.observation_space = _stacked(self.observation_space, settings.worlds.frames)
        self.returns = np.zeros(self.num_envs)
        self.ended: list[Ended] = []
        self.seconds = 0.0  # spent in the environment
        self._judged = self._blank_sheets()
        self.seed(settings.seed)

    @property
    def stage(self) -> Stage:
        """The stage that is under way."""
        return self.settings.stages[self.number]

    def seed(self, seed: int | None = None) -> Sequence[int]:
        """Let the next `reset` start all worlds from training layouts, drawn by the run's seed and the stage."""
        seed = self.settings.seed if seed is None else seed
        self._seeds = training_seeds(np.random.default_rng([seed, self.number]), self.num_envs)
        return self._seeds

    def reset(self) -> VecEnvObs:
        """As in `DirtPushVecEnv`; what was seen before is forgotten."""
        self.frames.forget()
        return self.mirror.show(self.frames.add(super().reset()))

    def step_async(self, actions: np.ndarray) -> None:
        """As in `DirtPushVecEnv`, with actions for the worlds as they were shown."""
        super().step_async(to_blade(self.mirror.steer(actions), self.settings.worlds.fineness))

    def step_wait(self) -> VecEnvStepReturn:
        """As in `DirtPushVecEnv`, with frames and mirror; takes the time, and notes the episodes that end."""
        begun = perf_counter()
        observations, rewards, done, infos = super().step_wait()
        self.returns += rewards
        levels = self.stage.levels or (None,)
        for world in np.flatnonzero(done).tolist():
            level, info = levels[world % len(levels)], infos[world]
            steps = round(info["time_s"] / self.native.envs[world].config.task.period)
            success = bool(info["is_success"])
            self.ended.append(Ended(level, float(self.returns[world]), info["share_in_goal"], success, steps))
            self._judged[level].append(success)
            self.returns[world] = 0.0
            last = self.frames.last(info["terminal_observation"], world)
            info["terminal_observation"] = self.mirror.show_last(last)
        observations = self.mirror.show(self.frames.add(observations, begins=done))
        self.seconds += perf_counter() - begun
        return observations, rewards, done, infos

    def is_passed(self, steps: int) -> bool:
        """Whether the stage is done, now that it has lasted for `steps` steps of the environment."""
        if self.stage.steps is not None and steps >= self.stage.steps:
            return True
        if self.stage.success is None:
            return False
        return all(len(sheet) == JUDGED and np.mean(sheet) >= self.stage.success for sheet in self._judged.values())

    def next_stage(self) -> None:
        """Go on to the next stage; `reset` starts its first episodes."""
        self.number += 1
        self.native.close()
        self.native = DirtPushVecEnv(self.num_envs, info="end", **worlds_of(self.settings, self.stage)).native
        self.scene = _digests(self.native)
        self.returns[:] = 0.0
        self._judged = self._blank_sheets()
        self.seed()

    def state(self) -> dict[str, Any]:
        """All that the worlds' future depends on, as plain values and arrays."""
        states = self.native.get_state()
        return {
            "bytes": np.frombuffer(b"".join(states), np.uint8),
            "lengths": np.array([len(state) for state in states]),
            "returns": self.returns.copy(),
            "turned": self.mirror.turned,
            "judged": [list(sheet) for sheet in self._judged.values()],
            **{f"frames.{name}": array for name, array in self.frames.kept.items()},
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from a state of `state`, in a course of the same settings and stage."""
        ends = np.cumsum(state["lengths"])
        whole = state["bytes"].tobytes()
        self.native.set_state([whole[end - length : end] for end, length in zip(ends, state["lengths"], strict=True)])
        self.returns[:] = state["returns"]
        self.mirror.turned = state.get("turned", self.mirror.turned)
        if self.frames.count > 1:
            self.frames.kept = {name: state[f"frames.{name}"] for name in STACKED}
        for sheet, kept in zip(self._judged.values(), state["judged"], strict=True):
            sheet.extend(kept)

    def _blank_sheets(self) -> dict[int | None, deque[bool]]:
        """Where success is noted, for each level."""
        return {level: deque(maxlen=JUDGED) for level in self.stage.levels or (None,)}


def worlds_of(settings: Settings, stage: Stage) -> dict[str, Any]:
    """The arguments of a stage's environment: every variant at every level, the levels in turn."""
    worlds, levels = settings.worlds, stage.levels or (None,)
    variants = [{**variant, **at_level(level)} for variant in worlds.variants or ({},) for level in levels]
    steps = worlds.steps or max(load(worlds.scene, **merge(worlds.set, variant)).steps for variant in variants)
    return {
        "scene": worlds.scene,
        "variants": variants,
        "max_episode_steps": steps,
        "threads": worlds.threads,
        **worlds.set,
    }


def _digests(native: DirtPushVectorEnv) -> dict[str, str]:
    """Digests of what the worlds' scenes say, and of each data file that they name, by name."""
    scenes = [config.to_dict() for config in dict.fromkeys(env.config for env in native.envs)]
    return {"the scene": hashlib.sha256(json.dumps(scenes).encode()).hexdigest()[:16], **data_digests(scenes)}


def _stacked(space: spaces.Dict, frames: int) -> spaces.Dict:
    """The space of so many frames as one observation."""
    many = {
        name: spaces.Box(np.concatenate([space[name].low] * frames), np.concatenate([space[name].high] * frames))
        for name in STACKED
    }
    return spaces.Dict({**space.spaces, **many})
