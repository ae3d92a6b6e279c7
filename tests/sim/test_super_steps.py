"""Long avalanches by super-steps: the same piles as sweep by sweep, for fewer stages."""

import numpy as np
import pytest

from dirt_env.sim.advance import settle
from dirt_env.sim.diagnostics import steepest
from tests.sim.worlds import FINE, cone, world_of

SIDE, CELL, HIGH = 48, 0.5, 12.0


def tower(rows=SIDE, cols=SIDE, first=20, wide=6):
    ground = np.zeros((rows, cols))
    ground[first : first + wide, first : first + wide] = HIGH
    return ground


def settled_by(method, ground, **others):
    world, grid = world_of(ground, CELL, **others)
    return world, settle(world, grid, FINE, method)


@pytest.mark.parametrize("method", ["super", "auto"])
def test_a_column_collapses_to_the_cone_in_fewer_stages_than_sweeps(method):
    ground = tower()
    world, stages = settled_by(method, ground)
    plain, sweeps = settled_by("explicit", ground)
    exact = cone(SIDE, CELL, 11.5, 11.5, ground.sum() * CELL**2, FINE.slope)
    error = np.abs(world.height - exact).sum() / exact.sum()
    assert error < 0.015
    assert stages < sweeps / 2
    assert np.abs(world.height - plain.height).sum() / exact.sum() < 0.01
    assert world.height.sum(dtype=np.float64) == ground.sum()
    assert 0.99 * FINE.slope < steepest(world.height, CELL) <= FINE.slope * 1.005
    assert world.pending[1] <= world.pending[0]


def test_fine_cells_do_not_flatten_the_pile_by_rounding():
    """Where the quantum is coarse for the cell, the result is that of a finer one; momentum would add the noise up."""
    ground = np.zeros((160, 160))
    ground[70:90, 70:90] = 28.0
    soil, cell = FINE._replace(tolerance=1e-3), 1 / 16
    world, grid = world_of(ground, cell)
    stages = settle(world, grid, soil, "super")
    finer, _ = world_of(ground, cell, dtype=np.float64)
    finer = finer._replace(quantum=finer.quantum / 1024)
    more = settle(finer, grid, soil, "super")
    assert np.abs(world.height - finer.height).sum() / ground.sum() < 1e-3
    assert stages < 1.2 * more


def test_volume_is_exact_where_the_rows_are_swept_in_several_blocks():
    ground = np.random.default_rng(0).uniform(-3.0, 3.0, (4, 2000))
    world, grid = world_of(ground, CELL)
    before = world.height.sum(dtype=np.float64)
    settle(world, grid, FINE, "super")
    assert world.height.sum(dtype=np.float64) == before


@pytest.mark.parametrize("turn", [np.fliplr, np.flipud, np.transpose])
def test_turned_ground_gives_the_turned_pile_to_the_last_bit(turn):
    ground = tower(40, 40, 4, 5)
    ground[20:24, 30:33] = 5.0
    whole, _ = settled_by("super", ground)
    turned, _ = settled_by("super", turn(ground))
    np.testing.assert_array_equal(turned.height, turn(whole.height))


def test_what_leaves_over_an_open_border_is_in_the_ledger():
    ground = tower(30, 30, 1, 6)
    world, _ = settled_by("super", ground, open_border=True)
    lost = world.tally[0].lost
    assert lost > 0
    assert world.height.sum(dtype=np.float64) * CELL**2 + lost == ground.sum() * CELL**2


def test_no_soil_passes_a_wall():
    solid = np.zeros((30, 40), bool)
    solid[:, 18] = True
    world, _ = settled_by("super", tower(30, 40, 10, 6), solid=solid)
    assert world.height[:, 18:].max() == 0
    assert world.height[:, 17].max() > 1
    assert world.height.sum(dtype=np.float64) == 36 * HIGH


def test_an_unknown_method_is_refused():
    world, grid = world_of(tower())
    with pytest.raises(ValueError, match="method is 'quick'; allowed: auto, explicit, super, projection"):
        settle(world, grid, FINE, "quick")
