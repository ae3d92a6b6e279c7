"""What the naive methods do, shown once each: it is right here that they fail, for that is why the care."""

from math import radians

import numpy as np

from dirt_env.bench.stability import twin
from dirt_env.bench.stability.cells import cells_of
from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import (
    CELL,
    SLOPE,
    SOIL,
    at_rest,
    rough,
    settled,
    straight,
    sweep_blade,
    total,
    tower,
)
from dirt_env.sim.voxel import update
from dirt_env.sim.voxel_state import GRAIN, Rules, volume

T = SLOPE * CELL


@case("naive, 4 neighbours with wrap-around (np.roll): soil from one edge appears at the other; here none does")
def naive_wrap_around():
    ground = np.zeros((32, 32))
    ground[:, 0] = 6.0
    wrapped = ground
    for _ in range(400):
        wrapped = twin.four_neighbours(wrapped, T, 0.1)
    ours = settled(ground)[0].height
    through = wrapped[:, 16:].sum() / ground.sum()
    return f"{100 * through:.0f} % of the soil went through; here {ours[:, 16:].sum():g} m", through > 0.3 and not ours[
        :, 16:
    ].any()


@case("naive, rate 0.5: cells overshoot below 0 and the swing grows without end; here the same ground settles")
def naive_rate_of_a_half():
    ground, swings = tower(32, 32, 20.0), []
    for _ in range(60):
        before, ground = ground, twin.four_neighbours(ground, T, 0.5, wrap=False)
        swings.append(float(np.abs(ground - before).max()))
    _, _, sweeps = settled(tower(32, 32, 20.0))
    grows = swings[-1] > swings[29]
    return (
        f"{swings[29]:.0e}, then {swings[-1]:.0e} m a sweep; here at rest after {sweeps} sweeps",
        grows and ground.min() < 0,
    )


@case("naive, 4 neighbours: the pile is a pyramid, over 15 % off the cone; here under 3 %")
def naive_pyramid():
    ground = tower(48, 48, 150.0)
    pile = ground
    for _ in range(6000):
        pile = twin.four_neighbours(pile, T, 0.12, wrap=False)
    volume = 150.0 * CELL**2
    high = (3 * SLOPE**2 * volume / np.pi) ** (1 / 3)
    fine = (np.arange(48 * 8) + 0.5) * CELL / 8 - 24.5 * CELL
    exact = np.maximum(high - SLOPE * np.hypot(fine[:, None], fine[None, :]), 0).reshape(48, 8, 48, 8).mean((1, 3))
    naive, ours = (float(np.abs(h - exact).sum() / exact.sum()) for h in (pile, settled(ground)[0].height))
    return f"{100 * naive:.1f} % off; here {100 * ours:.1f} %", naive > 0.15 and ours < 0.03


@case(
    "naive, a blade rounded to cells at 40 degrees, one cell a step: over 10 % of the soil stays behind; here under 2 %"
)
def naive_rounded_blade():
    layer = np.full((60, 60), 0.1)
    heading, distance = radians(40.0), 30.0
    after = twin.rounded_blade(layer, 10.0, 15.0, heading, 3.0, distance, 1.0)
    world, grid = at_rest(60, 60, 0.1)
    sweep_blade(
        world, grid, straight(10.5 * CELL, 15.5 * CELL, heading, distance * CELL, 0.25, width=7 * CELL, height=9.0)
    )
    row, col = np.indices((60, 60))
    ahead = (col - 10) * np.cos(heading) + (row - 15) * np.sin(heading)
    left = (row - 15) * np.cos(heading) - (col - 10) * np.sin(heading)
    track = (ahead > 2) & (ahead < 25) & (np.abs(left) < 2.5)
    naive, ours = (float(h[track].mean() / 0.1) for h in (after, world.height))
    return f"{100 * naive:.0f} % stays; here {100 * ours:.1f} %", naive > 0.1 and ours < 0.02


