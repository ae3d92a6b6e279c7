"""Grounds that are stiff, rough, critical, huge, tiny or far away."""

import numpy as np

from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import (
    CELL,
    SLOPE,
    SOIL,
    one_sweep,
    over_repose,
    rests,
    rough,
    settled,
    total,
    tower,
    world_of,
)
from dirt_env.sim.advance import settle
from dirt_env.sim.state import make_world


def _tower(size, height, cell):
    world, grid, sweeps = settled(tower(size, size, height), cell)
    foot = int((world.height > 0).sum())
    text = f"{sweeps} sweeps, slope {over_repose(world, grid):.4f} of repose, {foot} of {size**2} cells covered"
    return text, foot, total(world) == height and rests(world, grid) and np.isfinite(world.height).all()


@case("a column of 10,000 m on 33 x 33 cells of 5 m: finite, settles, sum equal")
def tower_of_10000_on_33x33():
    text, _, ok = _tower(33, 10_000.0, 5.0)
    return text, ok


@case("the same on 128 x 128")
def tower_of_10000_on_128x128():
    text, _, ok = _tower(128, 10_000.0, 5.0)
    return text, ok


@case("a column of 1000 m on 9 x 9 cells of 0.5 m floods the map: every cell covered, settles, sum equal")
def tower_that_floods():
    text, foot, ok = _tower(9, 1000.0, CELL)
    return text, ok and foot == 81


@case("a column of 1e4 m on cells of 0.5 m, or of 1e300 m: refused with both numbers")
def spikes_beyond_the_exact_range():
    said = []
    for spike in (1e4, 1e300):
        try:
            world_of(tower(33, 33, spike))
        except ValueError as error:
            said.append(str(error))
    ok = len(said) == 2 and all("1024 m" in text and "reach" in text for text in said)
    return said[0] if said else "accepted", ok


@case("a shaft of 900 m in one cell: filled from its rim, settles, no height beyond the old ones")
def a_deep_shaft():
    ground = tower(41, 41, -900.0)
    world, grid, sweeps = settled(ground)
    ok = total(world) == -900.0 and rests(world, grid) and world.height.max() <= 0.0
    return f"{sweeps} sweeps, deepest {world.height.min():.2f} m", ok


@case("heights of 1e-300 m and the smallest float: nothing moves, nothing remains")
def denormal_heights():
    ground = np.full((9, 9), 1e-300)
    ground[4, 4] = 5e-324
    world, _, sweeps = settled(ground)
    return f"largest {world.height.max():g} m, {sweeps} sweep", sweeps == 1 and not world.height.any()


@case("noise below the quantum: nothing moves")
def noise_below_the_quantum():
    world, _, sweeps = settled(rough(40, 40, 1e-7))
    return f"quantum {world.quantum:.1e} m, {sweeps} sweep", sweeps == 1 and not world.height.any()


@case("a checkerboard of 10 m: settles in about 10 sweeps without a new highest or lowest cell")
def checkerboard_of_10():
    world, grid = world_of(10.0 * (np.indices((32, 32)).sum(0) % 2))
    low, high, inside = 0.0, 10.0, True
    sweeps = 0
    while world.pending[1] > world.pending[0] and sweeps < 1000:
        one_sweep(world, grid)
        sweeps += 1
        inside &= bool(world.height.min() >= low and world.height.max() <= high)
        low, high = float(world.height.min()), float(world.height.max())
    ok = inside and sweeps <= 30 and rests(world, grid)
    return f"{sweeps} sweeps, never beyond: {inside}", ok


@case("a checkerboard just above T: 2 sweeps, the last of which finds nothing")
def checkerboard_just_above():
    world, grid = world_of(1.01 * SLOPE * CELL * (np.indices((32, 32)).sum(0) % 2))
    sweeps = settle(world, grid, SOIL)
    return f"{sweeps} sweeps", sweeps == 2 and rests(world, grid)


