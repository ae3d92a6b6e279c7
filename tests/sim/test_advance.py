"""One control step as a whole: kinematics, limits, tally, exact volume over a long drive."""

from math import pi

import numpy as np
import pytest

from dirt_env.sim.advance import advance, place, settle
from dirt_env.sim.diagnostics import steepest, volume
from dirt_env.sim.heap import dump
from dirt_env.sim.params import Blade, Command, Grid, Machine
from dirt_env.sim.state import make_world
from dirt_env.sim.timestep import substeps
from tests.sim.worlds import SOIL, settled, world_of

BLADE, MACHINE = Blade(), Machine()


def copy_of(world):
    return world._replace(**{k: v.copy() for k, v in world._asdict().items() if isinstance(v, np.ndarray)})


def world_with_machine(height, x, y, heading, **others):
    world, grid, _ = settled(height, **others)
    place(world, grid, SOIL, BLADE, MACHINE, x, y, heading)
    return world, grid


def go(world, grid, speed=0.0, yaw_rate=0.0, edge=0.75, dt=0.5, steps=1):
    for _ in range(steps):
        advance(world, grid, SOIL, BLADE, MACHINE, Command(speed, yaw_rate, edge), dt)
    return world.machine[0]


def test_it_drives_turns_and_moves_its_blade_at_the_commanded_and_limited_rates():
    world, grid = world_with_machine(np.zeros((64, 64)), 8.0, 16.0, 0.0)
    pose = go(world, grid, speed=1.0, edge=0.0)
    assert (pose.x, pose.y, pose.speed) == pytest.approx((8.5, 16.0, 1.0))
    assert pose.edge == pytest.approx(0.5)
    assert world.tally[0].distance == pytest.approx(0.5)
    pose = go(world, grid, yaw_rate=-0.6, edge=0.0, steps=2)
    assert pose.heading == pytest.approx(-0.6)
    assert pose.edge == pytest.approx(0.0, abs=1e-12)
    assert pose.yaw_rate == pytest.approx(-0.6)


def test_a_lifted_blade_leaves_the_ground_alone():
    world, grid = world_with_machine(np.random.default_rng(0).normal(0, 0.05, (64, 64)), 8.0, 16.0, 0.3)
    world.changed[:] = 0
    before = world.height.copy()
    go(world, grid, speed=2.0, yaw_rate=0.2, steps=10)
    np.testing.assert_array_equal(world.height, before)
    assert world.tally[0].sweeps == 0
    assert world.changed[1] <= world.changed[0]


def test_a_small_load_on_flat_ground_is_carried_along():
    ground = np.zeros((40, 80))
    ground[17:23, 14:16] = 0.3
    world, grid = world_with_machine(ground, 4.0, 10.0, 0.0)
    go(world, grid, edge=0.0, steps=2)
    go(world, grid, speed=1.0, edge=0.0, steps=40)
    pose = world.machine[0]
    blade_column = int((pose.x + BLADE.reach) / 0.5)
    assert world.height[:, blade_column:].sum() * 0.25 > 0.8 * 0.9
    assert pose.load == pytest.approx(0.8, abs=0.2)
    assert abs(pose.pitch) < 0.02
    assert world.tally[0].work > 0


def test_cutting_takes_soil_from_flat_ground():
    world, grid = world_with_machine(np.zeros((64, 64)), 6.0, 16.0, 0.0)
    go(world, grid, edge=-0.1, steps=2)
    pose = go(world, grid, speed=1.0, edge=-0.1, steps=6)
    assert pose.load > 0.3
    assert world.tally[0].cut > 0
    assert world.height.min() < -0.08


def test_the_machine_stops_at_the_wall_and_says_so():
    world, grid = world_with_machine(np.zeros((64, 64)), 16.0, 16.0, 0.0)
    go(world, grid, speed=2.0, steps=20)
    assert world.machine[0].x + BLADE.reach <= 32.0
    assert world.tally[0].blocked == 1.0
    assert world.machine[0].speed == 0.0


