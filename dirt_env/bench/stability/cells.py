"""The paper's cells at the ends of their parameters."""

from math import pi

import numpy as np

from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import BLADE, MACHINE, SOIL, rough, tower
from dirt_env.sim.advance import place
from dirt_env.sim.params import Command, Grid
from dirt_env.sim.voxel import update
from dirt_env.sim.voxel_advance import advance_voxels, make_voxel_world, settle_voxels
from dirt_env.sim.voxel_state import GRAIN, Rules, make_voxels, volume

PATIENCE = 20_000
PACE = 60.0


def cells_of(ground, levels, cell=1.0, dy=1.0, **others):
    """Cells filled up to a ground [m]."""
    return make_voxels(ground, Grid(*np.shape(ground), cell), dy, 0.0, levels, **others)


@case("a rate beyond 4 r on rough ground: a limit cycle; updates end at 20,000, volume equal to 1e-12, fills bounded")
def cells_in_a_limit_cycle():
    ground = np.random.default_rng(1).uniform(0.4, 1.0, (24, 24))
    calm, wild = cells_of(ground, 2), cells_of(ground, 2)
    before = volume(wild, 1.0)
    rested, restless = update(calm, Rules(0.02, 0.02), PATIENCE), update(wild, Rules(0.02, 0.12), PATIENCE)
    ok = rested < PATIENCE == restless and abs(volume(wild, 1.0) / before - 1) < 1e-12 and wild.fill.min() >= 0
    return f"rate r: at rest after {rested} updates; rate 6 r: never, fills up to {wild.fill.max():.2f}", ok


@case("r >= 1: a vertical wall of full cells stands for ever, at rest at once")
def cells_frozen_at_r_1():
    ground = np.zeros((8, 16))
    ground[:, :8] = 5.0
    voxels = cells_of(ground, 8)
    before = voxels.fill.copy()
    done = update(voxels, Rules(1.0), PATIENCE)
    return f"{done} update", done <= 2 and np.array_equal(voxels.fill, before)


@case("r just under 1: the same wall comes down, steepest step at most 2 r")
def cells_move_under_r_1():
    ground = np.zeros((8, 30))
    ground[:, :8] = 5.0
    voxels = cells_of(ground, 8)
    done = update(voxels, Rules(0.95), PATIENCE)
    heights = voxels.fill[1:-1, 1:-1, 1:-1].sum(2)
    steep = float(np.abs(np.diff(heights, axis=1)).max())
    return f"{done} updates, steepest step {steep:.2f} levels", done < PATIENCE and steep <= 1.9 + 1e-9


@case("r from 0.05 to 0.95: at rest between r and 2 r levels a cell, as the paper's rule has it")
def cells_rest_between_r_and_2r():
    found = []
    for r in np.linspace(0.05, 0.95, 10):
        voxels = cells_of(tower(25, 25, 14.0), 16)
        if update(voxels, Rules(float(r)), PATIENCE) < PATIENCE:
            pile = voxels.fill[1:-1, 1:-1, 1:-1].sum(2)
            found.append(max(float(np.abs(np.diff(pile, axis=axis)).max()) for axis in (0, 1)) / r)
    return f"{len(found)} of 10 at rest, {min(found):.2f} to {max(found):.2f} r", max(found) <= 2 + 1e-9 and len(
        found
    ) > 7


@case("a column higher than the grid: its topmost cell is overfull and keeps it; volume equal to 1e-12")
def cells_without_headroom():
    voxels = cells_of(tower(15, 15, 12.0), 3)
    before = volume(voxels, 1.0)
    done = update(voxels, Rules(0.5), PATIENCE)
    off = volume(voxels, 1.0) / before - 1
    return f"{done} updates, volume off by {off:.0e}, fullest cell {voxels.fill.max():.2f}", abs(off) < 1e-12


@case("pushing 2 m of soil under a ceiling 0.5 m up, 200 steps: volume equal to the last bit, no cell in the ceiling")
def cells_pushed_against_the_ceiling():
    grid, rules = Grid(32, 48, 0.5), Rules(0.7, grain=GRAIN)
    world = make_voxel_world(np.full((32, 48), 0.4), grid, rules, 0.5, 0.5, 0.5)
    before = volume(world.voxels, grid.cell)
    place(world, grid, SOIL, BLADE, MACHINE, 4.0, 8.0, 0.0)
    for _ in range(200):
        advance_voxels(world, grid, SOIL, BLADE, MACHINE, rules, PACE, Command(1.0, 0.1, -0.25), 0.5)
    shut = float(np.abs(world.fill[:, :, -1]).max())
    ok = volume(world.voxels, grid.cell) == before and shut == 0.0
    return f"fullest cell {world.fill.max():.2f}, in the ceiling {shut:g}", ok