@case("a critical wedge in float32: no false avalanche, not a bit changes")
def a_critical_wedge_stands():
    ramp = np.tile(SLOPE * CELL * np.abs(np.arange(128) - 63.5), (64, 1))
    world, grid = world_of(-ramp)
    before = world.height.copy()
    sweeps = settle(world, grid, SOIL)
    return f"{sweeps} sweep", sweeps == 1 and np.array_equal(before, world.height)


@case("a critical wedge and a grain of 0.3 m on its ridge: an avalanche, settled in at most 20,000 sweeps, sum equal")
def a_critical_wedge_and_a_grain():
    ramp = -np.tile(SLOPE * CELL * np.abs(np.arange(129) - 64.0), (64, 1))
    ramp[32, 64] += 0.3
    world, grid = world_of(ramp)
    before, start = total(world), world.height.copy()
    sweeps = settle(world, grid, SOIL)
    moved = int((world.height != start).sum())
    return f"{moved} of {ramp.size} cells changed in {sweeps} sweeps", (
        total(world) == before and rests(world, grid) and moved > 20 and sweeps <= 20_000
    )


@case("a ramp 1 % too steep over 256 x 256 cells, the worst step there is: settles, sum equal")
def an_avalanche_over_the_whole_map():
    ramp = np.tile(1.01 * SLOPE * CELL * np.arange(256.0), (256, 1))
    world, grid = world_of(ramp)
    before = total(world)
    sweeps = settle(world, grid, SOIL)
    moved = float(np.mean(world.height != np.round(ramp / world.quantum) * world.quantum))
    return f"{100 * moved:.0f} % of the cells moved, {sweeps} sweeps", total(world) == before and rests(world, grid)


@case("heights around 1e6 m given to the physics as they are: refused, for they have to be over a local datum")
def a_million_metres_without_a_datum():
    try:
        world_of(rough(8, 8, 1.0) + 1e6)
    except ValueError as error:
        return str(error), "datum" in str(error)
    return "accepted", False


@case("ground of 300 m over the datum slumps as ground at the datum, within 2 of its quanta a sweep")
def far_from_the_datum():
    heap = np.maximum(0.0, 4.0 - 1.2 * np.hypot(*(np.indices((41, 41)) - 20.0)) * CELL)
    low, _, sweeps = settled(heap)
    high, _, _ = settled(heap + 300.0)
    off = float(np.abs(high.height - 300.0 - low.height).max())
    return f"{off / high.quantum:.1f} quanta of {1e6 * high.quantum:.0f} um apart", off < 2 * sweeps * high.quantum


@case("rough ground, noise of 5 m: settles, sum equal, no height beyond the old ones")
def a_rough_start():
    ground = rough(64, 64, 5.0)
    world, grid = world_of(ground)
    before, low, high = total(world), world.height.min(), world.height.max()
    sweeps = settle(world, grid, SOIL)
    ok = total(world) == before and rests(world, grid) and low <= world.height.min() and world.height.max() <= high
    return f"{sweeps} sweeps, slope {over_repose(world, grid):.4f} of repose", ok


@case("a cliff of 20 m: no sweep makes a new highest or lowest cell, and the sum of squares only falls")
def a_cliff_never_overshoots():
    ground = np.zeros((24, 80))
    ground[:, 40:] = 20.0
    world, grid = world_of(ground)
    energy, low, high, good = np.inf, 0.0, 20.0, True
    sweeps = 0
    while world.pending[1] > world.pending[0]:
        one_sweep(world, grid)
        now = float(np.sum(world.height.astype(float) ** 2))
        good &= now <= energy + 1e-9 * now and low <= world.height.min() and world.height.max() <= high
        energy, low, high, sweeps = now, world.height.min(), world.height.max(), sweeps + 1
    return f"{sweeps} sweeps", bool(good) and rests(world, grid)


