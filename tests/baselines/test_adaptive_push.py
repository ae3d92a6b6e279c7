"""The adaptive push does its job, and does it as described."""

import numpy as np
import pytest
from dirt_env.baselines.adaptive_push import AdaptivePush, State
from dirt_env.baselines.pushing.edge import blade_action
from dirt_env.baselines.pushing.numbers import shipped
from dirt_env.baselines.pushing.parameters import Parameters

from dirt_env.env import DirtPushEnv
from dirt_env.policy import load_policy
from dirt_env.task.kinds import GOAL

TRAVEL = 0.4  # m; least height of the edge over the tracks on the way, once it is up


def roll(env, policy, seed, steps):
    """Infos of an episode, and the states in it with the edge's height and the actions."""
    observation, info = env.reset(seed=seed)
    policy.reset(seed)
    log = []
    for _ in range(steps):
        action = policy.act(observation)
        log.append((getattr(policy, "state", None), env.read_pose(observation["pose"])["edge"], action))
        observation, _, done, _, info = env.step(action)
        if done:
            break
    return info, log


@pytest.fixture(scope="module")
def easy():
    return DirtPushEnv(level=0, observation={"map": True})


def test_it_brings_an_easy_heap_home_far_ahead_of_doing_nothing_and_of_chance(easy):
    shares = {}
    for name in ("adaptive_push", "idle", "random"):
        info, _ = roll(easy, load_policy(name, easy.config), 0, 480)
        shares[name] = info["share_in_goal"]
    assert shares["adaptive_push"] >= 0.95
    assert shares["idle"] == 0.0
    assert shares["adaptive_push"] > shares["random"] + 0.8


def test_every_state_is_reached_and_the_blade_is_up_on_the_way(easy):
    policy = AdaptivePush(easy.config)
    _, log = roll(easy, policy, 1, 480)
    states = [state for state, _, _ in log]
    assert {State.NAVIGATE, State.ALIGN, State.PUSH, State.RETREAT} <= set(states)
    for i in range(3, len(log)):
        if all(state is State.NAVIGATE for state in states[i - 3 : i + 1]):
            assert log[i][1] >= TRAVEL
    assert all(abs(action).max() <= 1.0 and action.dtype == np.float32 for _, _, action in log)


def test_it_is_deterministic(easy):
    first, second = (roll(easy, AdaptivePush(easy.config), 2, 200) for _ in range(2))
    assert first[0]["share_in_goal"] == second[0]["share_in_goal"]
    assert all((a[2] == b[2]).all() for a, b in zip(first[1], second[1], strict=True))


def test_two_goals_both_get_soil():
    env = DirtPushEnv(scene="several_goals", observation={"map": True})
    info, _ = roll(env, AdaptivePush(env.config), 0, 960)
    assert info["share_in_goal"] >= 0.9
    world, job = env.episode.world, env.episode.job
    gain = (world.height - job.target) * (job.kind & GOAL > 0) * env.config.grid.cell**2
    assert gain[:, :40].sum() > 5.0
    assert gain[:, 40:].sum() > 5.0


def test_it_goes_between_posts_without_running_into_them():
    env = DirtPushEnv(scene="posts", observation={"map": True})
    policy, blocked = AdaptivePush(env.config), []
    observation, info = env.reset(seed=0)
    for _ in range(400):
        observation, _, done, _, info = env.step(policy.act(observation))
        blocked.append(info["blocked"])
        if done:
            break
    assert info["share_in_goal"] > 0.6
    assert np.mean(blocked) < 0.1


def test_it_digs_from_level_ground_in_layers():
    env = DirtPushEnv(scene="dig", observation={"map": True})
    observation, info = env.reset(seed=0)
    policy = AdaptivePush(env.config)
    lowest = []
    for _ in range(400):
        observation, _, _, _, info = env.step(policy.act(observation))
        lowest.append(float(env.episode.world.height.min()))
    assert info["share_in_goal"] > 0.4
    assert lowest[20] > lowest[-1] - 1e-6


def test_it_levels_a_pad():
    env = DirtPushEnv(scene="pad", observation={"map": True})
    _, before = env.reset(seed=0)
    info, _ = roll(env, AdaptivePush(env.config), 0, 400)
    assert info["grade_error_m"] < 0.6 * before["grade_error_m"]


def test_it_says_so_when_there_is_no_map():
    env = DirtPushEnv(level=0)
    observation, _ = env.reset(seed=0)
    with pytest.raises(ValueError, match=r"has no map; allowed: one made with observation=.*map"):
        AdaptivePush(env.config).act(observation)


def test_it_stands_when_all_is_done(easy):
    policy = AdaptivePush(easy.config, shipped(Parameters, min_height=0.3))
    observation, _ = easy.reset(seed=0)
    observation = {**observation, "map": observation["map"].copy()}
    observation["map"][1] = np.minimum(observation["map"][1], 0.0)
    action = policy.act(observation)
    assert policy.state is State.DONE
    assert action[:2].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("asked", [0.4, 0.1, -0.05])
@pytest.mark.parametrize("pose", [(6.0, 8.0, 0.0), (7.5, 8.0, 1.0)])
def test_an_edge_is_asked_for_in_either_sense_of_the_blade(asked, pose):
    """On the flank of a heap, where the target surface is not that of the tracks."""
    heap = {"region": {"kind": "circle", "center": [8.0, 8.0], "radius": 2.5}, "volume": 4.0}
    goal = {"region": {"kind": "rectangle", "center": [13.5, 8.0], "size": [4.0, 8.0]}}
    for blade in ("tracks", "grade"):
        env = DirtPushEnv(
            scene={"site": {"size": [16.0, 16.0]}, "start": [heap], "goal": [goal]},
            action={"blade": blade},
            machine={"cut": 1.5},
            observation={"map": True},
        )
        observation, _ = env.reset(seed=0, options={"pose": pose})
        site = AdaptivePush(env.config).site
        for _ in range(6):
            site.see(observation)
            observation, *_ = env.step([0.0, 0.0, blade_action(site, asked)])
        edge = env.read_pose(observation["pose"])["edge"]
        assert edge == pytest.approx(asked, abs=0.08), blade  # its plane of the tracks is not quite the machine's


@pytest.mark.slow
def test_it_does_its_job_under_grade_control_too():
    env = DirtPushEnv(level=0, action={"blade": "grade"}, observation={"map": True})
    info, _ = roll(env, load_policy("adaptive_push", env.config), 0, 480)
    assert info["is_success"]


def test_the_planner_says_that_it_cannot_do_with_grade_control():
    config = DirtPushEnv(action={"blade": "grade"}).config
    with pytest.raises(ValueError, match=r"action.blade is 'grade'; allowed for the planner: \"tracks\""):
        load_policy("planner", config)
