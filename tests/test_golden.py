"""Recorded drives: the same seed and actions bring what they brought when the trace was recorded.

After a change that is meant to change the physics or the task: `pytest tests/test_golden.py --renew-golden`, and look
at the difference before you keep it.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from dirt_env.env import DirtPushEnv

FOLDER = Path(__file__).parent / "golden"
TRACES = {
    "heaps": {"level": 2},
    "posts": {"level": 5},
    "open_border": {"level": 1, "site": {"border": "open"}},
    "pad": {"scene": "pad"},
}
STEPS = 40
TOLERANCE = 1e-6  # other processors may round sine and cosine differently


def trace(options: dict) -> list[dict[str, float]]:
    """Figures of every step of a drive with smooth random actions."""
    env = DirtPushEnv(**options)
    env.reset(seed=11)
    rng = np.random.default_rng(11)
    action = np.array([0.0, 1.0, -0.2])
    steps = []
    for _ in range(STEPS):
        action = np.clip(0.8 * action + 0.4 * rng.normal(size=3), -1, 1)
        observation, reward, _, _, info = env.step(action)
        steps.append({"reward": reward, **figures(env, observation), "misplaced": info["misplaced_m3"]})
    return [{name: round(value, 9) for name, value in step.items()} for step in steps]


def figures(env: DirtPushEnv, observation: dict[str, np.ndarray]) -> dict[str, float]:
    """Numbers that change when anything does: the machine's record, and moments of the ground and of the patch."""
    height = env.episode.world.height.astype(np.float64)
    weights = np.arange(height.size).reshape(height.shape) / height.size
    record = env.episode.world.machine[0]
    pose = {name: float(record[name]) for name in ("x", "y", "heading", "z", "pitch", "roll", "edge", "load")}
    return {**pose, "ground": float((height * weights).sum()), "patch": float(observation["patch"].astype(float).sum())}


def first_mismatch(expected: list[dict], found: list[dict]) -> str:
    """What differs first, and by how much; empty if nothing does."""
    for step, (old, new) in enumerate(zip(expected, found, strict=True)):
        for name in old:
            if abs(old[name] - new[name]) > TOLERANCE * max(1.0, abs(old[name])):
                return f"step {step}: {name} was {old[name]!r} and is {new[name]!r}"
    return ""


@pytest.mark.parametrize("name", TRACES)
def test_a_recorded_drive_is_repeated(name, request):
    path = FOLDER / f"{name}.json"
    found = trace(TRACES[name])
    if request.config.getoption("--renew-golden"):
        FOLDER.mkdir(exist_ok=True)
        path.write_text("[\n" + ",\n".join(json.dumps(step) for step in found) + "\n]\n")
    mismatch = first_mismatch(json.loads(path.read_text()), found)
    assert not mismatch, f"{name}, {mismatch}; renew with --renew-golden if that is meant"


def test_the_first_mismatch_is_named():
    old = [{"x": 1.0, "y": 2.0}, {"x": 1.0, "y": 2.0}]
    new = [{"x": 1.0, "y": 2.0 + 1e-9}, {"x": 1.5, "y": 9.0}]
    assert first_mismatch(old, old) == ""
    assert first_mismatch(old, new) == "step 1: x was 1.0 and is 1.5"