@case("naive, a blade rounded to cells at two cells a step: it leaps over soil; here nothing stays at any speed")
def naive_leaping_blade():
    layer = np.full((20, 60), 0.1)
    after = twin.rounded_blade(layer, 5.0, 10.0, 0.0, 3.0, 40.0, 2.0)
    stays = float(after[9:12, 8:40].mean() / 0.1)
    world, grid = at_rest(20, 60, 0.1)
    sweep_blade(world, grid, straight(5.5 * CELL, 10.5 * CELL, 0.0, 20.0, 0.25, width=7 * CELL, height=9.0))
    ours = float(world.height[9:12, 8:20].mean() / 0.1)
    return f"{100 * stays:.0f} % stays; here {100 * ours:.1f} %", stays > 0.3 and ours < 0.02


@case("naive, float32 without rounding to a quantum: the sum drifts; here it is equal to the last bit")
def naive_float32():
    ground = np.float32(rough(48, 48, 2.0))
    before, plain = float(ground.sum(dtype=np.float64)), ground
    for _ in range(2000):
        plain = twin.slump(plain, np.float32(0.24), np.float32(0.24), np.float32(0.0)).astype(np.float32)
    drift = abs(float(plain.sum(dtype=np.float64)) - before) / np.abs(ground).sum()
    world, *_ = settled(rough(48, 48, 2.0))
    ours = total(world) - float((np.round(rough(48, 48, 2.0) / world.quantum) * world.quantum).sum())
    return f"off by {drift:.0e} of all soil; here {ours:g} m", drift > 1e-10 and ours == 0.0


@case("naive, momentum on heights (0.8): it overshoots, and the tip is over 30 % too low; here it is not")
def naive_momentum():
    ground = tower(48, 48, 100.0)
    before = now = ground
    for _ in range(1500):
        ahead = now + 0.8 * (now - before)
        before, now = now, twin.slump(ahead, 0.12, 0.12, SLOPE, CELL, CELL)
    exact = (3 * SLOPE**2 * 100.0 * CELL**2 / np.pi) ** (1 / 3)
    ours = float(settled(ground)[0].height.max())
    return f"tip {now.max():.2f} m for {exact:.2f} m; here {ours:.2f} m", now.max() < 0.7 * ours


@case("naive, the paper's line 29 taken literally (sends all fill up, not fill - 1): volume grows; here it does not")
def naive_line_29():
    column, sent = np.array([1.5, 0.0, 0.0, 0.0]), np.zeros(4)
    for _ in range(12):
        column, sent = column + sent, np.zeros(4)
        over = column > 1
        sent[1:] = np.where(over, column, 0.0)[:-1]  # and the cell itself is cut off at 1
        column = np.minimum(column, 1.0)
    grown = float((column + sent).sum()) / 1.5
    voxels = cells_of([[1.5]], 4)
    update(voxels, Rules(0.5), 50)
    return f"times {grown:.2f}; here times {volume(voxels, 1.0) / 1.5:g}", grown > 1.2 and volume(voxels, 1.0) == 1.5


@case("naive, fill cut off at the top of the grid: soil is destroyed; here it stays in the topmost cell")
def naive_cut_off_at_the_top():
    voxels = cells_of(tower(5, 5, 6.0), 2)
    update(voxels, Rules(3.0, grain=GRAIN), 200)
    cut = float(np.minimum(voxels.fill, 1.0).sum())
    return f"{6.0 - cut:.2f} of 6 m destroyed; here {6.0 - volume(voxels, 1.0):g}", cut < 5.0 and volume(
        voxels, 1.0
    ) == 6.0


@case("naive, one sweep too long, a = 0.5 on an 8 m cliff: heights leave their range at once; here they do not")
def naive_long_sweeps():
    cliff = np.zeros((16, 32))
    cliff[:, 16:] = 8.0
    found = twin.after(cliff + rough(16, 32, 0.5), 30, 0.5, 0.5, slope=SLOPE, dx=CELL, dy=CELL)
    high = float(settled(cliff, soil=SOIL)[0].height.max())
    return f"up to {found.max():.1e} m; here {high:g} m", found.max() > 16 and high <= 8.0
