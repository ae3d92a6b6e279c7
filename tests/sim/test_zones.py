"""Soils that differ from place to place: neutral ones change nothing, each stands and resists as its numbers say."""

from math import pi, radians, sqrt

import numpy as np
import pytest

from dirt_env.sim.advance import advance, place, settle
from dirt_env.sim.blade import line_of
from dirt_env.sim.diagnostics import volume
from dirt_env.sim.draft import draft_force
from dirt_env.sim.laws import GRAVITY
from dirt_env.sim.machine import facing_of
from dirt_env.sim.params import Blade, Command, Grid, Machine, Strength, Traction
from dirt_env.sim.thrust import mobilised_share
from dirt_env.sim.traction import cut_of, effort, pull_of
from dirt_env.sim.zones import count_ahead, count_under, extremes
from tests import naive
from tests.sim.worlds import FINE, line_at, settled, slump_against, soil_of, world_of, zones_of

BLADE, MACHINE = Blade(), Machine()
SOFT, HARD = soil_of(25.0, density=1400.0), soil_of(40.0, density=1900.0)
LOOSE = Strength(internal_friction=radians(30.0), external_friction=0.0)
STIFF = LOOSE._replace(cohesion=2e4)
UPRIGHT = Traction(rake=radians(90.0), rolling_resistance=0.0)


def pull(soil, strength, traction=UPRIGHT):
    return pull_of(soil, strength, BLADE, MACHINE, traction)


