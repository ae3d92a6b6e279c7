"""The greedy behaviour chooses by what a push brings in a second, and does its job."""

import numpy as np
import pytest
from dirt_env.baselines.adaptive_push import AdaptivePush
from dirt_env.baselines.greedy import Greedy
from dirt_env.baselines.pushing.choose import choose
from dirt_env.baselines.pushing.numbers import shipped
from dirt_env.baselines.pushing.parameters import GreedyParameters, Parameters
from dirt_env.baselines.pushing.site import Site
from dirt_env.baselines.pushing.worth import Candidates, farthest_first, gain_per_second

from dirt_env.env import DirtPushEnv
from dirt_env.rollout import play


@pytest.fixture(scope="module")
def env():
    return DirtPushEnv(level=1, observation={"map": True})


@pytest.fixture
def site(env):
    observation, _ = env.reset(seed=3)
    site = Site(env.config)
    site.see(observation)
    site.excess = np.zeros_like(site.excess)
    site.pose = {**site.pose, "x": 4.0, "y": 16.0, "heading": 0.0}
    return site


def candidates(*rows):
    """Pushes to the east from (x, 16) with an aim and a haul; the pivot begins 3 m behind."""
    x, aim, haul = np.array(rows, float).T
    y = np.full_like(x, 16.0)
    ahead = np.stack([np.ones_like(x), np.zeros_like(x)], axis=1)
    points = (np.stack([x, y], axis=1), np.stack([aim, y], axis=1))
    return Candidates(*points, haul, np.stack([x - 3.0, y], axis=1), ahead)


def test_twice_the_soil_is_worth_twice_as_much_until_the_blade_is_full(site):
    numbers, found = shipped(GreedyParameters, perch=0.0, carried=1.0), candidates((8.0, 20.0, 10.0))
    worth = []
    for height in (0.1, 0.2, 5.0, 10.0):
        site.excess[30:34, 20:24] = height  # y 15 to 17 m, x 10 to 12 m: 4 m2
        worth.append(float(gain_per_second(site, numbers, found)[0]))
    assert worth[1] == pytest.approx(2 * worth[0])
    assert worth[2] == worth[3] == pytest.approx(worth[0] * site.rated / 0.4)


def test_it_is_gain_over_time(site):
    numbers = shipped(GreedyParameters, perch=0.0, far=0.0, overhead=4.0, pace=0.5)
    site.excess[30:34, 20:24] = 0.3
    [worth] = gain_per_second(site, numbers, candidates((8.0, 20.0, 10.0)))
    seconds = 4.0 + 1.0 / 2.0 + 12.0 / (2.0 * 0.5)  # overhead, 1 m straight ahead, 12 m of pushing
    assert worth == pytest.approx(0.3 * 4.0 / site.rated * 10.0 / seconds)


def test_it_takes_what_is_near_where_the_paper_takes_what_is_far(site):
    """Equal soil in both lanes: one is 4 m from the goal and before the blade, one 12 m from it and far away."""
    site.excess[30:34, 16:20] = site.excess[30:34, 50:54] = 0.3
    found = candidates((8.0, 12.0, 4.0), (25.0, 37.0, 12.0))
    far_cheap = shipped(GreedyParameters, perch=0.0, overhead=0.0)
    near_first = candidates((8.0, 12.0, 8.0), (25.0, 37.0, 12.0))
    assert farthest_first(site, shipped(Parameters, travel=0.0), found).argmax() == 1
    assert gain_per_second(site, far_cheap, near_first).argmax() == 0


def test_pushes_to_choose_from_are_apart_and_best_first(env):
    site = Site(env.config)
    site.see(env.reset(seed=5)[0])
    numbers = shipped(GreedyParameters)
    pushes = choose(site, numbers, [], gain_per_second, most=5)
    assert 1 < len(pushes) <= 5
    firsts = np.array([push.first for push in pushes])
    gaps = np.hypot(*(firsts[:, None] - firsts[None]).transpose(2, 0, 1)) + 99 * np.eye(len(firsts))
    assert gaps.min() >= 0.5 * env.config.blade.width
    assert choose(site, numbers, [], gain_per_second) == pushes[:1]


def test_with_little_left_it_goes_on_as_the_adaptive_push(env):
    policy, other = Greedy(env.config), AdaptivePush(env.config)
    observation, _ = env.reset(seed=5)
    chosen = {}
    for height in (0.7, 0.07):
        seen = {**observation, "map": observation["map"].copy()}
        seen["map"][1] = np.where(seen["map"][1] > 0.0, height, seen["map"][1])
        for each in (policy, other):
            each.reset()
            each.act(seen)
        chosen[height] = policy.push == other.push, policy.numbers == other.numbers
    assert chosen == {0.7: (False, False), 0.07: (True, True)}


@pytest.mark.slow
def test_it_finishes_the_job_another_way_than_the_adaptive_push(env):
    done = [play(env, make(env.config), 3, env.config.steps) for make in (Greedy, Greedy, AdaptivePush)]
    assert done[0]["is_success"]
    assert done[0] == done[1]
    assert done[0]["return"] != done[2]["return"]
