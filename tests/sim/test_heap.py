"""Soil poured out at a point: the exact cone, also at walls and in corners, with exact volume."""

import numpy as np
import pytest

from dirt_env.sim.heap import dump
from tests.sim.worlds import SOIL, cone, world_of

SIDE, CELL = 64, 0.5


@pytest.mark.parametrize(("x", "y", "share"), [(16.0, 16.0, 1), (15.9, 16.3, 1), (0.0, 16.0, 2), (0.0, 0.0, 4)])
def test_a_heap_is_the_cone_or_a_half_or_a_quarter_of_one(x, y, share):
    world, grid = world_of(np.zeros((SIDE, SIDE)), CELL)
    poured = dump(world, grid, SOIL, x, y, 40.0)
    exact = cone(SIDE, CELL, x, y, share * 40.0, SOIL.slope)
    assert np.abs(world.height - exact).sum() / exact.sum() < 0.002
    assert world.height.sum(dtype=np.float64) * CELL**2 == poured == pytest.approx(40.0, abs=world.quantum)


def test_soil_is_poured_onto_what_is_there():
    ground = np.add.outer(0.1 * np.arange(SIDE), np.zeros(SIDE))
    world, grid = world_of(ground, CELL)
    before = world.height.copy()
    poured = dump(world, grid, SOIL, 16.0, 16.0, 10.0)
    gained = world.height.astype(float) - before
    assert gained.min() == 0
    assert gained.sum() * CELL**2 == poured
    np.testing.assert_array_equal(gained, gained[:, ::-1])


@pytest.mark.parametrize(
    ("x", "y", "volume", "message"),
    [
        (-1.0, 5.0, 1.0, "a heap at x -1 m, y 5 m; allowed"),
        (5.0, 5.0, -2.0, "volume is -2 m3"),
        (5.0, 5.0, np.nan, "volume is nan m3"),
    ],
)
def test_a_bad_heap_is_refused_and_nothing_changes(x, y, volume, message):
    world, grid = world_of(np.zeros((SIDE, SIDE)), CELL)
    with pytest.raises(ValueError, match=message):
        dump(world, grid, SOIL, x, y, volume)
    assert not world.height.any()