def patches(rows, cols, kinds=2, seed=3):
    """Random numbers of soils in blocks of 3 x 3 cells."""
    coarse = np.random.default_rng(seed).integers(0, kinds, (rows // 3 + 1, cols // 3 + 1))
    return np.kron(coarse, np.ones((3, 3), int))[:rows, :cols]


def driven(ground, soil, pulled, zones=None, steps=120, **others):
    world, grid, _ = settled(ground, soil=soil, **others)
    place(world, grid, soil, BLADE, MACHINE, 14.0, 12.0, 0.0, zones)
    rng, tallies = np.random.default_rng(8), []
    for speed, yaw_rate, edge in rng.uniform((-2, -0.6, -0.25), (2, 0.6, 0.3), (steps, 3)):
        advance(world, grid, soil, BLADE, MACHINE, Command(speed, yaw_rate, edge), 0.5, pulled, zones)
        tallies.append(world.tally[0].copy())
    return world, np.array(tallies)


@pytest.mark.slow
@pytest.mark.parametrize("strength", [None, STIFF])
def test_soils_with_the_same_numbers_change_nothing_to_the_last_bit(strength):
    ground, soil = np.random.default_rng(1).normal(0.0, 0.2, (48, 56)), soil_of(33.0, density=1600.0)
    pulled = None if strength is None else pull(soil, strength, Traction())
    one, told = driven(ground, soil, pulled)
    zones = zones_of(patches(48, 56, 3), [soil] * 3, None if pulled is None else [pulled] * 3)
    other, said = driven(ground, soil, pulled, zones)
    assert one.height.tobytes() == other.height.tobytes()
    assert one.machine.tobytes() == other.machine.tobytes()
    assert told.tobytes() == said.tobytes()
    assert told["work"].max() > 0


@pytest.mark.slow
@pytest.mark.parametrize("open_border", [False, True])
def test_volume_stays_equal_where_soils_differ(open_border):
    ground = np.random.default_rng(1).normal(0.0, 0.2, (48, 56))
    zones = zones_of(patches(48, 56), [SOFT, HARD])
    settle(*(worlds := world_of(ground, open_border=open_border)), SOFT, zones=zones)
    before = volume(worlds[0].height, 0.5)
    after, tallies = driven(worlds[0].height, SOFT, None, zones, open_border=open_border)
    assert np.abs(after.height - worlds[0].height).max() > 0.2
    assert volume(after.height, 0.5) + tallies["lost"].sum() == pytest.approx(before, abs=1e-9 * open_border)


# Slumping


@pytest.mark.parametrize("open_border", [False, True])
def test_settling_equals_the_whole_map_twin_to_the_last_bit(open_border):
    ground = np.random.default_rng(0).normal(0.0, 0.3, (21, 17))
    ground[8:11, 6:9] += 3.0
    index = patches(21, 17)
    world, grid = world_of(ground, open_border=open_border)
    slopes = np.where(index == 1, HARD.slope, SOFT.slope)
    expected, sweeps, _ = naive.settle(world.height, world.quantum, 0.5, SOFT, None, world.outside, slopes=slopes)
    assert settle(world, grid, SOFT, zones=zones_of(index, [SOFT, HARD])) == sweeps
    np.testing.assert_array_equal(world.height, expected)


def test_a_standing_blade_holds_the_soils_as_in_the_twin():
    ground = np.zeros((24, 26))
    ground[10:15, 10:15] = 2.5
    world, grid = world_of(ground)
    index, blade = patches(24, 26), line_at(7.3, 6.9, 0.3, edge=0.4, height=0.6, roll=0.1)
    slopes = np.where(index == 1, HARD.slope, SOFT.slope)
    expected, _, _ = naive.settle(world.height, world.quantum, grid.cell, SOFT, line=blade, slopes=slopes)
    assert slump_against(world, grid, SOFT, blade, zones_of(index, [SOFT, HARD])) > 0
    np.testing.assert_array_equal(world.height, expected)


@pytest.mark.slow
def test_soil_against_a_wall_stands_at_the_repose_of_each():
    """Hard soil over the first L = 1 m, then soft: A = h^2 / 2 k_soft + h L + k_hard L^2 / 2, h on the border."""
    ground = np.zeros((1, 200))
    ground[0, :5] = 8.0
    world, grid = world_of(ground, 0.1)
    soft, hard = (soil._replace(tolerance=FINE.tolerance) for soil in (SOFT, HARD))
    settle(world, grid, soft, zones=zones_of(np.arange(200)[None] < 10, [soft, hard]))
    area, found = 8.0 * 0.5, world.height[0]
    border = soft.slope * (sqrt(1.0 + 2.0 / soft.slope * (area - 0.5 * hard.slope)) - 1.0)
    assert found[9:11].mean() == pytest.approx(border, rel=0.01)
    assert np.diff(found[:10]) == pytest.approx(-0.1 * hard.slope, rel=0.01)
    assert np.diff(found[10:30]) == pytest.approx(-0.1 * soft.slope, rel=0.01)
    assert np.count_nonzero(found) * 0.1 == pytest.approx(1.0 + border / soft.slope, abs=0.1)


def test_between_two_soils_the_weaker_one_decides():
    """One step up from soft to hard ground, as high as only the hard soil would stand."""
    ground = np.zeros((5, 6), np.float32)
    ground[:, 3:] = 0.25 * (SOFT.slope + HARD.slope)
    for index, moves in (([[1, 1, 1, 1, 1, 1]] * 5, False), ([[0, 0, 0, 1, 1, 1]] * 5, True)):
        world, grid = world_of(ground)
        settle(world, grid, SOFT, zones=zones_of(index, [SOFT, HARD]))
        assert bool(np.any(np.abs(world.height - ground) > world.quantum)) == moves


def test_mirrored_soils_give_the_mirrored_ground_to_the_last_bit():
    ground, index = np.random.default_rng(5).normal(0.0, 0.6, (24, 24)), patches(24, 24)
    found = []
    for turn in (lambda a: a, np.fliplr, np.flipud, np.transpose):
        world, grid = world_of(np.ascontiguousarray(turn(ground)))
        settle(world, grid, SOFT, zones=zones_of(np.ascontiguousarray(turn(index)), [SOFT, HARD]))
        found.append(turn(world.height))
    for other in found[1:]:
        np.testing.assert_array_equal(found[0], other)


@pytest.mark.slow
def test_ground_that_is_left_alone_is_at_rest():
    """After any step in which nothing is left pending, no face anywhere would still slump."""
    index = patches(48, 56)
    zones = zones_of(index, [SOFT, HARD])
    world, _ = driven(np.random.default_rng(1).normal(0.0, 0.2, (48, 56)), SOFT, None, zones, steps=60)
    assert world.pending[1] <= world.pending[0]
    grid = Grid(48, 56, 0.5)
    place(world, grid, SOFT, BLADE, MACHINE, 20.0, 20.0, 0.0, zones)  # lets go of what leans on the blade
    while world.pending[1] > world.pending[0]:
        advance(world, grid, SOFT, BLADE, MACHINE, Command(0.0, 0.0, 0.75), 0.5, None, zones)
    left = world.height.copy()
    settle(world, grid, SOFT, zones=zones)
    np.testing.assert_array_equal(world.height, left)


def test_methods_that_know_one_soil_only_are_refused():
    world, grid = world_of(np.zeros((6, 6)))
    with pytest.raises(ValueError, match="method is 'projection' where soils differ or swell; allowed: auto, explicit"):
        settle(world, grid, SOFT, "projection", zones_of(np.zeros((6, 6)), [SOFT, HARD]))


# Draft and traction


HALVES = np.repeat(np.arange(64) >= 32, 64).reshape(64, 64)  # north of y = 16 m the second soil


def draft_across(index, depth, load=0.0, soils=(SOFT, SOFT), strengths=(LOOSE, STIFF)):
    """Draft [N] of a machine that stands with its edge so deep, its blade across the line y = 16 m."""
    pulls = [pull(*pair) for pair in zip(soils, strengths, strict=True)]
    ground = np.zeros((64, 64))
    if load:
        ground[29:35, 15:18] = load
    world, grid, _ = settled(ground)
    place(world, grid, soils[0], BLADE, MACHINE, 6.0, 16.0, 0.0)
    pose = world.machine[0]
    pose.edge = -depth
    line = line_of(pose, facing_of(pose.heading), BLADE)
    zones = zones_of(index, soils, pulls)
    args = world.height, None, pose, line, grid.cell, soils[0], BLADE, MACHINE, pulls[0], 0.01
    return effort(*args, zones)[1], effort(*args)[1], effort(*args[:8], pulls[1], 0.01)[1]


def test_a_blade_across_soft_and_hard_ground_has_the_mean_of_both_drafts():
    """Smooth and upright: rho g d^2 K_p w / 2, and 2 c sqrt(K_p) d over the half of the width that is stiff."""
    across, soft, hard = draft_across(HALVES, 0.2)
    frictional = 0.5 * 1400.0 * GRAVITY * 0.2**2 * 3.0 * 3.0
    cohesive = 2.0 * 2e4 * sqrt(3.0) * 0.2 * 3.0
    assert soft == pytest.approx(frictional, rel=1e-6)
    assert hard == pytest.approx(frictional + cohesive, rel=1e-6)
    assert across == pytest.approx(frictional + cohesive / 2, rel=1e-6)


def test_the_drafts_add_up_with_a_load_too():
    across, soft, hard = draft_across(HALVES, 0.2, load=0.4)
    assert hard > soft > draft_across(HALVES, 0.2)[1]
    assert across == pytest.approx(0.5 * (soft + hard), rel=1e-12)


def test_only_the_soil_at_the_blade_counts_for_the_draft():
    index = np.zeros((64, 64), int)
    index[:, :15] = index[:, 20:] = 1
    across, soft, _ = draft_across(index, 0.2)
    assert across == soft


def test_shares_are_those_of_the_cells_along_the_blade_on_either_side():
    index = np.zeros((40, 40), int)
    index[:, 20:] = 1
    index[20:, 20:] = 2
    zones = zones_of(index, [SOFT, HARD, SOFT])
    for side, expected in ((1, [0.0, 0.5, 0.5]), (-1, [1.0, 0.0, 0.0])):
        count_ahead(zones, line_at(10.0, 10.0, 0.0), 0.5, side)
        assert zones.ahead.tolist() == expected
    count_ahead(zones, line_at(-9.0, 10.0, 0.0), 0.5, 1)
    assert zones.ahead.tolist() == [1.0, 0.0, 0.0]
    assert extremes(zones.soils) == (SOFT.slope, HARD.slope)


def test_tracks_pull_with_the_mean_of_what_they_stand_on():
    """Across two soils with the pivot on the border: 2 of 3 lanes are on or beyond it."""
    world, grid, _ = settled(np.zeros((64, 64)))
    place(world, grid, SOFT, BLADE, MACHINE, 6.0, 16.0, 0.0)
    soils = SOFT, SOFT
    traction = Traction(rolling_resistance=0.3)
    strengths = LOOSE, STIFF._replace(shear_deformation=0.05)
    pulls = [pull(soil, strength, traction) for soil, strength in zip(soils, strengths, strict=True)]
    zones = zones_of(HALVES, soils, pulls)
    pose, facing = world.machine[0], facing_of(0.0)
    count_under(zones, grid.cell, pose, facing, MACHINE)
    assert zones.under == pytest.approx([1 / 3, 2 / 3])
    line = line_of(pose, facing, BLADE)
    share, draft, _, slip = effort(
        world.height, None, pose, line, grid.cell, SOFT, BLADE, MACHINE, pulls[0], 1.0, zones
    )
    weight = 9000 * GRAVITY
    strength = 2 / 3 * pulls[1].grip + pulls[0].tangent * weight
    ratio = (0.025 / 3 + 0.05 * 2 / 3) / 2.5
    assert draft == 0.0
    assert mobilised_share(slip / ratio) == pytest.approx(0.3 * weight / strength)
    assert share == pytest.approx(1 - slip)


def test_work_without_traction_goes_by_the_soil_at_the_blade():
    heavy = SOFT._replace(density=2.0 * SOFT.density)
    ground = np.zeros((64, 64))
    ground[29:35, 16:18] = 0.3
    works = []
    for index in (np.zeros((64, 64)), HALVES, np.ones((64, 64))):
        world, grid, _ = settled(ground)
        place(world, grid, SOFT, BLADE, MACHINE, 6.0, 16.0, 0.0)
        zones = zones_of(index, [SOFT, heavy])
        for edge in (0.1, 0.1, 0.1):
            advance(world, grid, SOFT, BLADE, MACHINE, Command(0.5, 0.0, edge), 0.5, None, zones)
        works.append(world.tally[0].work)
    assert works[0] > 0
    assert works[1] == pytest.approx(1.5 * works[0], rel=1e-12)
    assert works[2] == pytest.approx(2.0 * works[0], rel=1e-12)


def test_the_draft_equation_is_that_of_each_soil():
    cut = cut_of(HARD, STIFF, BLADE, 0.5 * pi)
    across, _, hard = draft_across(np.ones((64, 64)), 0.15, soils=(SOFT, HARD))
    assert hard == pytest.approx(draft_force(0.15, 0.0, cut), rel=1e-9)
    assert across == pytest.approx(hard, rel=1e-12)
