"""Heaps and layers: exact volumes, shapes at repose, limits."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dirt_env.scene.ground import Rough, steepest
from dirt_env.scene.heaps import capacity, cone_radius, heap, heap_limit, layer
from dirt_env.scene.layout import centres
from dirt_env.sim.params import Grid

GRID = Grid(48, 64, 0.5)
K = 0.7


def volume(height: np.ndarray, ground: np.ndarray | float = 0.0, grid: Grid = GRID) -> float:
    return float((height - ground).sum() * grid.cell**2)


@settings(max_examples=60, deadline=None)
@given(
    st.floats(1e-3, 400.0),
    st.floats(0.0, 31.999),
    st.floats(0.0, 23.999),
    st.floats(0.05, 5.0),
    st.integers(0, 1000),
)
def test_volume_is_exact_anywhere_on_rough_ground(wanted, x, y, slope, seed):
    ground = Rough((0.5, 0.5), 5.0).make(GRID, slope, np.random.default_rng(seed))
    result = heap(ground, GRID, (x, y), wanted, slope)
    assert (result >= ground).all()
    np.testing.assert_allclose(volume(result, ground), wanted, rtol=1e-12, atol=1e-13)


def test_free_cone_has_the_height_of_the_formula():
    # V = pi H^3 / (3 k^2)
    fine = Grid(256, 256, 0.0625)
    result = heap(np.zeros((256, 256)), fine, (8.0, 8.0), 20.0, K)
    assert result.max() == pytest.approx((3 * 20.0 * K**2 / pi) ** (1 / 3), rel=0.02)
    x, y = centres(fine)
    foot = np.hypot(x - 8.0, y - 8.0)[result > 0].max()
    assert foot == pytest.approx(cone_radius(20.0, K), rel=0.02)
    assert steepest(result, fine.cell) == pytest.approx(K, rel=1e-3)


@pytest.mark.parametrize(("source", "share"), [((0.0, 8.0), 2), ((0.0, 0.0), 4)])
def test_heap_at_a_wall_is_half_a_cone_and_in_a_corner_a_quarter(source, share):
    fine = Grid(256, 256, 0.0625)
    ground = np.zeros((256, 256))
    whole = heap(ground, fine, (8.0, 8.0), 20.0, K)
    part = heap(ground, fine, source, 20.0 / share, K)
    assert part.max() == pytest.approx(whole.max(), rel=0.01)


def test_a_huge_heap_floods_the_site_and_keeps_its_volume():
    result = heap(np.zeros((48, 64)), GRID, (16.0, 12.0), 5000.0, K)
    assert result.min() > 0
    assert volume(result) == pytest.approx(5000.0, rel=1e-12)


def test_no_repose_gives_a_lake():
    result = heap(np.zeros((48, 64)), GRID, (16.0, 12.0), 48 * 64 * 0.25, 0.0)
    np.testing.assert_allclose(result, 1.0, rtol=1e-12)


def test_solid_cells_and_what_they_hide_stay_empty():
    solid = np.zeros((48, 64), dtype=bool)
    solid[:, 33] = True
    result = heap(np.zeros((48, 64)), GRID, (16.0, 12.0), 20.0, K, solid)
    assert not result[:, 33:].any()
    assert volume(result) == pytest.approx(20.0, rel=1e-12)


def test_a_heap_on_a_solid_cell_is_an_error():
    with pytest.raises(ValueError, match="solid cell"):
        heap(np.zeros((48, 64)), GRID, (16.0, 12.0), 20.0, K, np.ones((48, 64), dtype=bool))


def test_heap_limit_is_the_last_heap_inside_its_region():
    x, y = centres(GRID)
    region = np.hypot(x - 16.25, y - 12.25) <= 3.0
    ground = np.zeros((48, 64))
    most = heap_limit(ground, GRID, (16.25, 12.25), K, region)
    assert not (heap(ground, GRID, (16.25, 12.25), most, K) > 1e-9)[~region].any()
    assert (heap(ground, GRID, (16.25, 12.25), most * 1.01, K) > 1e-9)[~region].any()
    assert np.isinf(heap_limit(ground, GRID, (16.25, 12.25), K, np.ones((48, 64), dtype=bool)))


def test_layer_has_its_depth_inside_and_lies_at_repose_along_its_rim():
    region = np.zeros((48, 64), dtype=bool)
    region[10:20, 10:30] = True
    thin, thick = layer(region, GRID, 0.3, K), layer(region, GRID, 1.0, K)
    assert volume(thin) == pytest.approx(0.3 * 5 * 10)  # 0.3 m < k * 0.5 m: no taper within the grid
    assert thick.max() == 1.0
    assert thick[10, 15] == pytest.approx(K * 0.5)
    assert steepest(thick, 0.5) <= K * 1.04  # along the mitred corners
    assert not thick[~region].any()


def test_layer_is_held_by_the_border_and_by_solid_cells():
    region = np.zeros((48, 64), dtype=bool)
    region[:4, :] = True
    solid = np.zeros_like(region)
    solid[4, :] = True
    assert (layer(region, GRID, 1.5, K, solid)[:4] == 1.5).all()


def test_capacity_is_the_cone_on_a_disc_and_the_pyramid_on_a_square():
    x, y = centres(GRID)
    disc = np.hypot(x - 16, y - 12) <= 8.0
    assert capacity(disc, GRID, K) == pytest.approx(K * pi * 8.0**3 / 3, rel=0.1)
    square = np.zeros((48, 64), dtype=bool)
    square[4:44, 4:44] = True
    assert capacity(square, GRID, K) == pytest.approx(K * 10.0 * 400.0 / 3, rel=0.08)
