"""The training worlds: their layouts, their levels, the stages they go through."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from dirt_env.agents.course import JUDGED, Course

from dirt_env.env import DirtPushEnv
from dirt_env.split import EVALUATION, SELECTION, TRAINING

from .conftest import smoke

LENGTH = 40  # steps of an episode in the smoke settings
STAGES = [{"levels": [0], "success": 0.5}, {"levels": [0, 1, 1], "steps": 999}, {"levels": [2]}]


@pytest.fixture
def course():
    course = Course(smoke(stage=STAGES, worlds={"count": 6}, ppo={"n_steps": 64}))
    yield course
    course.close()


def levels(course):
    return [env.config.layout.level for env in course.native.envs]


@pytest.mark.parametrize("seed", [0, 8000, 10_000, 123_456])
def test_every_stage_starts_from_training_layouts_only(seed, monkeypatch):
    course = Course(smoke(stage=STAGES, worlds={"count": 6}, ppo={"n_steps": 64}, seed=seed))
    given = []
    for number in range(3):
        reset = course.native.reset

        def listen(seed=None, options=None, reset=reset):
            given.append(seed)
            return reset(seed=seed, options=options)

        monkeypatch.setattr(course.native, "reset", listen)
        course.reset()
        if number < 2:
            course.next_stage()
    first = [seeds for seeds in given if seeds is not None]
    assert len(first) == 3
    assert all(one in TRAINING for seeds in first for one in seeds)
    assert all(len(set(seeds)) == 6 for seeds in first)
    assert len({tuple(seeds) for seeds in first}) == 3
    course.close()


def test_no_layout_of_selection_or_evaluation_comes_up(course):
    """Over several episodes of every world, which its generator draws one after the other."""
    env, held_out = DirtPushEnv(level=0), set()
    for seed in [*SELECTION[:40], *EVALUATION[:40]]:
        env.reset(seed=seed)
        held_out.add(env.episode.layout.height.tobytes())
    seen = set()
    for _ in range(3):
        course.reset()
        for _ in range(2 * LENGTH):
            seen |= {env.episode.layout.height.tobytes() for env in course.native.envs}
            course.step(np.zeros((6, 3), np.float32))
    assert len(seen) == 36
    assert not seen & held_out


def test_stages_change_the_levels(course):
    assert levels(course) == [0] * 6
    course.next_stage()
    assert levels(course) == [0, 1, 1, 0, 1, 1]
    course.next_stage()
    assert levels(course) == [2] * 6


def test_a_stage_is_passed_by_success_of_every_level_or_by_steps(course):
    assert not course.is_passed(10**9)
    course._judged[0].extend([True] * (JUDGED - 1))
    assert not course.is_passed(0)
    course._judged[0].append(True)
    assert course.is_passed(0)
    course._judged[0].extend([False] * (JUDGED // 2 + 1))
    assert not course.is_passed(0)
    course.next_stage()
    assert (course.is_passed(998), course.is_passed(999)) == (False, True)
    course.next_stage()
    assert not course.is_passed(10**9)


def test_an_ended_episode_is_noted_with_its_level_and_return(course):
    course.next_stage()
    course.reset()
    rewards, ends = np.zeros(6), {}
    for _ in range(LENGTH):
        _, reward, done, _ = course.step(np.zeros((6, 3), np.float32))
        rewards += reward
        for world in np.flatnonzero(done):
            ends.setdefault(int(world), rewards[world])
    noted = course.ended[:6]
    assert sorted(one.level for one in noted) == [0, 0, 1, 1, 1, 1]
    assert [one.reward for one in noted] == pytest.approx([ends[world] for world in ends])
    assert all(one.steps == LENGTH and not one.success for one in noted)


def test_it_goes_on_from_a_state(course):
    course.reset()
    actions = np.random.default_rng(0).uniform(-1, 1, (30, 6, 3)).astype(np.float32)
    for one in actions:
        course.step(one)
    state = course.state()
    expected = [course.step(one)[:2] for one in actions]
    other = Course(course.settings)
    other.set_state(state)
    for one, (seen, reward) in zip(actions, expected, strict=True):
        again = other.step(one)
        np.testing.assert_array_equal(again[0]["patch"], seen["patch"])
        np.testing.assert_array_equal(again[0]["pose"], seen["pose"])
        np.testing.assert_array_equal(again[1], reward)
    np.testing.assert_array_equal(other.returns, course.returns)
    other.close()


def test_every_variant_is_played_at_every_level():
    """And with the keys that are set anew for all; `steps` is what the longest job takes."""
    variants = [{"soil": {"repose": 30.0}}, {"task": {"time": 77.0}}]
    worlds = {"count": 12, "steps": None, "set": {"soil": {"density": 1234.0}}, "variants": variants}
    stage = [{"levels": [0, 1, 1]}]
    course = Course(smoke(stage=stage, worlds=worlds, ppo={"batch_size": 96}))
    configs = [env.config for env in course.native.envs]
    assert levels(course) == [0, 1, 1] * 4
    assert [config.task.time == 77.0 for config in configs] == [False] * 3 + [True] * 3 + [False] * 3 + [True] * 3
    assert [round(config.soil.slope, 3) for config in configs[2:5]] == [0.577, 0.700, 0.700]
    assert {config.soil.density for config in configs} == {1234.0}
    assert course.native._most_steps == max(config.steps for config in configs)
    course.close()
