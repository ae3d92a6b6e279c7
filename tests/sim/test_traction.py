"""Machines that the ground holds back: speed under load, slip, stall, energy; and neutral ones that it does not."""

from math import radians, sin, tan

import numpy as np
import pytest

from dirt_env.sim.advance import advance, place
from dirt_env.sim.diagnostics import volume
from dirt_env.sim.laws import GRAVITY
from dirt_env.sim.params import Blade, Command, Machine, Soil, Strength, Traction
from dirt_env.sim.thrust import mobilised_share
from dirt_env.sim.traction import depth_ahead, pull_of
from tests.sim.worlds import line_at, settled, soil_of

BLADE, MACHINE, SOIL = Blade(), Machine(), soil_of(34.0, density=1500.0)
SAND = Strength(internal_friction=radians(34.0), external_friction=radians(17.0))
CLAY = Strength(cohesion=3e4, internal_friction=radians(10.0), external_friction=radians(6.0), adhesion=5e3)
FREE = Traction(rolling_resistance=0.0)


def pull(strength=SAND, traction=FREE, soil=SOIL):
    return pull_of(soil, strength, BLADE, MACHINE, traction)


def world_with_machine(height, x=6.0, y=16.0, heading=0.0, soil=SOIL):
    world, grid, _ = settled(height, soil=soil)
    place(world, grid, soil, BLADE, MACHINE, x, y, heading)
    return world, grid


def go(world, grid, speed, edge, pulled, steps=1, dt=0.5, yaw_rate=0.0, soil=SOIL):
    """Drive; returns the tallies of the steps, as copies."""
    tallies = []
    for _ in range(steps):
        advance(world, grid, soil, BLADE, MACHINE, Command(speed, yaw_rate, edge), dt, pulled)
        tallies.append(world.tally[0].copy())
    return tallies


def lowered(depth, strength=SAND, traction=FREE, ground=None):
    """World, grid and constants of a machine that stands with its edge so deep under level ground."""
    world, grid = world_with_machine(np.zeros((64, 64)) if ground is None else ground)
    go(world, grid, 0.0, -depth, None, steps=4)
    return world, grid, pull(strength, traction)


def test_a_machine_that_nothing_holds_goes_as_without_traction_bit_for_bit():
    """Ground that does not yield and weighs nothing, a heavy machine with a mighty engine: only then."""
    soil = Soil(density=1e-200, friction=0.7)
    strength = Strength(shear_deformation=0.0)
    neutral = pull(strength, Traction(mass=1e6, power=1e12, efficiency=1.0, rolling_resistance=0.0), soil)
    rng = np.random.default_rng(5)
    ground = rng.normal(0, 0.1, (64, 64))
    (one, grid), (other, _) = (world_with_machine(ground, 16.0, soil=soil) for _ in range(2))
    for speed, yaw_rate, edge in rng.uniform((-2, -0.6, -0.25), (2, 0.6, 0.4), (200, 3)):
        go(one, grid, speed, edge, None, yaw_rate=yaw_rate, soil=soil)
        go(other, grid, speed, edge, neutral, yaw_rate=yaw_rate, soil=soil)
        assert one.machine.tobytes() == other.machine.tobytes()
    assert one.height.tobytes() == other.height.tobytes()
    assert volume(one.height, grid.cell) == volume(other.height, grid.cell)


def test_a_blade_that_is_too_deep_stalls_the_machine_and_lifting_it_frees_it():
    world, grid, strong = lowered(0.25, CLAY, Traction(mass=3000.0, track_width=0.2))
    before, pose = world.height.copy(), world.machine[0].copy()
    tally = go(world, grid, 1.0, -0.25, strong, yaw_rate=0.3, steps=3)[-1]
    assert (tally.slip, tally.distance, tally.work) == (1.0, 0.0, 0.0)
    assert tally.draft > 10e3
    assert tally.energy > 0.0  # the tracks spin
    assert (world.machine[0].x, world.machine[0].heading) == (pose.x, pose.heading)
    np.testing.assert_array_equal(world.height, before)
    tally = go(world, grid, 1.0, 0.2, strong, steps=3)[-1]
    assert tally.slip < 0.5
    assert tally.distance > 0.2


def test_volume_stays_equal_where_machines_slip_and_stall():
    rng = np.random.default_rng(2)
    world, grid = world_with_machine(rng.normal(0, 0.3, (48, 56)), 14.0, 12.0)
    weak, before, slips = pull(traction=Traction(mass=3000.0, power=20e3)), volume(world.height, grid.cell), []
    for speed, yaw_rate, edge in rng.uniform((-2, -0.6, -0.25), (2, 0.6, 0.4), (600, 3)):
        slips += [tally.slip for tally in go(world, grid, speed, edge, weak, yaw_rate=yaw_rate)]
    assert volume(world.height, grid.cell) == before
    assert min(slips) == 0.0
    assert max(slips) > 0.9


def test_the_speed_is_what_the_power_is_worth_and_falls_with_the_load():
    ground = np.zeros((64, 64))
    ground[26:38, 17:24] = 0.5
    speeds = []
    for power in (2e3, 6e3, 1e9):
        world, grid, strong = lowered(0.0, traction=FREE._replace(power=power), ground=ground)
        tallies = go(world, grid, 1.5, 0.0, strong, steps=8)
        speeds.append([tally.distance / 0.5 for tally in tallies])
        if power < 1e6:
            assert [tally.energy for tally in tallies[3:]] == pytest.approx([0.75 * power * 0.5] * 5, rel=1e-9)
    assert speeds[0][-1] < speeds[1][-1] < speeds[2][-1] <= 1.5
    assert speeds[1][-1] < 0.5 * speeds[1][0]  # with the load


