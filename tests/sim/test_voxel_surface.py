"""The surface over the cells: the paper's formula, averaged normals, interpolation."""

import numpy as np
import pytest

from dirt_env.sim.params import Grid
from dirt_env.sim.voxel_state import make_voxels
from dirt_env.sim.voxel_surface import normals_of, position_on_surface, top_of


def surface_of(voxels):
    inner = voxels.fill[1:-1, 1:-1]
    return np.array([[top_of(column, voxels.bottom, voxels.dy) for column in row] for row in inner])


def test_a_surface_point_is_ymin_and_level_and_fill_of_the_topmost_cell_that_is_not_empty():
    voxels = make_voxels(np.zeros((1, 2)), Grid(1, 2, 1.0), 0.5, -2.0, 6)
    voxels.fill[:] = 0.0
    voxels.fill[1, 1, 1:4] = 1.0, 1.0, 0.25
    voxels.fill[1, 2, 5] = 0.5  # in the air: the lower cells are empty
    expected = [[-2.0 + (2 + 0.25) * 0.5, -2.0 + (4 + 0.5) * 0.5]]
    np.testing.assert_array_equal(surface_of(voxels), expected)
    voxels.fill[1, 1] = 0.0
    assert surface_of(voxels)[0, 0] == -2.0


def test_cells_made_from_a_ground_have_it_as_their_surface():
    ground = np.random.default_rng(0).uniform(-1.0, 1.9, (7, 8))
    voxels = make_voxels(ground, Grid(7, 8, 0.5), 0.5, -1.5, 7)
    np.testing.assert_allclose(surface_of(voxels), ground, atol=1e-12)


def test_normals_of_a_plane_are_those_of_the_plane_away_from_the_rim():
    x, y = np.meshgrid(np.arange(6) * 0.5, np.arange(5) * 0.5)
    normals = normals_of(0.3 * x - 0.7 * y, 0.5)
    expected = np.array([-0.3, 0.7, 1.0]) / np.sqrt(0.3**2 + 0.7**2 + 1.0)
    np.testing.assert_allclose(normals[1:-1, 1:-1], np.broadcast_to(expected, (3, 4, 3)), atol=1e-12)


def test_a_normal_is_the_mean_of_the_facets_around_it():
    surface = np.zeros((3, 3))
    surface[1, 1] = 1.0
    normals = normals_of(surface, 1.0)
    np.testing.assert_allclose(normals[1, 1], [0.0, 0.0, 1.0], atol=1e-15)
    assert normals[1, 0, 0] < 0.0 < normals[1, 2, 0], "they lean away from the top"
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1.0, atol=1e-15)


def test_positions_and_slopes_are_interpolated_between_the_columns():
    x, y = np.meshgrid((np.arange(6) + 0.5) * 0.5, (np.arange(5) + 0.5) * 0.5)
    surface = 2.0 + 0.25 * x - 0.5 * y
    expected = 2.0 + 0.25 * 1.3 - 0.5 * 1.1, 0.25, -0.5
    assert position_on_surface(surface, 0.5, 1.3, 1.1) == pytest.approx(expected)


def test_slopes_between_columns_are_those_of_the_normals_there():
    surface = np.random.default_rng(2).uniform(0.0, 1.0, (6, 7))
    normals = normals_of(surface, 0.5)
    at = {
        (r, c): position_on_surface(surface, 0.5, (c + 0.5) * 0.5, (r + 0.5) * 0.5) for r in range(6) for c in range(7)
    }
    for (r, c), found in at.items():
        east, north, up = normals[r, c]
        assert found == pytest.approx((surface[r, c], -east / up, -north / up))
    east, north, up = 0.5 * (normals[2, 3] + normals[2, 4])
    assert position_on_surface(surface, 0.5, 2.0, 1.25)[1:] == pytest.approx((-east / up, -north / up))
