"""The job: goals and their centres."""

import numpy as np

from dirt_env.task.job import make_job
from tests.task.sites import CELL, site


def centers(goal, **fields):
    place = site(*goal.shape, goal=goal, **fields)
    return make_job(place.height.astype(np.float32), place, CELL, 1.0, 4.0).centers


def test_every_goal_region_has_its_centre():
    goal = np.zeros((20, 30), bool)
    goal[2:5, 2:5] = goal[10:13, 20:25] = True
    assert centers(goal).tolist() == [[3.5 * CELL, 3.5 * CELL], [22.5 * CELL, 11.5 * CELL]]


def test_the_centre_may_lie_between_cells():
    goal = np.zeros((20, 30), bool)
    goal[2:6, 10:12] = True
    assert centers(goal).tolist() == [[11 * CELL, 4 * CELL]]


def test_the_centre_of_a_ring_lies_on_it():
    row, col = np.mgrid[:21, :21] - 10
    distance = np.hypot(row, col)
    ring = (distance > 5) & (distance < 8)
    (x, y), *more = centers(ring)
    assert not more
    assert ring[int(y / CELL), int(x / CELL)]


def test_a_winding_region_is_one():
    goal = np.zeros((20, 30), bool)
    goal[::4] = True
    goal[:, 0] = True
    assert len(centers(goal)) == 1


def test_without_a_goal_the_fill_is_where_soil_should_go():
    design = np.zeros((20, 30), bool)
    design[5:8, 5:25] = True
    height = np.zeros((20, 30))
    height[6, 24], height[6, 6] = -1.0, 1.0
    nothing = np.zeros((20, 30), bool)
    assert centers(nothing, design=design, height=height).tolist() == [[24.5 * CELL, 6.5 * CELL]]
