"""Walls, obstacles and open borders: nothing goes through, and what leaves is in the ledger."""

from math import pi

import numpy as np

from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import (
    CELL,
    SLOPE,
    SOIL,
    Driven,
    at_rest,
    settled,
    soil_of,
    straight,
    sweep_blade,
    total,
    world_of,
)
from dirt_env.sim.advance import settle


@case("random driving with digging over an open border, 3000 steps: ground and ledger equal the start, to the last bit")
def the_ledger_of_an_open_border():
    drive = Driven(np.full((48, 56), 0.2), 14.0, 12.0, open_border=True)
    before = total(drive.world)
    for speed, yaw_rate, edge in np.random.default_rng(3).uniform((-2, -0.6, -0.25), (2, 0.6, 0.2), (3000, 3)):
        drive.go(speed, yaw_rate, edge)
    books = total(drive.world) + drive.lost / CELL**2
    return f"{drive.lost:.3f} m3 left, books off by {books - before:g} m", books == before and drive.lost > 0


@case("a table with open edges: k times the distance to the edge, within 2 %; ledger equal")
def a_table_with_open_edges():
    n = 30
    world, grid = world_of(np.zeros((n, n)), open_border=True)
    world.height[:] = 8.0
    before = total(world)
    settle(world, grid, SOIL._replace(tolerance=1e-3))
    line = np.minimum(np.arange(n), n - 1 - np.arange(n)) + 1
    exact = SLOPE * CELL * np.minimum.outer(line, line)
    off = float(np.abs(world.height - exact).sum() / exact.sum())
    books = total(world) + world.tally[0].lost / CELL**2
    return f"error {100 * off:.2f} %, books off by {books - before:g} m", off < 0.02 and books == before


@case("mud 8 m deep inside an open border drains to what counts as level; ledger equal, bounded")
def mud_drains():
    world, grid = world_of(np.zeros((24, 24)), open_border=True)
    world.height[:] = 8.0
    before = total(world)
    sweeps = settle(world, grid, soil_of(0.0))
    books = total(world) + world.tally[0].lost / CELL**2
    high = float(world.height.max())
    return f"highest {1e3 * high:.1f} mm, {sweeps} sweeps", books == before and high < 0.03 and sweeps <= 20_000


@case("a blade as wide as the map pushes everything over an open border: all of it in the ledger")
def pushed_over_the_border():
    world, grid = at_rest(10, 30, 0.25, open_border=True)
    before = total(world)
    tally = sweep_blade(world, grid, straight(0.2, 2.5, 0.0, 20.0, 0.25, width=50.0, height=100.0))
    left = total(world)
    ok = left + tally.lost == before and left < 0.01 * before
    return f"{tally.lost:g} of {before:g} m of a cell in the ledger", ok


@case("soil heaped to 8 m on one side of a wall one cell thick: none on the other side, none in the wall")
def a_straight_wall_holds():
    ground, solid = np.zeros((40, 40)), np.zeros((40, 40), bool)
    ground[:, :12] = 8.0
    solid[:, 20] = True
    world, *_ = settled(ground, solid=solid)
    beyond = float(np.abs(world.height[:, 20:]).max())
    return f"{beyond:g} m beyond, {world.height[20, 19]:.2f} m against it", beyond == 0 and world.height[20, 19] > 1.0


def _diagonal(size):
    """A wall of single cells that touch at their corners only, and which cells lie beyond."""
    row, col = np.indices((size, size))
    return row + col == size - 1, row + col > size - 1


@case("the same with a diagonal wall whose cells touch at their corners only")
def a_diagonal_wall_holds():
    solid, beyond = _diagonal(40)
    ground = np.where(np.indices((40, 40)).sum(0) < 25, 8.0, 0.0)
    world, *_ = settled(ground, solid=solid)
    through = float(np.abs(world.height[beyond]).max())
    return f"{through:g} m beyond", through == 0 and not world.height[solid].any()


def _against(solid, beyond, x, y, heading, runs, seed, spread):
    """The most soil beyond a wall after machines have pushed at it from about (x, y) in many ways."""
    rng, worst = np.random.default_rng(seed), 0.0
    for _ in range(runs):
        dx, dy, turn = rng.uniform(-1, 1, 3) * spread
        ground = np.where(beyond | solid, 0.0, 0.25)
        drive = Driven(ground, x + dx, y + dy, heading + turn, solid=solid).go(edge=-0.2, dt=2.0)
        before = total(drive.world)
        drive.go(speed=2.0, edge=-0.2, steps=10).go(speed=0.3, yaw_rate=0.3 * turn, edge=-0.2, steps=20)
        worst = max(worst, float(np.abs(drive.world.height[beyond | solid]).max()))
        if total(drive.world) != before:
            raise ArithmeticError("the volume is not what it was")
    return worst


@case("200 pushes at a wall one cell thick, at any angle to 30 degrees: no soil in it or beyond")
def pushed_at_a_straight_wall():
    solid = np.zeros((40, 40), bool)
    solid[:, 24] = True
    beyond = np.zeros_like(solid)
    beyond[:, 25:] = True
    worst = _against(solid, beyond, 5.0, 10.0, 0.0, 200, 0, np.array([1.0, 2.0, 0.5]))
    return f"at most {worst:g} m", worst == 0


@case("200 pushes at a diagonal wall of cells that touch at their corners only, head-on: no soil in it or beyond")
def pushed_at_a_diagonal_wall():
    solid, beyond = _diagonal(40)
    worst = _against(solid, beyond, 4.5, 4.5, 0.25 * pi, 200, 0, np.array([0.5, 0.5, 0.02]))
    return f"at most {worst:g} m", worst == 0


@case("every cell solid but four: soil settles in those four, sum equal")
def a_cage():
    solid = np.ones((20, 20), bool)
    solid[9:11, 9:11] = False
    ground = np.zeros((20, 20))
    ground[9, 9] = 4.0
    world, _, sweeps = settled(ground, solid=solid)
    inside = float(world.height[9:11, 9:11].sum())
    return f"{inside:g} m inside, {sweeps} sweeps", inside == 4.0 and total(world) == 4.0 and world.height[10, 10] > 0


@case("an open border, posts on its rim: ledger equal, no soil in the posts")
def posts_on_an_open_border():
    solid = np.zeros((30, 30), bool)
    solid[0, ::3] = solid[::4, -1] = True
    ground = np.where(solid, 0.0, 3.0)
    world, grid = world_of(np.zeros((30, 30)), solid=solid, open_border=True)
    world.height[:] = ground
    before = total(world)
    settle(world, grid, SOIL)
    books = total(world) + world.tally[0].lost / CELL**2
    return (
        f"{world.tally[0].lost:.1f} m3 left, books off by {books - before:g} m",
        books == before and not world.height[solid].any(),
    )


@case("a machine half over an open border, turning and digging there for 500 steps: finite, ledger equal")
def half_over_the_border():
    drive = Driven(np.full((30, 30), 0.2), 14.8, 7.5, open_border=True)
    before = total(drive.world)
    for speed, yaw_rate, edge in np.random.default_rng(4).uniform((-0.4, -0.6, -0.25), (0.4, 0.6, 0.1), (500, 3)):
        drive.go(speed, yaw_rate, edge)
    books = total(drive.world) + drive.lost / CELL**2
    finite = np.isfinite(drive.world.machine.item()).all()
    return f"{drive.lost:.3f} m3 left, books off by {books - before:g} m", books == before and bool(finite)