def test_the_draft_of_a_shallow_cut_is_that_of_the_equation():
    """In a smooth upright blade's first centimetres there is no load: rho g d2 K_p w / 2, and no rolling resistance."""
    strength = Strength(internal_friction=radians(30.0), external_friction=0.0)
    world, grid, strong = lowered(0.2, strength, Traction(rake=radians(90.0), rolling_resistance=0.0))
    tally = go(world, grid, 0.01, -0.2, strong)[0]
    assert tally.draft == pytest.approx(0.5 * 1500 * GRAVITY * 0.2**2 * 3.0 * 3.0, rel=1e-6)


def test_the_slip_is_that_of_the_thrust_and_the_energy_that_of_the_tracks():
    """Rolling on level ground: thrust f W, slip from its share of the strength, energy f W s / (1 - i)."""
    traction = Traction(rolling_resistance=0.3)
    world, grid = world_with_machine(np.zeros((64, 64)))
    tallies = go(world, grid, 1.0, 0.75, pull(traction=traction), steps=8)
    weight = traction.mass * GRAVITY
    slip = tallies[-1].slip
    assert mobilised_share(slip * MACHINE.length / SAND.shear_deformation) == pytest.approx(0.3 / tan(radians(34.0)))
    way = sum(tally.distance for tally in tallies)
    assert way == pytest.approx(8 * 0.5 * (1 - slip))
    assert sum(tally.energy for tally in tallies) == pytest.approx(0.3 * weight * way / (1 - slip))
    assert sum(tally.work for tally in tallies) == 0.0


def test_a_slope_takes_the_weights_share_uphill_and_nothing_downhill():
    x = (np.arange(64) + 0.5) * 0.5
    hill = np.tile(0.2 * x, (64, 1))
    for speed, expected in ((1.0, sin(np.arctan(0.2))), (-1.0, 0.0)):
        world, grid = world_with_machine(hill, 16.0)
        tally = go(world, grid, speed, 0.75, pull())[0]
        thrust = tally.energy / (tally.distance / (1 - tally.slip))
        assert thrust == pytest.approx(expected * 9000 * GRAVITY, rel=0.05)


def test_heavier_machines_pull_what_light_ones_cannot():
    drafts = [(mass, go(*_cutting(mass), steps=4)[-1]) for mass in (1000.0, 4000.0, 20000.0)]
    slips = [tally.slip for _, tally in drafts]
    assert slips[0] == 1.0
    assert slips[1] > slips[2] > 0.0


def _cutting(mass):
    world, grid, strong = lowered(0.15, traction=Traction(mass=mass))
    return world, grid, 0.5, -0.15, strong


def test_the_work_is_the_draft_over_the_way_at_any_control_period():
    total = {}
    for dt in (0.1, 0.5, 2.0):
        world, grid, strong = lowered(0.1)
        tallies = go(world, grid, 1.0, -0.1, strong, steps=round(6.0 / dt), dt=dt)
        total[dt] = sum(tally.work for tally in tallies), world.machine[0].x
    for dt in (0.1, 2.0):
        assert total[dt] == pytest.approx(total[0.5], rel=0.1)
    assert total[0.5][0] > 1e4


@pytest.mark.parametrize("heading", [0.0, 0.4, np.pi / 4, 2.2])
@pytest.mark.parametrize("side", [1, -1])
def test_the_depth_is_the_mean_of_what_lies_between_edge_and_tracks(heading, side):
    ground = np.zeros((40, 40), np.float32)
    found = [depth_ahead(ground, None, line_at(10.1, 9.9, heading, edge=e), 0.5, p, side) for e, p in DEPTHS]
    assert found == pytest.approx([0.3, 0.0, 0.1, 0.0, 0.2])
    tilted = line_at(10.0, 10.0, heading, edge=-0.3, roll=0.1)
    assert depth_ahead(ground, None, tilted, 0.5, 0.0, side) == pytest.approx(0.3, abs=0.05)
    outside = line_at(-9.0, 10.0, heading, edge=-0.3)
    assert depth_ahead(ground, None, outside, 0.5, 0.0, side) == 0.0


DEPTHS = ((-0.3, 0.0), (0.2, 0.0), (-0.4, -0.3), (-0.1, -0.2), (-0.2, 0.5))


def test_soil_against_a_wall_is_not_cut():
    solid = np.zeros((40, 40), bool)
    solid[:, 20:] = True
    ground = np.zeros((40, 40), np.float32)
    assert depth_ahead(ground, solid, line_at(9.9, 10.0, 0.0, edge=-0.3), 0.5, 0.0, 1) == 0.0
    assert depth_ahead(ground, solid, line_at(9.4, 10.0, 0.0, edge=-0.3), 0.5, 0.0, 1) == pytest.approx(0.3)


def test_constants_are_worked_out_from_soil_and_machine():
    found = pull(CLAY, Traction(mass=8000.0, track_width=0.5, power=60e3, efficiency=0.5))
    assert found.grip == pytest.approx(2 * 0.5 * 2.5 * 3e4)
    assert found.weight == pytest.approx(8000 * GRAVITY)
    assert found.tangent == pytest.approx(tan(radians(10.0)))
    assert found.power == 30e3
    assert found.full == pytest.approx(mobilised_share(2.5 / 0.025))
    assert pull(CLAY._replace(shear_deformation=0.0)).full == 1.0
