"""Seen through noise: ground at rest ever better, ground that moves at once, the pose by dead reckoning."""

import numpy as np
import pytest
from dirt_env.baselines.adaptive_push import AdaptivePush
from dirt_env.baselines.pushing.site import Site

from dirt_env.env import DirtPushEnv

STAND, ON = np.array([0.0, 0.0, 1.0]), np.array([0.3, 1.0, 1.0])
NOISE = {"height": 0.03, "position": 0.1, "heading": 2.0}


def look(env, site, action, steps, seed=3):
    """Sites seen and the world as it is, after each step."""
    observation, _ = env.reset(seed=seed)
    site.forget()
    for _ in range(steps):
        site.see(observation)
        yield site, env.episode.world
        observation, *_ = env.step(action)


@pytest.fixture(scope="module")
def noisy():
    return DirtPushEnv(level=1, observation={"map": True, "noise": NOISE})


def test_ground_that_lies_still_is_known_better_with_every_look(noisy):
    site = Site(noisy.config)
    off = [float(np.std(site.height - world.height)) for site, world in look(noisy, site, STAND, 26)]
    assert off[0] == pytest.approx(NOISE["height"], rel=0.1)
    assert off[25] < 0.3 * off[0]


def test_the_target_is_found_under_the_noise_and_bare_ground_is_not_taken_for_soil(noisy):
    site = Site(noisy.config)
    for _ in look(noisy, site, STAND, 26):
        pass
    job, world = noisy.episode.job, noisy.episode.world
    plain = ~site.goal
    assert np.abs(site.target - job.target)[plain].max() < 1e-3
    soil = np.where(plain, np.maximum(world.height - job.target, 0.0), 0.0)
    assert site.excess.sum() == pytest.approx(soil.sum(), rel=0.03)
    assert (site.excess[plain & (soil == 0.0)] > 0.0).mean() < 0.02


def test_ground_that_changed_is_seen_at_once(noisy):
    site = Site(noisy.config)
    for _ in look(noisy, site, STAND, 20):
        pass
    observation = noisy.step(STAND)[0]
    changed = {**observation, "map": observation["map"].copy()}
    changed["map"][:2, 5:8, 5:8] += 0.4
    before = site.height.copy()
    site.see(changed)
    assert (site.height[5:8, 5:8] - before[5:8, 5:8]).mean() == pytest.approx(0.4, abs=0.05)


def test_the_way_is_reckoned_from_speed_and_yaw_rate(noisy):
    site = Site(noisy.config)
    errors = []
    for _, world in look(noisy, site, ON, 20):
        machine = world.machine[0]
        errors.append(np.hypot(site.pose["x"] - machine["x"], site.pose["y"] - machine["y"]))
    assert np.mean(errors[5:]) < 0.6 * NOISE["position"] * np.sqrt(np.pi / 2)


@pytest.mark.parametrize("height", [0.0, 0.02])
def test_what_is_pushed_into_a_goal_takes_room_there(height):
    env = DirtPushEnv(level=0, observation={"map": True, "noise": {"height": height, "position": 0.02}})
    policy = AdaptivePush(env.config)
    observation, info = env.reset(seed=2)
    before = None
    while info["share_in_goal"] < 0.6:
        observation, _, _, _, info = env.step(policy.act(observation))
        before = policy.site.room().sum() if before is None else before
    policy.site.see(observation)
    moved = info["share_in_goal"] * env.episode.job.soil
    assert before - policy.site.room().sum() == pytest.approx(moved, rel=0.25)


def test_without_noise_the_site_is_what_was_observed():
    env = DirtPushEnv(level=1, observation={"map": True})
    site = Site(env.config)
    for action in (STAND, ON, ON):
        observation, _ = env.reset(seed=1)
        site.see(observation)
        assert site.height.base is observation["map"] or (site.height == observation["map"][0]).all()
        assert (site.excess == np.where(site.goal, 0.0, np.maximum(observation["map"][1], 0.0))).all()
        env.step(action)