@case("settled ground is a fixed point: 100 grounds settled twice do not change by a bit")
def settled_ground_is_a_fixed_point():
    changed = 0
    for seed in range(100):
        world, grid, _ = settled(rough(24, 24, 2.0, seed))
        before = world.height.copy()
        settle(world, grid, SOIL)
        changed += not np.array_equal(before, world.height)
    return f"{changed} of 100 changed", changed == 0


@case("ground mirrored and turned in all 8 ways: the result mirrored and turned, to the last bit")
def symmetry():
    ground = rough(40, 40, 2.0)
    reference = settled(ground)[0].height
    unlike = 0
    for turn in range(8):
        here = np.rot90(ground, turn % 4)
        here = here.T if turn >= 4 else here
        there = np.rot90(reference, turn % 4)
        there = there.T if turn >= 4 else there
        unlike += not np.array_equal(settled(here)[0].height, there)
    return f"{unlike} of 8 differ", unlike == 0


@case("two avalanches in opposite corners of 256 x 256: as each alone, to the last bit")
def two_avalanches_far_apart():
    corners = [np.zeros((256, 256)) for _ in range(2)]
    corners[0][8:12, 8:12] = corners[1][-12:-8, -12:-8] = 9.0
    both, one, other = (settled(ground)[0].height for ground in (corners[0] + corners[1], *corners))
    return f"largest difference {np.abs(both - one - other).max():g} m", np.array_equal(both, one + other)


@case("the active window grown from one cell, and the whole map swept: equal to the last bit")
def the_window_is_exact():
    ground = tower(80, 60, 50.0)
    (small, grid), (whole, _) = (world_of(ground) for _ in range(2))
    small.pending[:] = 40, 41, 30, 31
    sweeps = settle(whole, grid, SOIL, "explicit")
    while small.pending[1] > small.pending[0]:
        one_sweep(small, grid)
    return f"{sweeps} sweeps", np.array_equal(small.height, whole.height)


def _by_method(method, heaps):
    """How a way to settle ends on some grounds: worst distance from plain sweeps over the soil, the most sweeps."""
    worst, most, good = 0.0, 0, True
    for ground in heaps:
        (plain, grid), (world, _) = (world_of(ground) for _ in range(2))
        before = total(world)
        settle(plain, grid, SOIL, "explicit")
        most = max(most, settle(world, grid, SOIL, method))
        good &= total(world) == before and rests(world, grid) and bool(np.isfinite(world.height).all())
        worst = max(worst, float(np.abs(world.height - plain.height).sum() / np.abs(ground).sum()))
    return f"at most {most} sweeps, {100 * worst:.2f} % from plain sweeps", good, worst


def _hard_grounds():
    cliff = np.zeros((24, 80))
    cliff[:, 40:] = 20.0
    ramp = np.tile(1.01 * SLOPE * CELL * np.arange(96.0), (96, 1))
    board = 10.0 * (np.indices((40, 40)).sum(0) % 2)
    return [tower(65, 65, 900.0), cliff, ramp, board, np.abs(rough(64, 64, 5.0))]


@case("super-steps on a tower, cliff, long ramp, checkerboard, noise: sum equal, at rest, within 3 % of plain sweeps")
def settled_by_super_steps():
    text, good, worst = _by_method("super", _hard_grounds())
    return text, good and worst < 0.03


@case("the projection on the same: sum equal, at rest; it is another physics, so within 25 % of plain sweeps only")
def settled_by_projection():
    text, good, worst = _by_method("projection", _hard_grounds())
    return text, good and worst < 0.25


@case("NaN, infinity: refused before a world is made, with how many cells")
def ground_that_is_not_finite():
    said = []
    for bad in (np.nan, np.inf, -np.inf):
        ground = np.zeros((6, 6))
        ground[2, 3] = bad
        try:
            make_world(ground, world_of(np.zeros((6, 6)))[1])
        except ValueError as error:
            said.append("1 cells that are not finite" in str(error))
    return f"{sum(said)} of 3 refused", said == [True] * 3
