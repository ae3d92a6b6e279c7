"""Blades where they hardly fit: wider than the map, past a wall, in a corner, two on one cell, turning on the spot."""

from math import pi

import numpy as np

from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import (
    MACHINE,
    Driven,
    at_rest,
    line_at,
    rests,
    straight,
    sweep_blade,
    total,
)
from dirt_env.sim.advance import advance, place
from dirt_env.sim.params import Blade, Command, Machine


def _kept(world, before, tally, stuck=None):
    ok = total(world) == before and np.isfinite(world.height).all()
    if stuck is not None:
        ok &= (tally.stuck > 0) == stuck
    text = f"moved {tally.cut:.2f}, stuck {tally.stuck:.2f} m of a cell; highest {world.height.max():.2f} m"
    return text, bool(ok)


@case("a blade wider than the map, from wall to wall: volume kept, what cannot go is booked as stuck")
def wider_than_the_map():
    world, grid = at_rest(12, 40, 0.3)
    before = total(world)
    tally = sweep_blade(world, grid, straight(0.3, 3.0, 0.0, 19.6, 0.25, width=50.0, height=100.0))
    return _kept(world, before, tally, stuck=True)


@case("a blade that goes on past the wall, 10 m beyond: volume kept, stuck booked, nothing out there")
def past_the_wall():
    world, grid = at_rest(20, 30, 0.3)
    before = total(world)
    return _kept(world, before, sweep_blade(world, grid, straight(10.0, 5.0, 0.0, 15.0, 0.25, width=4.0)), stuck=True)


@case("a blade driven into a corner at 45 degrees: volume kept, stuck booked")
def into_a_corner_at_45():
    world, grid = at_rest(30, 30, 0.3)
    before = total(world)
    tally = sweep_blade(world, grid, straight(9.0, 9.0, 0.25 * pi, 9.0, 0.25, width=4.0, height=3.0))
    return _kept(world, before, tally, stuck=True)


@case("a blade wholly outside the map, 1 m to 1e6 m away: nothing happens")
def outside_the_map():
    world, grid = at_rest(20, 20, 0.3)
    before = world.height.copy()
    for away in (-1.0, -1e6, 1e6, 11.1):
        sweep_blade(world, grid, straight(away, away, 0.3, 0.5, 0.1))
    return "ground compared", np.array_equal(world.height, before)


