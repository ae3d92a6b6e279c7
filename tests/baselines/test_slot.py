"""Slot dozing lays lanes over the soil, empties them from the front, and does its job."""

import numpy as np
import pytest
from dirt_env.baselines.pushing.numbers import shipped
from dirt_env.baselines.pushing.parameters import SlotParameters
from dirt_env.baselines.pushing.site import Site
from dirt_env.baselines.pushing.slots import lay_slots, loads_in, next_pass
from dirt_env.baselines.slot import SlotDozing

from dirt_env.config import load
from dirt_env.env import DirtPushEnv
from dirt_env.rollout import play

FIXED = {"vary": None, "machine": {"pose": [4.0, 3.0, 0.0]}}  # soil at x 6 to 14 m, y 7 to 13 m; goal at (38, 10) m


@pytest.fixture
def site():
    env = DirtPushEnv(scene="slot", level=1, observation={"map": True}, **FIXED)
    site = Site(env.config)
    site.see(env.reset(seed=1)[0])
    return site


def test_lanes_lie_side_by_side_over_the_soil_and_end_in_the_goal(site):
    slots = lay_slots(site, shipped(SlotParameters, spacing=1.0))
    assert len(slots) == 2
    assert sorted(slot.middle[1] for slot in slots) == pytest.approx([8.5, 11.5], abs=0.3)
    for slot in slots:
        assert slot.middle[0] == pytest.approx(10.0, abs=0.3)
        assert site.goal[site.cell_at(*slot.end)]
        assert (slot.rear, slot.front) == pytest.approx((-4.25, 4.25), abs=0.3)
    whole = site.excess.sum() * site.grid.cell**2 / site.rated
    assert sum(loads_in(site, slot) for slot in slots) == pytest.approx(whole, rel=0.1)


def test_a_pass_takes_its_loads_from_the_front_and_the_next_one_begins_behind(site):
    numbers = shipped(SlotParameters, loads=1.0)
    slot = lay_slots(site, numbers)[0]
    first = next_pass(site, numbers, slot)
    assert 10.5 < first.first[0] < 13.5
    assert first.aim == slot.end
    site.excess[:, site.x[0] > first.first[0]] = 0.0
    assert next_pass(site, numbers, slot).first[0] < first.first[0] - 1.0


def test_without_soil_there_are_no_lanes(site):
    site.excess = np.zeros_like(site.excess)
    assert lay_slots(site, shipped(SlotParameters)) == []


@pytest.mark.slow
def test_it_finishes_a_long_haul_in_the_same_lane_pass_after_pass():
    env = DirtPushEnv(scene="slot", level=0, observation={"map": True})
    policy = SlotDozing(env.config)
    lanes = []

    def watch(env, info):
        if policy.push is not None and (not lanes or lanes[-1] is not policy.push):
            lanes.append(policy.push)

    assert play(env, policy, 8000, env.config.steps, watch)["is_success"]
    aims = [push.aim for push in lanes[:4]]
    assert len(lanes) > 4
    assert len(set(aims)) <= 2


def test_it_asks_for_a_goal():
    with pytest.raises(ValueError, match="the scene pad has no goal; allowed for slot"):
        SlotDozing(load("pad"))
