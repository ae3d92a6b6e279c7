"""One-shot projection: the collapse of a column, with exact volume; and where it does not apply."""

import numpy as np
import pytest

from dirt_env.sim.advance import settle
from tests.sim.worlds import FINE, cone, world_of

SIDE, CELL = 64, 0.5


def column():
    ground = np.zeros((SIDE, SIDE))
    ground[28:36, 28:36] = 10.0
    return ground


def test_a_column_collapses_to_the_cone_with_equal_volume():
    ground = column()
    world, grid = world_of(ground, CELL)
    assert settle(world, grid, FINE, "projection") > 0
    exact = cone(SIDE, CELL, 16.0, 16.0, ground.sum() * CELL**2, FINE.slope)
    assert np.abs(world.height - exact).sum() / exact.sum() < 0.025
    assert world.height.sum(dtype=np.float64) == ground.sum()


def test_ground_at_rest_stays_as_it_is():
    ground = np.add.outer(np.zeros(20), 0.2 * np.arange(30))
    world, grid = world_of(ground, CELL)
    before = world.height.copy()
    settle(world, grid, FINE, "projection")
    np.testing.assert_array_equal(world.height, before)


@pytest.mark.parametrize("feature", [{"open_border": True}, {"solid": np.eye(SIDE, dtype=bool)}])
def test_it_is_refused_where_soil_can_leave_or_something_stands(feature):
    world, grid = world_of(column(), CELL, **feature)
    with pytest.raises(ValueError, match=r"projection.*allowed: walls only"):
        settle(world, grid, FINE, "projection")
