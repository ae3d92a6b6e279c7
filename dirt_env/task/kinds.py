"""What a cell is to the job: goal, design, wall or plain ground, and what follows for the soil on it."""

import numpy as np

from dirt_env.sim.jit import entry, kernel

OUTSIDE, GOAL, STRAY, DESIGN, SOLID = 1, 2, 4, 8, 16
"""Bits of a kind: outside the goal; in it; outside goal, start and design; in the design region; wall."""

HUGE = float(np.float32(1e30))  # m; no ground is as high
HIGH = np.float32(0.5 * HUGE)  # m over an aim of -HUGE, that of a goal, is more than this


@kernel
def least_todo(kind, limit):
    """Lower bound of what is to do in a cell of that kind [m]: only a design asks for soil (a goal: see `todo`)."""
    return np.float32(-limit) if kind & DESIGN else np.float32(0.0)


@kernel
def todo(over, limit, goal_depth):
    """What is to do in a cell [m], from its height over the aim, cut off below by `least_todo`: soil to take away."""
    return -goal_depth if over > HIGH else min(over, limit)


@entry
def set_targets(ground, height, asked, design, goal, solid, target, wanted, welcome):
    """Fill target f8[rows, cols] m, wanted (the goal's cells) and welcome (where soil may go), bool[rows, cols].

    `asked` is the layout's target and `height` its ground, `ground` what that has settled to: outside the design the
    target moves with it, so that untouched ground is never misplaced soil. A pit without a word of where its soil
    should go has its goal anywhere else. Returns how many cells the goal has, and how many lack soil for the design.
    """
    goals = lacks = 0
    for r in range(ground.shape[0]):
        for c in range(ground.shape[1]):
            in_design = design[r, c] and not solid[r, c]
            target[r, c] = asked[r, c] if in_design else ground[r, c] - (height[r, c] - asked[r, c])
            lacking = in_design and ground[r, c] < target[r, c]
            wanted[r, c] = goal[r, c] and not solid[r, c]
            welcome[r, c] = wanted[r, c] or lacking
            goals += wanted[r, c]
            lacks += lacking
    if goals == 0 and lacks == 0:
        for r in range(ground.shape[0]):
            for c in range(ground.shape[1]):
                wanted[r, c] = welcome[r, c] = not design[r, c] and not solid[r, c]
                goals += wanted[r, c]
    return goals, lacks


@entry
def weigh_cells(ground, target, wanted, start, design, solid, cell, haul, kind, aim, sums):
    """Turn haul f8[rows, cols] m, the way to where soil is welcome, into the job's, and fill kind, aim and sums.

    `sums` f8[4]: soil above the target outside the goal times its way, that soil [m of one cell]; what goal and design
    lack; cells of the design.
    """
    sums[:] = 0.0
    for r in range(ground.shape[0]):
        for c in range(ground.shape[1]):
            if solid[r, c]:
                kind[r, c], aim[r, c], haul[r, c] = SOLID, HUGE, 0.0
                continue
            off = ground[r, c] - target[r, c]
            if wanted[r, c]:
                kind[r, c], aim[r, c], haul[r, c] = GOAL, -HUGE, 0.0
                sums[2] -= off
                continue
            aim[r, c] = target[r, c]
            if design[r, c]:
                haul[r, c] = max(haul[r, c], cell)  # too much soil in a fill is not in place either
                kind[r, c] = OUTSIDE | DESIGN
                sums[2] += max(-off, 0.0)
                sums[3] += 1.0
            else:
                kind[r, c] = OUTSIDE if start[r, c] else OUTSIDE | STRAY
            sums[0] += max(off, 0.0) * haul[r, c]
            sums[1] += max(off, 0.0)
