"""The native batch: equal to `SyncVectorEnv` to the last bit, and what it has beyond that."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import dirt_env  # noqa: F401

QUICK = {  # a small heap right before a goal, the machine behind it: some worlds are done after a few pushes
    "scene": {
        "site": {"size": [16.0, 16.0]},
        "start": [{"region": {"kind": "circle", "center": [6.0, 8.0], "radius": 1.5}, "volume": [0.9, 1.1]}],
        "goal": [{"region": {"kind": "rectangle", "center": [11.0, 8.0], "size": [6.0, 6.0]}}],
        "machine": {"pose": [3.0, 8.0, 0.0]},
        "task": {"success": 0.05},
    }
}
MODES = list(AutoresetMode)
SCENES = [
    QUICK,
    {"level": 5},
    {"level": 1, "observation": {"overview": True, "map": True}},
    {"level": 1, "site": {"border": "open"}},
    {"scene": "pad"},
    {"scene": "dig"},
    {"scene": "several_goals"},
]
EQUAL_STEPS = 18


def native(count=4, **options):
    return gymnasium.make_vec("DirtPush-v0", num_envs=count, **options)


def sync(count=4, autoreset_mode=AutoresetMode.NEXT_STEP, **options):
    return gymnasium.make_vec("DirtPush-v0", count, "sync", vector_kwargs={"autoreset_mode": autoreset_mode}, **options)


def actions(count, steps, seed=0):
    """Pushes that wander: some worlds get on with the job, others do not."""
    rng = np.random.default_rng(seed)
    wander = rng.uniform(-1, 1, (steps, count, 3)) * [0.1, 0.3, 0.1]
    return (wander + np.array([0.0, 0.7, -0.1])).astype(np.float32)


def assert_equal(found, expected, place=""):
    """The same structure, types, shapes and bits; where it differs is said."""
    assert type(found) is type(expected), place
    if isinstance(expected, dict):
        assert set(found) == set(expected), place
        for name in expected:
            assert_equal(found[name], expected[name], f"{place}.{name}")
    elif isinstance(expected, tuple):
        assert len(found) == len(expected), place
        for index, (one, other) in enumerate(zip(found, expected, strict=True)):
            assert_equal(one, other, f"{place}[{index}]")
    elif isinstance(expected, np.ndarray) and expected.dtype == object:
        assert found.dtype == object, place
        assert_equal(tuple(found), tuple(expected), place)
    elif isinstance(expected, np.ndarray):
        assert (found.dtype, found.shape) == (expected.dtype, expected.shape), place
        assert found.tobytes() == expected.tobytes(), place
    else:
        assert found == expected, place


def assert_same_play(one, other, steps=EQUAL_STEPS, seed=3, manual=False):
    """Both return the same from a reset and from every step; returns how many episodes ended."""
    assert_equal(one.reset(seed=seed), other.reset(seed=seed), "reset")
    ends = 0
    for step, action in enumerate(actions(one.num_envs, steps)):
        found, expected = one.step(action), other.step(action)
        assert_equal(found, expected, f"step {step}")
        ended = found[2] | found[3]
        ends += int(ended.sum())
        if manual and ended.any():
            masks = [{"reset_mask": ended.copy()} for _ in range(2)]
            assert_equal(one.reset(options=masks[0]), other.reset(options=masks[1]), f"reset after step {step}")
    return ends


# Equal to SyncVectorEnv


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("limit", [5, -1, None])
def test_it_equals_the_generic_one_in_every_autoreset_mode(mode, limit):
    options = {**QUICK, "max_episode_steps": limit, "autoreset_mode": mode}
    ends = assert_same_play(native(**options), sync(**options), manual=mode == AutoresetMode.DISABLED)
    assert ends > 0


@pytest.mark.parametrize("scene", SCENES, ids=str)
def test_it_equals_the_generic_one_in_every_kind_of_scene(scene):
    options = {**scene, "max_episode_steps": 9}
    assert assert_same_play(native(3, **options), sync(3, **options)) > 0


@pytest.mark.parametrize("threads", [1, 2, 3, 7])
def test_any_number_of_threads_gives_the_same(threads):
    options = {**QUICK, "max_episode_steps": 6, "autoreset_mode": "SameStep"}
    with_threads, with_one = native(70, threads=threads, **options), native(70, threads=1, **options)
    assert assert_same_play(with_threads, with_one, steps=8) >= 70
    with_threads.close()
