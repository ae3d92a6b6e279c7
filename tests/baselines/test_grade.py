"""Grading brings surfaces within tolerance, and values its passes as described."""

import numpy as np
import pytest
from dirt_env.baselines.grade import Grade
from dirt_env.baselines.pushing.numbers import shipped
from dirt_env.baselines.pushing.parameters import GradeParameters
from dirt_env.baselines.pushing.passes import choose_passes
from dirt_env.baselines.pushing.site import Site

from dirt_env.config import load
from dirt_env.env import DirtPushEnv
from dirt_env.policy import load_policy
from dirt_env.rollout import play


def surface(scene, level):
    return DirtPushEnv(scene=scene, level=level, observation={"map": True})


@pytest.fixture
def level_site():
    """A site that is as it should be; the machine stands in its south-western corner."""
    env = surface("pad", 1)
    site = Site(env.config)
    site.see(env.reset(seed=0)[0])
    site.excess, site.fill = np.zeros_like(site.excess), np.zeros_like(site.fill)
    site.pose = {**site.pose, "x": 3.0, "y": 3.0, "heading": 0.0}
    return site


def test_where_all_is_level_there_is_no_pass(level_site):
    assert choose_passes(level_site, shipped(GradeParameters), []) == []


def test_a_pass_goes_from_what_is_too_high_to_what_is_too_low(level_site):
    level_site.excess[18:22, 14:18] = 0.2  # y 9 to 11 m, x 7 to 9 m
    level_site.fill[18:22, 28:32] = 0.2  # x 14 to 16 m
    [found] = choose_passes(level_site, shipped(GradeParameters), [])
    assert found.first[0] < 7.5
    assert 14.0 < found.aim[0] < 17.0
    assert abs(found.heading) < 0.3
    assert np.hypot(found.approach[0] - found.first[0], found.approach[1] - found.first[1]) == pytest.approx(2.6)


def test_a_place_where_it_failed_is_left_alone(level_site):
    level_site.excess[18:22, 14:18] = level_site.fill[18:22, 28:32] = 0.2
    [found] = choose_passes(level_site, shipped(GradeParameters), [])
    others = choose_passes(level_site, shipped(GradeParameters), [found.first], most=50)
    gaps = [np.hypot(*np.subtract(push.first, found.first)) for push in others]
    assert min(gaps, default=9.0) > 0.5 * level_site.blade.width


def test_a_pass_keeps_inside_the_site(level_site):
    level_site.excess[:4] = 0.2
    level_site.fill[8:12] = 0.1
    width, depth = level_site.extent
    for push in choose_passes(level_site, shipped(GradeParameters), [], most=100):
        assert 0.0 < push.approach[0] < width
        assert 0.0 < push.approach[1] < depth


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["pad", "ramp", "layers"])
def test_it_finishes_an_easy_surface_and_doing_nothing_does_not(scene):
    env = surface(scene, 0)
    graded = play(env, Grade(env.config), 8000, env.config.steps)
    idle = play(env, load_policy("idle", env.config), 8000, 20)
    assert graded["is_success"]
    assert graded["grade_error_m"] <= env.config.design.tolerance < idle["grade_error_m"]


@pytest.mark.slow
def test_the_blade_is_dragged_back_after_a_light_pass_only():
    """Edges of retreats: on the surface with back-drag, up without; the numbers are those it was made with."""
    env, edges = surface("ramp", 0), {}
    for drag in (0.0, 6.0):
        policy = Grade(env.config, shipped(GradeParameters, back_drag=drag, light=5.0))
        observation, _ = env.reset(seed=8000)
        policy.reset(8000)
        found = edges.setdefault(drag, [])
        for _ in range(120):
            observation = env.step(policy.act(observation))[0]
            if policy.state.name == "RETREAT":
                found.append(env.read_pose(observation["pose"])["edge"])
    assert np.median(edges[6.0]) < np.median(edges[0.0]) - 0.1


def test_it_asks_for_a_design():
    with pytest.raises(ValueError, match="the scene heap has no design; allowed for grade"):
        Grade(load("heap"))
