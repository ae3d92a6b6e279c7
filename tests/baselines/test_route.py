"""Ways round what is solid."""

from itertools import pairwise

import numpy as np
from dirt_env.baselines.pushing.route import is_clear, way

CELL = 0.5


def _wall() -> np.ndarray:
    """A site of 20 m x 20 m with a wall from the south up to 15 m."""
    blocked = np.zeros((40, 40), bool)
    blocked[:30, 18:21] = True
    return blocked


def test_a_clear_line_is_the_way():
    assert way(np.zeros((40, 40), bool), CELL, (2.0, 2.0), (18.0, 17.0)) == [(18.0, 17.0)]


def test_the_way_round_is_clear_and_not_much_longer_than_the_shortest():
    blocked, start, end = _wall(), (2.0, 5.0), (18.0, 5.0)
    points = [start, *way(blocked, CELL, start, end)]
    assert points[-1] == end
    assert all(is_clear(blocked, CELL, a, b) for a, b in pairwise(points))
    length = sum(np.hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(points))
    shortest = np.hypot(7.0, 10.0) + 1.5 + np.hypot(7.5, 10.0)
    assert length < 1.15 * shortest


def test_there_is_none_through_a_closed_wall():
    blocked = _wall()
    blocked[:, 18:21] = True
    assert way(blocked, CELL, (2.0, 5.0), (18.0, 5.0)) is None


def test_a_line_may_leave_blocked_ground_but_not_enter_it():
    blocked = _wall()
    assert is_clear(blocked, CELL, (9.75, 5.0), (15.0, 5.0))
    assert not is_clear(blocked, CELL, (15.0, 5.0), (9.75, 5.0))
