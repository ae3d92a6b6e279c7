"""The native batch behind stable-baselines3's interface: equal to its own `DummyVecEnv`, and good to train with."""

import gymnasium
import numpy as np
import pytest

import dirt_env  # noqa: F401

pytest.importorskip("stable_baselines3")

from dirt_env.agents.vec_env import DirtPushVecEnv
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize

SHOVE = {  # a small heap right before a goal, the machine behind it: some worlds are done after a few pushes
    "site": {"size": [16.0, 16.0]},
    "start": [{"region": {"kind": "circle", "center": [6.0, 8.0], "radius": 1.5}, "volume": [0.9, 1.1]}],
    "goal": [{"region": {"kind": "rectangle", "center": [11.0, 8.0], "size": [6.0, 6.0]}}],
    "machine": {"pose": [3.0, 8.0, 0.0]},
    "task": {"success": 0.05},
}
COUNT = 3
EPISODE = 7


def dummy(**options):
    return DummyVecEnv([lambda: gymnasium.make("DirtPush-v0", **options) for _ in range(COUNT)])


def both(**options):
    options = {"scene": SHOVE, "max_episode_steps": EPISODE, **options}
    return DirtPushVecEnv(COUNT, **options), dummy(**options)


def pushes(steps, seed=0):
    rng = np.random.default_rng(seed)
    return (rng.uniform(-1, 1, (steps, COUNT, 3)) * [0.1, 0.3, 0.1] + [[0.0, 0.7, -0.1]]).astype(np.float32)


def assert_same(found, expected, place=""):
    """The same structure and types, and the same bits."""
    if isinstance(expected, dict):
        assert found.keys() == expected.keys(), place
        for name in expected:
            assert_same(found[name], expected[name], f"{place}.{name}")
    elif isinstance(expected, list | tuple):
        assert len(found) == len(expected), place
        for index, (one, other) in enumerate(zip(found, expected, strict=True)):
            assert_same(one, other, f"{place}[{index}]")
    elif isinstance(expected, np.ndarray):
        assert (found.dtype, found.shape) == (expected.dtype, expected.shape), place
        assert found.tobytes() == expected.tobytes(), place
    else:
        assert (type(found), found) == (type(expected), expected), place


def play(env, steps=20, seed=5):
    """Everything from a seeded reset and some steps."""
    seeds = env.seed(seed)
    returned = [seeds, env.reset(), env.unwrapped.reset_infos]
    return returned + [(env.step(action), [dict(one) for one in env.unwrapped.reset_infos]) for action in pushes(steps)]


def test_it_equals_the_dummy_one_over_episodes():
    native, other = both()
    found, expected = play(native), play(other)
    assert_same(found, expected)
    infos = [info for (_, _, _, infos), _ in expected[3:] for info in infos]
    assert any(info["is_success"] for info in infos)
    assert any(info["TimeLimit.truncated"] for info in infos)
    assert all("terminal_observation" in info for info in infos if info["is_success"])


@pytest.mark.parametrize("wrap", [VecMonitor, VecNormalize, lambda env: VecNormalize(VecMonitor(env))])
def test_it_equals_the_dummy_one_under_wrappers(wrap):
    found, expected = ([step[:3] for step in run(wrap(env), 12)] for env in both())
    assert_same(found, expected)


def run(env, steps):
    env.seed(1)
    env.reset()
    return [env.step(action) for action in pushes(steps)]


def test_the_monitor_sees_episodes():
    native, _ = both()
    infos = [info for *_, infos in run(VecMonitor(native), 2 * EPISODE) for info in infos]
    lengths = [info["episode"]["l"] for info in infos if "episode" in info]
    assert len(lengths) >= 2 * COUNT
    assert max(lengths) == EPISODE


def test_infos_at_the_end_only_have_what_training_needs():
    full, ends = (DirtPushVecEnv(COUNT, info=info, scene=SHOVE, max_episode_steps=4) for info in ("all", "end"))
    for (one, _, done, infos), (other, _, _, short) in zip(run(full, 10), run(ends, 10), strict=True):
        assert_same(other, one)
        for world in range(COUNT):
            assert_same(short[world], infos[world] if done[world] else {"TimeLimit.truncated": False})
    with pytest.raises(ValueError, match="info is 'none'; allowed: all, end"):
        DirtPushVecEnv(COUNT, info="none")


def test_options_reach_the_worlds_they_are_for():
    native, other = both()
    options = [{"pose": (3.0, 4.0 + world, 0.0)} for world in range(COUNT)]
    for given in (options, {"layout_seed": 3}, None):
        found = []
        for env in (native, other):
            env.seed(2)
            env.set_options(given)
            found.append((env.reset(), [dict(info) for info in env.reset_infos], env.reset()))
        assert_same(*found)


def test_attributes_and_methods_of_single_worlds():
    native, other = both()
    for env in (native, other):
        env.seed(0)
        env.reset()
        env.step(pushes(1)[0])
        env.set_attr("marked", 7, indices=[1])
    assert native.get_attr("marked", indices=1) == other.get_attr("marked", indices=1) == [7]
    assert native.get_attr("config") == other.get_attr("config")
    assert native.env_method("get_state", indices=[0, 2]) == other.env_method("get_state", indices=[0, 2])
    assert native.has_attr("config")
    assert not native.has_attr("configuration")
    assert native.env_is_wrapped(gymnasium.Wrapper) == [False] * COUNT
    native.close()


def test_pictures_are_tiled_as_by_the_dummy_one():
    native, other = both(render_mode="rgb_array")
    for env in (native, other):
        env.seed(0)
        env.reset()
    assert_same(native.render(), other.render())
    assert native.render_mode == other.render_mode


@pytest.mark.slow
def test_ppo_learns_the_same_on_both():
    """The same seeds, the same parameters after some updates: not a bit of what it saw differed."""
    torch = pytest.importorskip("torch")
    from stable_baselines3 import PPO

    parameters = []
    for env in both():
        model = PPO("MultiInputPolicy", env, n_steps=32, batch_size=32, n_epochs=2, seed=0, device="cpu")
        model.learn(200)
        parameters.append([value.detach().clone() for value in model.policy.parameters()])
    assert all(torch.equal(one, other) for one, other in zip(*parameters, strict=True))
