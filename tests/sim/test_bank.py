"""Bank and loose soil: what is cut or slumps away swells, exactly; a swell of 0 changes nothing."""

from math import sqrt

import numpy as np
import pytest

from dirt_env.bench.stability.worlds import grown
from dirt_env.sim.advance import advance, place, settle
from dirt_env.sim.bank import Bank, bank_gain, bank_metres, growth
from dirt_env.sim.jit import entry
from dirt_env.sim.lanes import LANES, load, store
from dirt_env.sim.params import Blade, Command, Machine
from dirt_env.sim.slump import limits
from tests.sim.worlds import FINE, SOIL, line_at, settled, straight, sweep_blade, world_of

BLADE, MACHINE = Blade(), Machine()
SWELLING = SOIL._replace(swell=0.3)
QUARTER = SOIL._replace(swell=0.25)


def lock_of(world, soil):
    """The rounding constant, in the ground's own precision."""
    return np.float32(limits(world.height, world.quantum, 0.5, soil.slope, soil.tolerance)[2])


def undisturbed(world):
    """The world with all of its ground undisturbed."""
    return world._replace(bank=world.height.copy(), natural=world.height.copy())


def total(height):
    return float(height.sum(dtype=np.float64))


def driven(ground, soil, banked=True, steps=150, **others):
    world, grid, _ = settled(ground, **others)
    if banked:
        world = undisturbed(world)
    place(world, grid, soil, BLADE, MACHINE, 14.0, 12.0, 0.0)
    start, lost, rng = world.height.copy(), 0.0, np.random.default_rng(8)
    for speed, yaw_rate, edge in rng.uniform((-2, -0.6, -0.25), (2, 0.6, 0.2), (steps, 3)):
        advance(world, grid, soil, BLADE, MACHINE, Command(speed, yaw_rate, edge), 0.5)
        lost += world.tally[0].lost / grid.cell**2
    return world, start, lost


def rough(rows=48, cols=56):
    return np.random.default_rng(1).normal(0.0, 0.2, (rows, cols))


@pytest.mark.slow
def test_a_swell_of_0_changes_nothing_to_the_last_bit():
    (plain, _, _), (told, _, _) = driven(rough(), SOIL, banked=False), driven(rough(), SOIL)
    assert plain.bank is None
    assert (told.natural - told.bank).max() > 0.1
    for name in ("height", "machine", "tally", "changed", "pending"):
        assert getattr(plain, name).tobytes() == getattr(told, name).tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("open_border", [False, True])
def test_the_ground_gains_what_the_maps_say_to_the_last_bit(open_border):
    world, start, lost = driven(rough(), SWELLING, open_border=open_border)
    gain = grown(world, SWELLING)
    assert gain > 1.0
    assert total(world.height) + lost == pytest.approx(total(start) + gain, abs=1e-9 * open_border)
    assert np.all(world.bank <= world.height)
    assert np.all(world.bank <= world.natural)
    assert (world.height / world.quantum == np.round(world.height / world.quantum)).all()


@pytest.mark.slow
def test_the_mass_of_the_soil_is_kept():
    """Bank soil, and loose soil by 1 / (1 + s); rounding is half a quantum a cell at most."""
    world, start, _ = driven(rough(), SWELLING)
    mass = world.bank + (world.height.astype(float) - world.bank) / 1.3
    cells = np.count_nonzero(world.bank < world.natural)
    assert abs(mass.sum() - total(start)) <= 0.5 * world.quantum * cells / 1.3


def test_loose_soil_does_not_swell_again():
    ground = np.zeros((20, 40))
    ground[5:15, 10:20] = 0.6
    world, grid, _ = settled(ground)
    world = world._replace(bank=np.zeros_like(world.height), natural=np.zeros_like(world.height))
    before = total(world.height)
    sweep_blade(world, grid, straight(3.0, 5.0, 0.0, 10.0, 0.2, width=6.0, edge=0.1), SWELLING)
    assert total(world.height) == before
    assert np.all(world.bank == 0.0)


@pytest.mark.slow
def test_a_layer_dozed_in_a_channel_makes_a_berm_of_its_loose_volume():
    """p(D) = sqrt(2 k t D (1 + s)) above the layer, and a clean track behind."""
    depth, way, soil = 0.125, 10.0, FINE._replace(swell=0.25)
    world, grid = world_of(np.zeros((8, 120)), 0.25)
    world = undisturbed(world)
    lines = straight(2.0, 1.0, 0.0, way, 0.1, width=2.0, edge=-depth, height=3.0)
    sweep_blade(world, grid, lines, soil)
    cut = np.count_nonzero(world.bank[4] < 0) * 0.25
    assert cut == pytest.approx(way, abs=0.25)
    assert total(world.height) * 0.25**2 == pytest.approx(0.25 * depth * cut * 2.0, rel=1e-5)
    assert world.height[4, 9:40] == pytest.approx(-depth, abs=1e-6)
    berm = sqrt(2 * soil.slope * depth * way * 1.25)
    assert world.height[4].max() == pytest.approx(berm - 0.125 * soil.slope, rel=0.01)  # half a cell ahead


