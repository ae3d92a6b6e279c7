"""What is still to move: exact on small sites, and the same however it is added up."""

import numpy as np
import pytest

from dirt_env.task.goal import Gauge
from dirt_env.task.job import make_job
from dirt_env.task.kinds import GOAL
from tests.task.sites import CELL, heaped, site


def job_of(place, ground=None):
    ground = place.height.astype(np.float32) if ground is None else ground
    return make_job(ground, place, CELL, goal_depth=1.0, limit=4.0)


def measured(place, height):
    return Gauge(job_of(place), CELL).measure(height.astype(np.float32))


def test_untouched_ground_has_nothing_to_do():
    place = site(height=np.random.default_rng(0).normal(size=(20, 30)))
    place.target = place.height
    assert measured(place, place.height) == (0.0, 0.0, 0.0, 0.0, 0.0)


def test_ground_that_settled_before_the_start_is_not_misplaced():
    place = site(height=np.random.default_rng(0).normal(size=(20, 30)))
    place.target = place.height
    settled = (place.height * 0.9).astype(np.float32)
    assert Gauge(job_of(place, settled), CELL).measure(settled) == (0.0, 0.0, 0.0, 0.0, 0.0)


def test_a_heap_counts_by_volume_and_way():
    place = heaped(2.0)
    found = measured(place, place.height)
    way = CELL * np.hypot(16 - 2, 26 - 3)
    assert found.misplaced == 2.0 * CELL**2
    assert found.potential == pytest.approx(2.0 * CELL**2 * way, rel=1e-7)
    assert (found.moved, found.stray, found.grade_error) == (0.0, 0.0, 0.0)


def test_soil_in_the_goal_is_moved_and_weighs_nothing():
    place = heaped(2.0)
    done = np.zeros((20, 30))
    done[-1, -1] = 2.0
    assert measured(place, done) == (0.0, 0.0, 2.0 * CELL**2, 0.0, 0.0)


def test_soil_between_start_and_goal_is_stray():
    place = heaped(2.0)
    spilled = place.height.copy()
    spilled[2, 3], spilled[10, 10] = 1.5, 0.5
    found = measured(place, spilled)
    assert (found.misplaced, found.stray) == (2.0 * CELL**2, 0.5 * CELL**2)


def test_soil_dug_elsewhere_does_not_count_as_moved():
    """The goal has been filled from a pit beside it; the heap lies where it lay."""
    place = heaped(2.0)
    swapped = place.height.copy()
    swapped[10, 10], swapped[-1, -1] = -2.0, 2.0
    assert measured(place, swapped).moved == 0.0


def test_soil_moved_within_the_goal_is_no_gain():
    place = heaped(2.0)
    shuffled = place.height.copy()
    shuffled[-1, -1], shuffled[-2, -2] = 1.0, -1.0
    assert measured(place, shuffled).moved == 0.0


def test_a_design_lacks_what_is_to_be_filled():
    """Cut 1 m off one cell of the design, fill another 0.5 m: potential, volume moved and grade error are known."""
    design = np.zeros((20, 30), bool)
    design[5, 5] = design[5, 9] = True
    ground = np.zeros((20, 30))
    ground[5, 5], ground[5, 9] = 1.0, -0.5
    place = site(height=ground, design=design, goal=np.zeros((20, 30), bool), soil=CELL**2)
    start = measured(place, ground)
    way = 4 * CELL
    assert start.potential == pytest.approx((1.0 + 0.5) * way * CELL**2)
    assert start.grade_error == pytest.approx(np.sqrt((1.0 + 0.25) / 2))
    half = ground.copy()
    half[5, 5], half[5, 9] = 0.5, 0.0
    then = measured(place, half)
    assert then.moved == pytest.approx(0.5 * CELL**2)
    assert then.potential == pytest.approx(0.5 * way * CELL**2)
    assert measured(place, np.zeros((20, 30))).potential == 0.0


def test_a_pit_without_a_dump_is_done_when_it_is_empty():
    design = np.zeros((20, 30), bool)
    design[8:10, 8:10] = True
    place = site(height=design * 1.0, design=design, goal=np.zeros((20, 30), bool), soil=4 * CELL**2)
    beside = np.zeros((20, 30))
    beside[0, :4] = 1.0
    assert measured(place, beside)[:3] == (0.0, 0.0, 4 * CELL**2)


@pytest.mark.parametrize("with_design", [False, True])
def test_rows_that_changed_are_enough(with_design):
    """Random patches change; adding up their rows only gives the same bits as adding up everything."""
    rng = np.random.default_rng(5)
    design = np.zeros((20, 30), bool)
    design[3:9, 3:20] = with_design
    height = rng.normal(size=(20, 30)).astype(np.float32)
    place = heaped() if not with_design else site(design=design)
    job = job_of(place)
    gauge = Gauge(job, CELL)
    gauge.measure(height)
    for _ in range(50):
        r0, c0 = rng.integers(18), rng.integers(28)
        r1, c1 = rng.integers(r0, 21), rng.integers(c0, 31)
        height[r0:r1, c0:c1] += rng.normal(size=(r1 - r0, c1 - c0)).astype(np.float32)
        assert gauge.measure(height, np.array([r0, r1, c0, c1])) == Gauge(job, CELL).measure(height)


def test_walls_hold_no_soil_and_no_goal():
    solid = np.zeros((20, 30), bool)
    solid[-1, -1] = solid[0, 0] = True
    place = heaped()
    place.solid = solid
    height = place.height.copy()
    height[0, 0] = 3.0
    job = job_of(place)
    assert Gauge(job, CELL).measure(height.astype(np.float32)).misplaced == CELL**2
    assert np.count_nonzero(job.kind & GOAL) == 15
