"""What Gymnasium and stable-baselines3 check of an environment, for every shipped scene; warnings are errors."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env, data_equivalence

from dirt_env.config import scene_names

SCENES = [{"scene": name} for name in scene_names()] + [{"level": level} for level in range(6)]
EVERYTHING = {"observation": {"overview": True, "map": True}}
pytestmark = pytest.mark.filterwarnings("error")


def make(**options):
    return gymnasium.make("DirtPush-v0", **options)


@pytest.mark.parametrize("options", [{}, EVERYTHING, {"level": 5}], ids=str)
def test_gymnasium_checks_it_in_all_render_modes(options):
    check_env(make(**options).unwrapped)


@pytest.mark.parametrize("options", SCENES, ids=str)
def test_gymnasium_checks_every_scene(options):
    check_env(make(**options).unwrapped, skip_render_check=True)


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("options", [{}, EVERYTHING, {"observation": {"size": 48}}], ids=str)
def test_stable_baselines_checks_it(options):
    """Only what it says about images may be said."""
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        checker.check_env(make(**options), warn=True)
    complaints = [str(one.message) for one in caught if issubclass(one.category, UserWarning)]
    assert [text for text in complaints if "image" not in text.lower()] == []


def test_the_passive_checker_is_silent_over_an_episode():
    env = make(max_episode_steps=60, disable_env_checker=False, render_mode="rgb_array")
    env.reset(seed=0)
    env.action_space.seed(0)
    done = False
    while not done:
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        done = terminated or truncated
    env.render()
    env.close()


@pytest.mark.parametrize("options", SCENES, ids=str)
def test_rollouts_are_deterministic(options):
    """Gymnasium's own test of its environments: two instances, the same seed, the same returns."""
    one, other = (make(disable_env_checker=True, **options) for _ in range(2))
    first, second = one.reset(seed=0), other.reset(seed=0)
    assert data_equivalence(first, second, exact=True)
    one.action_space.seed(0)
    for _ in range(30):
        action = one.action_space.sample()
        first, second = one.step(action), other.step(action)
        assert data_equivalence(first, second, exact=True)
        assert one.observation_space.contains(first[0])


@pytest.mark.parametrize("options", SCENES, ids=str)
def test_the_spaces_are_finite_and_the_start_lies_in_them(options):
    env = make(**options)
    for space in env.observation_space.values():
        assert space.dtype == np.float32
        assert np.isfinite(space.low).all()
        assert np.isfinite(space.high).all()
        assert (space.low < space.high).all()
    assert env.observation_space.contains(env.reset(seed=0)[0])


@pytest.mark.parametrize("mode", ["rgb_array", "human"])
def test_render_modes_render(mode):
    env = make(render_mode=mode)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    frame = env.render()
    if mode == "human":
        assert frame is None
    else:
        assert (frame.dtype, frame.shape[2]) == (np.uint8, 3)
    env.close()


def test_a_specification_makes_the_same_environment_after_json():
    spec = EnvSpec.from_json(make(scene="heap", level=2, observation={"size": 24}).spec.to_json())
    one, other = spec.make(), make(scene="heap", level=2, observation={"size": 24})
    assert one.observation_space == other.observation_space
    assert data_equivalence(one.reset(seed=3), other.reset(seed=3), exact=True)


def test_the_generic_vector_environment_equals_single_ones():
    """Gymnasium's SyncVectorEnv of two, against the two by themselves."""
    vector = gymnasium.make_vec("DirtPush-v0", num_envs=2, vectorization_mode="sync")
    singles = [make(), make()]
    together, _ = vector.reset(seed=[3, 4])
    apart = [env.reset(seed=seed)[0] for env, seed in zip(singles, (3, 4), strict=True)]
    for step in range(20):
        for i, observation in enumerate(apart):
            assert all(np.array_equal(together[name][i], observation[name]) for name in observation), step
        actions = np.random.default_rng(step).uniform(-1, 1, (2, 3)).astype(np.float32)
        together, *_ = vector.step(actions)
        apart = [env.step(action)[0] for env, action in zip(singles, actions, strict=True)]
    vector.close()