def test_a_bank_that_slumps_loosens_where_it_was():
    ground = np.zeros((5, 40))
    ground[:, 20:] = 2.0
    world, grid = world_of(ground)
    world = undisturbed(world)
    start = total(world.height)
    settle(world, grid, QUARTER)
    assert total(world.height) == start + grown(world, QUARTER)
    assert grown(world, QUARTER) > 0.5
    assert np.all(world.bank <= world.height)
    assert world.pending[1] <= world.pending[0]
    one = np.abs(np.diff(world.height[2])).max() / 0.5
    assert one <= QUARTER.slope * (1 + QUARTER.tolerance) * (1 + 1e-5)


def test_mirrored_banks_give_mirrored_grounds_to_the_last_bit():
    ground = np.random.default_rng(5).normal(0.0, 0.6, (24, 24))
    found = []
    for turn in (lambda a: a, np.fliplr, np.flipud, np.transpose):
        world, grid = world_of(np.ascontiguousarray(turn(ground)))
        world = undisturbed(world)
        settle(world, grid, SWELLING)
        found.append((turn(world.height), turn(world.bank)))
    for height, bank in found[1:]:
        np.testing.assert_array_equal(found[0][0], height)
        np.testing.assert_array_equal(found[0][1], bank)


@pytest.mark.slow
def test_many_small_cuts_gain_what_one_deep_cut_does():
    gains = []
    for depths in ([0.2], np.linspace(0.0, 0.2, 1001)[1:]):
        world, grid = world_of(np.zeros((12, 24)))
        world = undisturbed(world)
        for depth in depths:
            for edge, way in ((-depth, (4.1, 4.4)), (1.0, (4.4, 4.1))):
                sweep_blade(world, grid, [line_at(x, 3.0, 0.0, edge=edge) for x in way], SWELLING)
        column = world.natural[:, 8] - world.bank[:, 8]
        assert column[3:9] == pytest.approx(0.2, abs=world.quantum)
        assert total(world.height) == grown(world, SWELLING)
        gains.append(grown(world, SWELLING))
    assert gains[0] > 0


def test_what_is_to_be_added_is_a_matter_of_the_depth_alone():
    world = undisturbed(world_of(np.zeros((3, 3)))[0])
    lock = lock_of(world, SOIL)
    bank = Bank(world.bank, world.natural, 0.3)
    height = np.float32(-100 * world.quantum)
    assert growth(bank, 1, 1, height, lock) == np.float32(30 * world.quantum)
    bank.now[1, 1] = np.float32(-99 * world.quantum)  # 29.7 quanta, rounded, have been added before
    assert growth(bank, 1, 1, height, lock) == 0.0
    assert growth(bank, 1, 1, np.float32(0.0), lock) == 0.0


@entry
def metres_and_gain(numbers, found):
    """Both of the columns (height, now, natural, target) that numbers f8[4, LANES] has."""
    height, now, natural, target = (
        load(numbers[0], 0, LANES), load(numbers[1], 0, LANES), load(numbers[2], 0, LANES), load(numbers[3], 0, LANES),
    )  # fmt: skip
    store(found[0], 0, bank_metres(height, now, target, 0.8), LANES)
    store(found[1], 0, bank_gain(height, now, natural, target, 0.8), LANES)


def of_column(height, now, natural, target):
    """(metres of bank soil over the target, gain) of one column, the last of some."""
    numbers, found = np.zeros((4, LANES)), np.zeros((2, LANES))
    numbers[:, -1] = height, now, natural, target
    metres_and_gain(numbers, found)
    return found[:, -1]


@pytest.mark.parametrize(
    ("height", "now", "target", "expected"),
    [
        (1.0, 0.0, 0.0, 0.8),  # a heap on the ground
        (0.0, 0.0, -1.0, 1.0),  # ground over a pit's floor
        (0.5, 0.0, -1.0, 1.4),  # with loose soil on it
        (0.5, -2.0, -1.0, 1.2),  # loose soil over the floor of a pit that was dug too deep
        (-1.0, -1.0, 0.0, -0.8),  # a hollow that is to be filled with loose soil
        (0.3, 0.1, 0.3, 0.0),
    ],
)
def test_soil_over_a_target_counts_as_bank_soil(height, now, target, expected):
    assert of_column(height, now, 0.0, target)[0] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("height", "now", "natural", "target", "expected"),
    [
        (1.25, 0.0, 0.0, 0.0, 1.0),
        (-1.0, -1.0, 0.0, 0.0, -1.0),  # dug away
        (0.25, -1.0, 0.0, 0.0, 0.0),  # dug and put back
        (1.5, 0.0, 0.0, 1.0, 0.4),  # loose soil lay there at the start
    ],
)
def test_what_a_column_gains_counts_as_bank_soil(height, now, natural, target, expected):
    assert of_column(height, now, natural, target)[1] == pytest.approx(expected)


def test_methods_that_know_loose_soil_only_are_refused():
    world, grid = world_of(np.zeros((6, 6)))
    with pytest.raises(ValueError, match="method is 'super' where soils differ or swell; allowed: auto, explicit"):
        settle(undisturbed(world), grid, QUARTER, "super")
