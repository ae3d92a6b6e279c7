"""Goals with room."""

import numpy as np
from dirt_env.baselines.pushing.assign import assign


def test_cells_go_to_the_nearest_goal_with_room():
    cost = np.array([[1.0, 5.0], [2.0, 5.0], [5.0, 1.0]])
    assert assign(cost, np.ones(3), np.array([10.0, 10.0])).tolist() == [0, 0, 1]


def test_where_room_is_short_those_stay_that_would_lose_most():
    cost = np.array([[1.0, 2.0], [1.0, 9.0]])
    assert assign(cost, np.ones(2), np.array([1.0, 10.0])).tolist() == [1, 0]


def test_without_room_anywhere_soil_goes_where_most_is_left():
    assert assign(np.array([[1.0, 2.0]]), np.array([5.0]), np.array([0.0, 1.0])).tolist() == [1]


def test_no_cells():
    assert assign(np.empty((0, 2)), np.empty(0), np.ones(2)).shape == (0,)
