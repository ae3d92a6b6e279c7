"""Grids as small, thin, large, empty and full as they come."""

import numpy as np

from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import (
    CELL,
    SLOPE,
    SOIL,
    Driven,
    over_repose,
    rests,
    rough,
    settled,
    total,
    tower,
    world_of,
)
from dirt_env.env import DirtPushEnv
from dirt_env.sim.advance import settle
from dirt_env.sim.laws import RATE


@case("one cell: nothing moves")
def grid_1x1():
    world, _, sweeps = settled([[3.0]])
    return f"{world.height[0, 0]:g} m after {sweeps} sweep", world.height[0, 0] == 3.0 and sweeps == 1


def _settles(rows, cols):
    ground = np.zeros((rows, cols))
    ground[0, 0] = 3.0
    world, grid, sweeps = settled(ground)
    share = over_repose(world, grid)
    ok = total(world) == 3.0 and 0.99 < share <= 1.0041
    return f"steepest slope {share:.4f} of repose, sum {total(world):g} m, {sweeps} sweeps", ok


@case("a row of cells settles: slope of repose within the tolerance, sum equal")
def grid_1xn():
    return _settles(1, 9)


@case("a column of cells settles as the row does")
def grid_nx1():
    return _settles(9, 1)


@case("four cells settle: slope of repose within the tolerance, sum equal")
def grid_2x2():
    return _settles(2, 2)


@case("a row and the same as a column: equal to the last bit")
def grid_1xn_is_nx1():
    ground = rough(1, 60, 2.0)
    row, column = settled(ground)[0].height, settled(ground.T)[0].height
    return f"largest difference {np.abs(row - column.T).max():g} m", np.array_equal(row, column.T)


@case("one cell 3 m over an open border: ledger exact; what one sweep to four sides leaves, 0.45 of repose (slowly: 1)")
def grid_1x1_open():
    world, grid = world_of([[0.0]], open_border=True)
    world.height[:] = 3.0
    settle(world, grid, SOIL)
    left = float(world.height[0, 0])
    threshold = SLOPE * CELL
    law = 3.0 - 4 * RATE * (3.0 - threshold**2 / 3.0)  # F = a d (1 - (T / d)**2), four times; then it is below T
    books, share = left + world.tally[0].lost / CELL**2, left / CELL / SLOPE
    return f"{left:.4f} m left (slope {share:.3f} of repose), sum with the ledger {books:g} m", (
        books == 3.0 and abs(left - law) < 1e-4
    )


@case("a strip of 1 x 20,000 with a tower of 900 m: a wedge of height sqrt(A k), within 1 %")
def grid_1x20000():
    world, _, sweeps = settled(tower(1, 20_000, 900.0), soil=SOIL._replace(tolerance=1e-3))
    high, exact = float(world.height.max()), (900.0 * CELL * SLOPE) ** 0.5
    ok = abs(high / exact - 1) < 0.01 and total(world) == 900.0
    return f"{high:.2f} m for {exact:.2f} m, {sweeps} sweeps", ok


@case("empty and full grids: one sweep, nothing moves")
def empty_and_full_grids():
    found = [settled(np.full((40, 40), depth)) for depth in (0.0, 60.0)]
    same = all((world.height == depth).all() for (world, _, _), depth in zip(found, (0.0, 60.0), strict=True))
    return f"sweeps {[sweeps for *_, sweeps in found]}, heights unchanged: {same}", same and found[0][2] == found[1][
        2
    ] == 1


@case("1024 x 1024 at rest: one sweep; then a step of the machine touches only what is around it")
def a_large_grid_costs_what_moves():
    drive = Driven(np.full((1024, 1024), 0.1), 256.0, 256.0)
    drive.world.changed[:] = 0
    drive.go(speed=1.0, edge=-0.1, steps=20)
    r0, r1, c0, c1 = drive.world.changed
    ok = 0 < (r1 - r0) * (c1 - c0) < 3000
    return f"{r1 - r0} x {c1 - c0} cells touched in 20 steps, {drive.sweeps} sweeps", ok


@case("cells of 2^-9 m to 2^7 m: the same pile, scaled, within 8 quanta; floor of the work the same")
def any_size_of_cell():
    piles = []
    for exponent in (-9, -1, 3, 7):
        cell = 2.0**exponent
        world, _, sweeps = settled(tower(31, 31, 100.0) * cell, cell)
        piles.append((world.height.astype(float) / cell, sweeps, world.quantum / cell))
    coarsest = max(quantum for *_, quantum in piles)
    off = max(float(np.abs(pile - piles[1][0]).max()) for pile, *_ in piles) / coarsest
    return f"at most {off:.1f} quanta apart, sweeps {[sweeps for _, sweeps, _ in piles]}", off < 8


@case("the smallest site a machine fits on, 200 steps of extreme actions: inside, finite, volume equal")
def the_smallest_site():
    env = DirtPushEnv(
        scene={
            "site": {"size": [3.0, 3.0]},
            "start": [{"region": {"kind": "rectangle", "center": [2.75, 2.75], "size": [0.5, 0.5]}, "depth": 0.2}],
            "goal": [{"region": {"kind": "rectangle", "center": [0.25, 0.25], "size": [0.5, 0.5]}}],
            "machine": {"length": 0.8, "width": 0.6, "pose": [1.5, 1.5, 0.0]},
            "blade": {"width": 1.0, "reach": 0.6},
        }
    )
    seen, _ = env.reset(seed=0)
    before = total(env.episode.world)
    inside = env.observation_space.contains(seen)
    for action in np.random.default_rng(0).choice([-1.0, 1.0], (200, 3)):
        seen, reward, *_ = env.step(action)
        inside &= env.observation_space.contains(seen) and np.isfinite(reward)
    ok = inside and total(env.episode.world) == before
    return f"observations inside: {inside}, sum equal: {total(env.episode.world) == before}", ok


@case("a grid whose sides differ 1 : 500, rough: settles, sum equal")
def a_thin_grid():
    ground = rough(4, 2000, 3.0)
    world, grid = world_of(ground)
    before = total(world)
    sweeps = settle(world, grid, SOIL)
    return f"{sweeps} sweeps, slope {over_repose(world, grid):.4f} of repose", total(world) == before and rests(
        world, grid
    )