def test_placing_outside_or_on_a_post_is_refused_with_the_place():
    solid = np.zeros((64, 64), bool)
    solid[32, 32] = True
    world, grid = world_of(np.zeros((64, 64)), solid=solid)
    for x, y in ((31.0, 16.0), (16.2, 16.2), (-1.0, 4.0)):
        with pytest.raises(ValueError, match=rf"does not fit at x {x:g} m, y {y:g} m"):
            place(world, grid, SOIL, BLADE, MACHINE, x, y, 0.0)


def test_soil_that_leans_on_the_blade_slumps_when_the_machine_is_put_elsewhere():
    world, grid = world_with_machine(np.full((64, 64), 0.3), 6.0, 8.0, 0.0)
    go(world, grid, edge=-0.2, steps=2)
    go(world, grid, speed=2.0, edge=-0.2, steps=6)
    assert steepest(world.height, grid.cell) > 1.5 * SOIL.slope
    place(world, grid, SOIL, BLADE, MACHINE, 26.0, 26.0, 2.0)
    go(world, grid, steps=3)
    assert steepest(world.height, grid.cell) <= SOIL.slope * 1.005


@pytest.mark.parametrize("open_border", [False, True])
def test_the_sum_of_heights_is_equal_over_a_long_random_drive(open_border):
    rng = np.random.default_rng(3)
    world, grid = world_with_machine(rng.normal(0, 0.3, (48, 56)), 14.0, 12.0, 0.0, open_border=open_border)
    before = volume(world.height, grid.cell)
    lost = 0.0
    for speed, yaw_rate, edge in rng.uniform((-2, -0.6, -0.25), (2, 0.6, 0.4), (3000, 3)):
        go(world, grid, speed, yaw_rate, edge)
        lost += world.tally[0].lost
    assert volume(world.height, grid.cell) + lost == before
    assert np.isfinite(world.height).all()
    assert open_border == (lost > 0)


def test_settled_ground_costs_no_sweeps_and_a_second_settling_changes_nothing():
    world, grid = world_with_machine(np.zeros((64, 64)), 16.0, 16.0, 0.0)
    world.height[10:20, 10:20] = 2.0
    settle(world, grid, SOIL)
    again = world.height.copy()
    assert settle(world, grid, SOIL) == 1
    np.testing.assert_array_equal(world.height, again)


@pytest.mark.parametrize("open_border", [False, True])
def test_looking_at_ground_that_is_known_to_be_at_rest_changes_nothing(open_border):
    rng, solid = np.random.default_rng(8), np.zeros((40, 48), bool)
    solid[10:12, 10:12] = solid[30, 20:30] = True
    ground = np.where(solid, 0.0, np.abs(rng.normal(0.0, 0.4, (40, 48))))
    lean, grid = world_with_machine(ground, 12.0, 10.0, 0.3, solid=solid, open_border=open_border)
    full, _ = world_with_machine(ground, 12.0, 10.0, 0.3, solid=solid, open_border=open_border)
    looked = 0
    for _ in range(300):
        command = Command(*rng.uniform((-2.0, -0.6, -0.25), (2.0, 0.6, 0.75)))
        full.machine[0].closed = -1.0  # no list of closed links has that number
        for world in (lean, full):
            advance(world, grid, SOIL, BLADE, MACHINE, command, 0.1)
        looked += full.tally[0].sweeps
        assert full.machine[0].closed == lean.machine[0].closed
        assert (lean.height == full.height).all()
    assert looked > 50


def test_ground_that_settled_without_the_blade_is_looked_at_with_it():
    rng = np.random.default_rng(2)
    for _ in range(25):
        ground = np.abs(rng.normal(0.0, 0.5, (20, 22)))
        lean, grid = world_with_machine(ground, 5.0, 5.0, rng.uniform(-3.0, 3.0))
        go(lean, grid, edge=rng.uniform(-0.25, -0.1), steps=6)
        assert lean.machine[0].closed > 0
        dump(lean, grid, SOIL, 5.0, 5.0, 0.5)
        assert lean.machine[0].closed == -1  # not known
        settle(lean, grid, SOIL, "explicit")
        assert lean.machine[0].closed == 0  # at rest with no link closed
        full = copy_of(lean)
        full.machine[0].closed = -1.0
        for world in (lean, full):
            go(world, grid, edge=world.machine[0].edge)
        assert (lean.height == full.height).all()


