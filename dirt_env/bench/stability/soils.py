"""Soil from mud to a frozen wall, and tolerances from none to coarse."""

from math import sqrt

import numpy as np

from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import (
    CELL,
    SOIL,
    Driven,
    over_repose,
    rests,
    rough,
    settled,
    soil_of,
    total,
    tower,
    world_of,
)
from dirt_env.config.tables import SOIL as SOIL_TABLE
from dirt_env.sim.advance import settle
from dirt_env.sim.slump import settle_window

MUD = soil_of(0.0)


@case("repose 0: a column of 33 m floods a map of 33 x 33 level, within what counts as settled; sum equal")
def mud_floods_level():
    world, grid, sweeps = settled(tower(33, 33, 33.0), soil=MUD)
    spread = float(np.ptp(world.height))
    ok = total(world) == 33.0 and rests(world, grid, MUD)
    return f"from the lowest to the highest {1e3 * spread:.1f} mm, {sweeps} sweeps", ok


@case("repose 0, 100 m: bounded work, at most 20,000 sweeps of the map")
def mud_from_a_tower():
    world, grid, sweeps = settled(tower(65, 65, 100.0), soil=MUD)
    return f"{sweeps} sweeps", sweeps <= 20_000 and rests(world, grid, MUD) and total(world) == 100.0


@case("repose 0 with a blade: no step makes more sweeps than soil.max_sweeps; sum equal")
def mud_with_a_blade_is_bounded():
    drive = Driven(np.full((48, 48), 0.4), 6.0, 12.0, soil=MUD._replace(max_sweeps=50))
    before = total(drive.world)
    drive.go(edge=-0.2, steps=2).go(speed=2.0, edge=-0.2, steps=40)
    ok = total(drive.world) == before and drive.most_sweeps <= 50
    return f"at most {drive.most_sweeps} sweeps in a step of 4 substeps", ok


@case("what the cap on sweeps leaves over is carried on: the same ground, to the last bit, as without a cap")
def what_is_left_over_is_carried_on():
    (capped, grid), (free, _) = (world_of(tower(40, 40, 60.0)) for _ in range(2))
    calls = 0
    while capped.pending[1] > capped.pending[0]:
        settle_window(capped, grid, SOIL._replace(max_sweeps=3))
        calls += 1
    settle(free, grid, SOIL, "explicit")
    return f"{calls} calls of 3 sweeps", np.array_equal(capped.height, free.height) and calls > 5


@case("mud after a blade has gone comes level by itself, though each step makes 3 sweeps only")
def mud_comes_to_rest_by_and_by():
    drive = Driven(np.full((32, 32), 0.4), 4.0, 8.0, soil=MUD._replace(max_sweeps=3))
    before = total(drive.world)
    drive.go(edge=-0.2, steps=2).go(speed=2.0, edge=-0.2, steps=8).go(edge=0.75, steps=3)
    rough_then = float(np.ptp(drive.world.height))
    drive.go(edge=0.75, dt=0.05, steps=2000)
    now = float(np.ptp(drive.world.height))
    ok = total(drive.world) == before and now < 0.1 * rough_then
    return f"{rough_then:.2f} m of relief, then {1e3 * now:.1f} mm", ok


def _extreme(repose, height=60.0, size=41):
    soil = soil_of(repose)
    world, grid, sweeps = settled(tower(size, size, height), soil=soil)
    ok = total(world) == height and rests(world, grid, soil)
    return world, f"slope {over_repose(world, grid, soil):.4f} of repose, {sweeps} sweeps", ok


@case("repose 1 degree: floods the map to that slope")
def repose_1():
    return _extreme(1.0)[1:]


@case("repose 45 degrees: settles")
def repose_45():
    return _extreme(45.0)[1:]


@case("repose 89 degrees: settles")
def repose_89():
    return _extreme(89.0)[1:]


@case("repose 89.999 degrees: a column of 60 m stands")
def repose_89_999():
    world, text, ok = _extreme(89.999)
    return text, ok and world.height.max() == 60.0


@case("repose 0 and up to 89.999 are accepted; 90, 91, -1, NaN refused")
def repose_at_its_ends():
    accepted, refused = [], []
    for repose in (0.0, 1e-12, 89.999, 90.0, 91.0, -1.0, float("nan"), float("inf")):
        try:
            SOIL_TABLE.read({"repose": repose}, "soil", None)
            accepted.append(repose)
        except ValueError as error:
            refused.append(repose if "soil.repose" in str(error) else str(error))
    return f"accepted {accepted}", len(accepted) == 3 and len(refused) == 5 and not any(map(_is_text, refused))


def _is_text(value):
    return isinstance(value, str)


@case("a tolerance of 1e-12: the relaxation still ends, at 4 quanta over repose")
def no_tolerance():
    soil = SOIL._replace(tolerance=1e-12)
    world, grid, sweeps = settled(tower(41, 41, 40.0), soil=soil)
    return f"slope {over_repose(world, grid, soil):.6f} of repose, {sweeps} sweeps", rests(world, grid, soil)


@case("a tolerance of 0.1: at rest within it, with fewer sweeps than at 0.001")
def coarse_tolerance():
    found = [settled(tower(41, 41, 40.0), soil=SOIL._replace(tolerance=share)) for share in (0.1, 1e-3)]
    (world, grid, few), (_, _, many) = found
    share = over_repose(world, grid)
    return f"slope {share:.3f} of repose, {few} sweeps for {many}", share <= 1.1001 and few < many


@case("float32 and float64: the same pile, within 10 quanta of float32 or 0.1 % of its height")
def float32_is_float64():
    single, double = (settled(tower(41, 41, 40.0), dtype=dtype)[0].height for dtype in (np.float32, np.float64))
    off = float(np.abs(single - double).max())
    return f"{1e3 * off:.3f} mm apart, highest {double.max():.2f} m", off < max(10 * 2.0**-18, 1e-3 * double.max())


@case("sand on a frozen slope: repose steeper than everything there is: no sweep moves anything")
def nothing_to_do():
    ground = rough(64, 64, 0.05)
    world, grid = world_of(ground)
    before = world.height.copy()
    sweeps = settle(world, grid, soil_of(80.0))
    return f"{sweeps} sweep", sweeps == 1 and np.array_equal(before, world.height)


@case("a wedge from a strip of mud-like soil of 5 degrees: height sqrt(A k), within 2 %")
def a_flat_wedge():
    soil = soil_of(5.0, tolerance=1e-3)
    ground = np.zeros((3, 401))
    ground[:, 200] = 20.0
    world, _, sweeps = settled(ground, soil=soil)
    high, exact = float(world.height.max()), sqrt(20.0 * CELL * soil.slope)
    return f"{high:.3f} m for {exact:.3f} m, {sweeps} sweeps", abs(high / exact - 1) < 0.02
