"""Hauling distances: exact without obstacles, round them with."""

import numpy as np
import pytest

from dirt_env.task.haul import haul_distance


def nearest(welcome: np.ndarray) -> np.ndarray:
    """Distance in cells to the nearest welcome cell, by trying them all."""
    targets = np.argwhere(welcome)
    cells = np.argwhere(np.ones_like(welcome))
    return np.hypot(*(cells[:, None] - targets[None]).transpose(2, 0, 1)).min(axis=1).reshape(welcome.shape)


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 2), (17, 23)])
@pytest.mark.parametrize("density", [0.02, 0.3, 1.0])
def test_straight_distances_are_exact(shape, density):
    welcome = np.random.default_rng(3).random(shape) < density
    welcome[-1, 0] = True
    np.testing.assert_allclose(haul_distance(welcome, None, 0.25), 0.25 * nearest(welcome), rtol=1e-14)


def test_nothing_welcome_is_one_cell_everywhere():
    assert np.array_equal(haul_distance(np.zeros((3, 4), bool), None, 0.5), np.full((3, 4), 0.5))


def test_obstacles_out_of_the_way_change_nothing():
    welcome, solid = np.zeros((2, 20, 20), bool)
    welcome[4:7, 4:7] = True
    free = haul_distance(welcome, None, 1.0)
    assert np.array_equal(haul_distance(welcome, solid, 1.0), free)
    solid[19, 19] = True
    assert np.array_equal(haul_distance(welcome, solid, 1.0), free)


def test_the_way_leads_round_a_wall():
    """A wall with its end at row 30 between goal and cell: two straight legs over its corner."""
    welcome, solid = np.zeros((2, 41, 41), bool)
    welcome[10, 5] = True
    solid[:30, 20] = True
    around = haul_distance(welcome, solid, 1.0)[10, 35]
    exact = 2 * np.hypot(15, 20)
    assert exact <= around <= 1.05 * exact


def test_a_cell_without_a_way_has_the_straight_distance():
    welcome, solid = np.zeros((2, 9, 9), bool)
    welcome[0, 0] = True
    solid[3:6, 3:6] = True
    solid[4, 4] = False
    assert haul_distance(welcome, solid, 1.0)[4, 4] == pytest.approx(np.hypot(4, 4))


@pytest.mark.parametrize("turn", [0, 1, 2, 3])
def test_turning_the_site_turns_the_distances(turn):
    """Within the accuracy of the way round; which of two cells at the same distance is nearest is a matter of order."""
    welcome, solid = np.zeros((2, 24, 24), bool)
    welcome[3:5, 2:6] = True
    solid[8:10, 0:18] = True
    turned = haul_distance(np.rot90(welcome, turn), np.rot90(solid, turn), 1.0)
    np.testing.assert_allclose(turned, np.rot90(haul_distance(welcome, solid, 1.0), turn), rtol=0.05)