def test_what_a_blade_has_let_go_of_is_looked_at_though_it_touches_no_soil_any_more():
    rng = np.random.default_rng(4)
    for _ in range(40):
        grid = Grid(20, 22, 0.5)
        lean = make_world(np.abs(rng.normal(0.0, 0.5, (20, 22))), grid)  # nothing of it has settled
        place(lean, grid, SOIL, BLADE, MACHINE, 5.0, 5.0, rng.uniform(-3.0, 3.0))
        full = copy_of(lean)
        for _ in range(30):
            command = Command(*rng.uniform((-2.0, -0.6, -0.25), (2.0, 0.6, 0.5)))
            full.machine[0].closed = -1.0
            for world in (lean, full):
                advance(world, grid, SOIL, BLADE, MACHINE, command, 0.1)
            assert (lean.height == full.height).all()


def test_substeps_follow_the_faster_end_of_the_blade():
    assert substeps(0.0, 0.0, 0.5, 0.5, BLADE) == 1
    assert substeps(2.0, 0.0, 0.5, 0.5, BLADE) == 4
    assert substeps(-2.0, 0.0, 0.5, 0.25, BLADE) == 8
    assert substeps(0.0, pi, 1.0, 0.5, BLADE) == 27
    assert substeps(0.88, -0.6, 0.5, 0.5, BLADE) == 4  # the outer end does 1.78 m/s ahead and 0.9 m/s across


@pytest.mark.parametrize("dt", [0.1, 2.0])
def test_the_work_does_not_depend_on_the_control_period(dt):
    ground = np.zeros((40, 80))
    ground[15:25, 20:24] = 0.5
    work = {}
    for period in (0.5, dt):
        world, grid = world_with_machine(ground, 5.0, 10.0, 0.0)
        go(world, grid, edge=0.0, dt=4.0)
        total = 0.0
        for _ in range(round(12.0 / period)):
            go(world, grid, speed=1.0, edge=0.0, dt=period)
            total += world.tally[0].work
        work[period] = total
    assert work[0.5] > 1e4
    assert work[dt] == pytest.approx(work[0.5], rel=0.1)


def test_no_work_is_done_on_soil_that_is_not_reached_and_some_on_soil_that_is_pulled():
    ground = np.zeros((40, 80))
    ground[15:25, 26:30] = 0.5
    world, grid = world_with_machine(ground, 10.2, 10.0, 0.0)
    go(world, grid, edge=0.0, dt=4.0)
    pose = go(world, grid, speed=0.5, edge=0.0)
    assert pose.load > 0.05
    assert world.tally[0].work == 0
    world, grid = world_with_machine(np.zeros((40, 80)), 30.0, 10.0, 0.0)
    go(world, grid, edge=-0.1, dt=4.0)
    go(world, grid, speed=-1.0, edge=-0.1, steps=3)
    assert world.tally[0].cut > 0
    assert world.tally[0].work > 0


def test_the_volume_stays_exact_where_the_ground_reaches_the_end_of_its_range():
    soil = SOIL._replace(slope=60.0)
    world, grid = world_of(np.zeros((40, 60)), cell=0.05)
    blade, machine = Blade(width=0.6, height=0.3, reach=0.3), Machine(length=0.4, width=0.4, speed=0.3, cut=0.25)
    settle(world, grid, soil)
    place(world, grid, soil, blade, machine, 1.5, 1.0, 0.0)
    world.height[18:22, 36:40] = 0.99 * 2**24 * world.quantum // world.quantum * world.quantum
    before = volume(world.height, grid.cell)
    rng = np.random.default_rng(0)
    for speed, yaw_rate in rng.uniform((-0.3, -0.6), (0.3, 0.6), (400, 2)):
        advance(world, grid, soil, blade, machine, Command(speed, yaw_rate, -0.25), 0.5)
    assert volume(world.height, grid.cell) == before
    assert np.abs(world.height).max() < 2**24 * world.quantum
