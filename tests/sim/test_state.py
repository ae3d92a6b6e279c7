"""A world's arrays: what is refused, and that heights are exact multiples of a fine quantum."""

import numpy as np
import pytest

from dirt_env.sim.params import Grid
from dirt_env.sim.state import make_world, quantum_for


@pytest.mark.parametrize(("cell", "relief"), [(0.5, 2.0), (0.01, 0.05), (30.0, 800.0), (0.5, 900.0)])
def test_heights_are_multiples_of_a_power_of_two_and_fit_a_quarter_of_the_exact_range(cell, relief):
    quantum = quantum_for(cell, relief)
    assert np.log2(quantum).is_integer()
    assert relief <= quantum * 2**22
    assert quantum <= cell / 1024
    ground = np.random.default_rng(0).uniform(-relief, relief, (5, 7))
    world = make_world(ground, Grid(5, 7, cell))
    steps = world.height.astype(np.float64) / world.quantum
    np.testing.assert_array_equal(steps, np.round(steps))
    assert np.abs(world.height - ground).max() <= quantum / 2


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_ground_that_is_not_finite_is_refused(bad):
    ground = np.zeros((4, 4))
    ground[1, 2] = bad
    with pytest.raises(ValueError, match="1 cells that are not finite"):
        make_world(ground, Grid(4, 4, 0.5))


def test_a_wrong_shape_is_refused_with_both():
    with pytest.raises(ValueError, match=r"\(4, 5\); allowed: \(5, 4\)"):
        make_world(np.zeros((4, 5)), Grid(5, 4, 0.5))


@pytest.mark.parametrize("spike", [1e5, 1e300])
def test_relief_beyond_the_exact_range_is_refused_with_both_numbers(spike):
    ground = np.zeros((4, 4))
    ground[2, 2] = spike
    with pytest.raises(ValueError, match=r"reach .* m from the datum; allowed with cells of 0.5 m: 1024 m"):
        make_world(ground, Grid(4, 4, 0.5))


def test_what_a_scene_does_not_have_is_not_allocated():
    world = make_world(np.zeros((8, 8)), Grid(8, 8, 0.5), solid=np.zeros((8, 8), bool))
    assert world.solid is None
    assert world.outside is None
