"""One episode of an evaluation, and what is measured in it. The same trial gives the same record, wherever it runs."""

import json
import warnings
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from dirt_env.bench.evaluate.suite import Task
from dirt_env.config import SceneConfig
from dirt_env.env import DirtPushEnv
from dirt_env.policy import complaint, load_policy, overrides_for
from dirt_env.rollout import play

INTERVALS = 60  # of the recorded curve over the episode's nominal length
METRICS = {  # name: (unit, whether more is better)
    "score": ("", True),
    "share_end": ("", True),
    "share_area": ("", True),
    "success": ("", True),
    "time_to_90_s": ("s", False),
    "time_s": ("s", False),
    "volume_moved_m3": ("m3", True),
    "volume_distance_m4_per_min": ("m3 m/min", True),
    "m3_per_h": ("m3/h", True),
    "loose_m3_per_h": ("m3/h", True),
    "spilled_m3": ("m3", False),
    "energy_kj_per_m3": ("kJ/m3", False),
    "distance_m": ("m", False),
    "grade_error_m": ("m", False),
}
"""What is measured; docs/evaluation.md defines each. None in a record where a figure has no meaning."""

HARDLY = 0.1  # m3; energy for less soil than this says nothing
_KEPT = 16  # environments that a worker keeps


class Trial(NamedTuple):
    """Which policy, on which task, on which layout."""

    policy: str
    task: Task
    layout: int

    @property
    def key(self) -> tuple[str, str, int | None, int]:
        """What a record is found by."""
        return self.policy, self.task.job, self.task.level, self.layout


class Answer(NamedTuple):
    """What another process says of a trial: its record, or the error's kind and words; and what it was warned of."""

    record: dict[str, Any] | None = None
    error: tuple[str, str] | None = None
    warned: tuple[str, ...] = ()


class LostWorkerError(RuntimeError):
    """A worker ended in the middle of an episode."""


class PolicyFailureError(RuntimeError):
    """A policy raised an error in an episode; the message says where."""


def run_trial(trial: Trial) -> dict[str, Any]:
    """Play the episode; returns its record of plain values. Raises PolicyFailureError with a line that says where."""
    text = json.dumps(trial.task.written(), sort_keys=True)
    config = _config(text)
    policy = load_policy(trial.policy, config)
    overrides = overrides_for(trial.policy, policy, trial.task.overrides)
    env = _env(trial.task.scene, json.dumps(overrides, sort_keys=True))
    steps = trial.task.steps or config.steps
    shares, lacks = [], []

    def watch(env: DirtPushEnv, info: Mapping[str, Any]) -> None:
        shares.append(info["share_in_goal"])
        lacks.append(info["grade_error_m"])

    try:
        summary = play(env, policy, trial.layout, steps, watch)
    except Exception as error:
        what = f"policy {trial.policy} failed in {trial.task.name}, layout {trial.layout}"
        raise PolicyFailureError(f"{what}: {complaint(error)}") from error
    share, lack = (np.array([*values, *[values[-1]] * (steps + 1 - len(values))]) for values in (shares, lacks))
    metrics = {
        "score": _score(env, _progress(config, share, lack)),
        "share_end": float(share[-1]),
        "share_area": float(share[1:].mean()),
        "success": summary["success"],
        "time_to_90_s": _time_to(0.9, share, config.task.period),
        "time_s": summary["time_s"],
        **_work(env, summary),
        "distance_m": summary["distance_m"],
        "grade_error_m": summary["grade_error_m"],
    }
    moments = np.rint(np.linspace(0, steps, INTERVALS + 1)).astype(int)
    return {
        **dict(zip(("policy", "job", "level", "layout"), trial.key, strict=True)),
        "sees": policy.sees,
        "steps": summary["steps"],
        "seconds": steps * config.task.period,
        "metrics": {name: metrics[name] for name in METRICS},
        "curve": share[moments].tolist(),
    }


def answer(trial: Trial) -> Answer:
    """What `run_trial` returns or raises, in a form that survives the way to another process."""
    record = error = None
    with warnings.catch_warnings(record=True) as caught:
        try:
            record = run_trial(trial)
        except (PolicyFailureError, ValueError, ImportError) as failure:
            error = type(failure).__name__, str(failure)
    return Answer(record, error, tuple(dict.fromkeys(str(warning.message) for warning in caught)))


def record_of(found: Answer) -> dict[str, Any]:
    """The record of an answer; warns of what `run_trial` warned of, and raises what it raised."""
    for words in found.warned:
        warnings.warn(words, stacklevel=2)
    if found.error is not None:
        kind, words = found.error
        raise {"ValueError": ValueError, "ImportError": ImportError}.get(kind, PolicyFailureError)(words)
    return found.record


@lru_cache(maxsize=_KEPT)
def _config(task: str) -> SceneConfig:
    return Task(**json.loads(task)).config()


@lru_cache(maxsize=_KEPT)
def _env(scene: str, overrides: str) -> DirtPushEnv:
    return DirtPushEnv(scene=scene, **json.loads(overrides))


def _progress(config: SceneConfig, share: np.ndarray, lack: np.ndarray) -> np.ndarray:
    """How much of what counts as done is done after each step, 0 to 1 [steps + 1]."""
    if config.design is None:
        return np.clip(share / config.task.success, 0.0, 1.0)
    return np.clip((lack[0] - lack) / max(lack[0] - config.design.tolerance, 1e-9), 0.0, 1.0)


def _score(env: DirtPushEnv, progress: np.ndarray) -> float:
    """Area under the progress, where 0 is doing nothing and 1 an ideal machine.

    The ideal one takes as long as a full blade (SAE J1265) at top speed takes for the volume times its way to the goal.
    """
    config, episode = env.config, env.episode
    rated = 0.8 * config.blade.width * config.blade.height**2
    seconds = episode.start.misplaced * episode.job.mean_haul / (rated * config.machine.speed)
    time = config.task.period * np.arange(1, len(progress))
    ideal = np.minimum(1.0, time / max(seconds, config.task.period))
    return float(progress[1:].mean() / ideal.mean())


def _time_to(level: float, share: np.ndarray, period: float) -> float:
    """When that share was in the goal [s]; the length of the episode if it never was."""
    there = share >= level
    return float((there.argmax() if there.any() else len(share) - 1) * period)


def _work(env: DirtPushEnv, summary: Mapping[str, float]) -> dict[str, float | None]:
    """What was moved, how fast, and at which price."""
    moved, episode = summary["volume_moved_m3"], env.episode
    minutes = max(summary["time_s"], env.config.task.period) / 60.0
    return {
        "volume_moved_m3": moved,
        "volume_distance_m4_per_min": (episode.start.potential - episode.remaining.potential) / minutes,
        "m3_per_h": summary["m3_per_h"],
        "loose_m3_per_h": summary["loose_m3_per_h"],
        "spilled_m3": summary["spilled_m3"],
        "energy_kj_per_m3": summary["energy_kj"] / moved if moved >= HARDLY else None,
    }
