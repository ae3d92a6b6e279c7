"""Made ground: heights asked for, slopes that the soil can stand, seeds."""

import numpy as np
import pytest

from dirt_env.scene.ground import Flat, Mounds, Ridge, Rough, face_slopes, steepest
from dirt_env.sim.params import Grid

GRID = Grid(40, 56, 0.5)
K = 0.7
ALL = [Flat(), Mounds(), Ridge(), Rough((0.5, 0.5), 4.0)]


@pytest.mark.parametrize("ground", ALL, ids=lambda ground: ground.kind)
def test_stays_within_repose_and_repeats_by_generator(ground):
    first = ground.make(GRID, K, np.random.default_rng(3))
    assert first.shape == (40, 56)
    assert first.min() >= 0
    assert steepest(first, GRID.cell) <= K
    assert (first == ground.make(GRID, K, np.random.default_rng(3))).all()


def test_rough_ground_has_its_height_and_is_lowered_where_it_would_be_too_steep():
    gentle = Rough((0.3, 0.3), 6.0).make(GRID, K, np.random.default_rng(1))
    assert gentle.max() - gentle.min() == pytest.approx(0.3)
    wild = Rough((9.0, 9.0), 2.0).make(GRID, K, np.random.default_rng(1))
    assert steepest(wild, GRID.cell) == pytest.approx(0.9 * K)


def test_ridge_runs_where_it_is_told():
    ridge = Ridge((0.5, 0.5), 8.0, (14.0, 10.0), 90.0).make(GRID, K, np.random.default_rng(0))
    np.testing.assert_allclose(ridge, np.broadcast_to(ridge[0], ridge.shape), atol=1e-12)  # north to south
    assert ridge.max() == pytest.approx(0.5 * np.cos(np.pi * 0.25 / 8) ** 2)
    assert ridge[:, :19].max() < 1e-12


def test_slope_of_a_plane_is_exact_in_every_direction():
    y, x = np.mgrid[0:6, 0:7] * 0.5
    inner = face_slopes(0.3 * x + 0.4 * y, 0.5)
    assert inner.max() == pytest.approx(0.5)
    assert steepest(np.array([[0.0, 1.0]]), 0.5) == pytest.approx(2.0)
    assert steepest(np.array([[0.0, np.nan, 5.0]]), 1.0) == 0.0