def _turning(count, yaw_rate):
    """A machine that turns on the spot, blade down, in a layer; what it did in its first and in its last tenth."""
    drive = Driven(np.full((32, 32), 0.2), 8.0, 8.0).go(edge=-0.1, dt=2.0)
    before, sweeps = total(drive.world), []
    for _ in range(10):
        start = drive.sweeps
        drive.go(yaw_rate=yaw_rate, edge=-0.1, steps=count // 10)
        sweeps.append(drive.sweeps - start)
    ok = total(drive.world) == before and np.isfinite(drive.world.height).all() and sweeps[-1] <= 2 * sweeps[0]
    return f"{sweeps[0]} sweeps in the first tenth, {sweeps[-1]} in the last; sum equal", ok


@case("turning on the spot, 1e5 steps: volume equal to the last bit, no growth of the work", counts=(100_000, 10_000))
def turning_on_the_spot(count):
    return _turning(count, 0.6)


@case("forward and back over the same metre, 1e5 steps: volume equal, no growth of the work", counts=(100_000, 10_000))
def back_and_forth(count):
    drive = Driven(np.full((32, 48), 0.2), 8.0, 8.0).go(edge=-0.1, dt=2.0)
    before, sweeps = total(drive.world), []
    for _ in range(10):
        start = drive.sweeps
        for _ in range(count // 20):
            drive.go(speed=2.0, edge=-0.1).go(speed=-2.0, edge=-0.1)
        sweeps.append(drive.sweeps - start)
    ok = total(drive.world) == before and sweeps[-1] <= 2 * sweeps[0]
    return f"{sweeps[0]} sweeps in the first tenth, {sweeps[-1]} in the last", ok


@case("half a turn in one step: heading within [-pi, pi), volume equal, as many substeps as the blade's way asks for")
def half_a_turn_in_a_step():
    drive = Driven(np.full((32, 32), 0.2), 8.0, 8.0, machine=MACHINE._replace(yaw_rate=10.0)).go(edge=-0.1, dt=2.0)
    before = total(drive.world)
    drive.go(yaw_rate=2 * pi, edge=-0.1, steps=50)
    ok = -pi <= drive.pose.heading < pi and total(drive.world) == before
    return f"heading {drive.pose.heading:.3f} rad after 25 turns", ok


@case("1000 rad in one step: wrapped, volume equal, ends")
def a_thousand_radians_in_a_step():
    drive = Driven(np.full((32, 32), 0.2), 8.0, 8.0, machine=MACHINE._replace(yaw_rate=1e4)).go(edge=-0.1, dt=2.0)
    before = total(drive.world)
    drive.go(yaw_rate=2000.0, edge=-0.1)
    wanted = (1000.0 + pi) % (2 * pi) - pi
    ok = abs(drive.pose.heading - wanted) < 1e-6 and total(drive.world) == before
    return f"heading {drive.pose.heading:.4f} rad for {wanted:.4f}, {drive.sweeps} sweeps", ok


@case("a teleport in mid-push: volume equal, the load slumps where it was, nothing is cut on the way")
def a_teleport_in_mid_push():
    drive = Driven(np.full((64, 64), 0.3), 6.0, 8.0).go(edge=-0.2, dt=2.0).go(speed=2.0, edge=-0.2, steps=6)
    before, between = total(drive.world), drive.world.height[:, 44:].copy()
    drive.set_down(26.0, 26.0, 2.0)
    drive.go(edge=0.75, steps=3)
    ok = total(drive.world) == before and rests(drive.world, drive.grid)
    untouched = np.array_equal(between, drive.world.height[:, 44:])
    return f"at rest after 3 steps, ground between untouched: {untouched}", ok and untouched


@case("two machines pinch one cell from both sides, 400 steps: volume equal, finite, no spike")
def two_blades_on_one_cell():
    drive = Driven(np.full((40, 80), 0.3), 8.0, 10.25)
    world, grid, soil, blade = drive.world, drive.grid, drive.soil, drive.blade
    poses = [world.machine.copy(), None]
    place(world, grid, soil, blade, MACHINE, 30.0, 10.25, pi)
    poses[1] = world.machine.copy()
    before = total(world)
    for _ in range(200):
        speed = 0.5 if poses[1][0].x - poses[0][0].x > 2 * blade.reach + 0.1 else 0.0
        for k in range(2):
            world.machine[:] = poses[k]
            advance(world, grid, soil, blade, MACHINE, Command(speed, 0.0, -0.05), 0.5)
            poses[k] = world.machine.copy()
    gap = float(poses[1][0].x - poses[0][0].x) - 2 * blade.reach
    ok = total(world) == before and np.isfinite(world.height).all() and world.height.max() < 6.0
    return f"blades {gap:.2f} m apart, highest {world.height.max():.2f} m", ok


@case("two blades that cross at 90 degrees through one heap, step by step: volume equal")
def two_blades_that_cross():
    world, grid = at_rest(40, 40, 0.3)
    before = total(world)
    a, b = straight(4.0, 10.0, 0.0, 10.0, 0.25), straight(10.0, 4.0, 0.5 * pi, 10.0, 0.25)
    for k in range(len(a) - 1):
        sweep_blade(world, grid, a[k : k + 2])
        sweep_blade(world, grid, b[k : k + 2])
    return f"highest {world.height.max():.2f} m", total(world) == before and world.height.max() < 3.0


@case("a blade that stands still in soil: after the first step not one sweep moves anything")
def a_blade_that_stands():
    drive = Driven(np.full((40, 40), 0.3), 6.0, 10.0).go(edge=-0.2, dt=2.0).go(speed=2.0, edge=-0.2, steps=4)
    drive.go(edge=-0.2, steps=5)
    before, sweeps = drive.world.height.copy(), drive.sweeps
    drive.go(edge=-0.2, steps=2000)
    same = np.array_equal(before, drive.world.height)
    return (
        f"{drive.sweeps - sweeps} sweeps in 2000 steps, ground unchanged: {same}",
        same and drive.sweeps - sweeps <= 2000,
    )


@case("a blade 30 m wide on cells of 0.05 m (600 links closed): volume equal")
def a_blade_of_600_cells():
    world, grid = at_rest(640, 120, 0.05, cell=0.05)
    before = total(world)
    sweep_blade(world, grid, straight(2.0, 16.0, 0.02, 2.0, 0.025, width=30.0))
    return f"highest {world.height.max():.2f} m", total(world) == before and world.height.max() < 1.5


@case("a machine as long as the map turns and drives in it for 2000 steps: inside, volume equal")
def a_machine_as_long_as_the_map():
    machine, blade = Machine(length=5.0, width=3.0), Blade(width=4.0, reach=2.7)
    drive = Driven(np.full((14, 14), 0.2), 3.5, 3.5, blade=blade, machine=machine)
    before = total(drive.world)
    inside = True
    for speed, yaw_rate, edge in np.random.default_rng(2).uniform((-2, -0.6, -0.25), (2, 0.6, 0.3), (2000, 3)):
        drive.go(speed, yaw_rate, edge)
        inside &= 0 <= drive.pose.x <= 7.0 and 0 <= drive.pose.y <= 7.0
    return f"inside: {inside}, highest {drive.world.height.max():.2f} m", inside and total(drive.world) == before


@case("a blade over a heap that is lowered 2 m onto it: cuts nothing by going down, volume equal")
def lowered_onto_a_heap():
    world, grid = at_rest(30, 30, 0.0)
    world.height[10:20, 10:20] = 0.3
    before = total(world)
    tally = sweep_blade(world, grid, [line_at(7.6, 7.4, 0.0, edge=edge) for edge in np.linspace(2.0, -0.1, 30)])
    return f"moved {tally.cut:g} m of a cell", tally.cut == 0.0 and total(world) == before