@case("random driving on cells with `exact`, 500 steps: the sum of all fill equal to the last bit")
def cells_keep_their_volume():
    grid, rules = Grid(32, 32, 0.5), Rules(0.7, grain=GRAIN)
    world = make_voxel_world(np.abs(rough(32, 32, 0.3)), grid, rules, 0.5, 1.0, 2.0)
    settle_voxels(world, rules)
    before = volume(world.voxels, grid.cell)
    place(world, grid, SOIL, BLADE, MACHINE, 8.0, 8.0, 0.0)
    for speed, yaw_rate, edge in np.random.default_rng(3).uniform((-2, -0.6, -0.25), (2, 0.6, 0.2), (500, 3)):
        advance_voxels(world, grid, SOIL, BLADE, MACHINE, rules, PACE, Command(speed, yaw_rate, edge), 0.5)
    off = volume(world.voxels, grid.cell) - before
    return f"off by {off:g} m3, moved {world.tally[0].cut:.3f} m3 in the last step", off == 0


@case("40 pushes on cells at a wall one cell thick: no soil beyond it")
def cells_pushed_at_a_wall():
    grid, rules = Grid(32, 40, 0.5), Rules(0.7, grain=GRAIN)
    solid = np.zeros((32, 40), bool)
    solid[:, 24] = True
    rng, worst = np.random.default_rng(0), 0.0
    ground = np.where(np.arange(40) < 24, 0.25, 0.0) * np.ones((32, 1))
    for _ in range(40):
        world = make_voxel_world(ground, grid, rules, 0.5, 0.5, 2.0, solid)
        at = 5.0 + rng.uniform(-1, 1), 8.0 + rng.uniform(-2, 2), rng.uniform(-0.5, 0.5)
        place(world, grid, SOIL, BLADE, MACHINE, *at)
        beyond = float(world.fill[:, 26:].sum())
        for command in [Command(0.0, 0.0, -0.2)] * 2 + [Command(2.0, 0.0, -0.2)] * 10:
            advance_voxels(world, grid, SOIL, BLADE, MACHINE, rules, PACE, command, 0.5)
        worst = max(worst, float(world.fill[:, 26:].sum() + world.incoming[:, 26:].sum()) - beyond)
    return f"at most {worst:g} cells beyond", worst == 0.0


@case("turning on the spot on cells, 500 steps: volume equal, updates as many as were asked for")
def cells_turned_on_the_spot():
    grid, rules = Grid(32, 32, 0.5), Rules(0.7, grain=GRAIN)
    world = make_voxel_world(np.full((32, 32), 0.3), grid, rules, 0.5, 1.0, 2.0)
    before, most = volume(world.voxels, grid.cell), 0
    place(world, grid, SOIL, BLADE, MACHINE, 8.0, 8.0, 0.25 * pi)
    for _ in range(500):
        advance_voxels(world, grid, SOIL, BLADE, MACHINE, rules, PACE, Command(0.0, 0.6, -0.1), 0.5)
        most = max(most, int(world.tally[0].sweeps))
    return f"at most {most} updates in a step of {PACE * 0.5:g}", volume(
        world.voxels, grid.cell
    ) == before and most <= 30


@case("one cell, one level, empty and overfull: at rest at once")
def cells_of_1x1x1():
    done = [update(cells_of([[depth]], 1), Rules(0.5), PATIENCE) for depth in (0.0, 0.5, 7.0)]
    return f"updates {done}", max(done) <= 1


@case("constraints of the longest life, 32,766 updates: they block that long and then go")
def cells_with_the_longest_life():
    voxels = cells_of(tower(3, 3, 0.9), 1)
    voxels.life[1:-1, 1:-1, 1][[0, 1, 1, 2], [1, 0, 2, 1]] = 32_767
    blocked = update(voxels, Rules(0.5, life=32_766), 32_766)
    still = float(voxels.fill[2, 2, 1])
    update(voxels, Rules(0.5), 10)
    return f"{blocked} updates blocked, fill {still:g} then {voxels.fill[2, 2, 1]:.3f}", still == 0.9 > voxels.fill[
        2, 2, 1
    ]
