"""Algorithms 1 and 2 as they stand in the paper: every cell, every step, every list; and every reading in `Rules`.

Slow and obvious; `voxel` is the fast twin of the default reading. The cells' lists of outgoing fill are kept by the way
they go: one array for each neighbour, for the cell above and for the one below.
"""

import numpy as np

from dirt_env.sim.jit import kernel

UP, DOWN = 8, 9  # ways out of a cell, after those to the neighbours on the same level


@kernel
def way(k):
    """(rows, columns) to neighbour k on the same level: west, east, south, north, the diagonals; k ^ 1 is opposite."""
    sign = -1 if k % 2 == 0 else 1
    if k < 2:
        return 0, sign
    if k < 4:
        return sign, 0
    return (sign, sign) if k < 6 else (sign, -sign)


@kernel
def sink(fill, seen, life, outgoing, r, c, m, rules):
    """Send min(fill, 1 - below) to the cell below, if it may enter there."""
    if life[r, c, m - 1] != 0:
        return
    amount = min(seen[r, c, m], max(0.0, 1.0 - seen[r, c, m - 1]))
    fill[r, c, m] -= amount
    if rules.down_in_transit:
        outgoing[DOWN, r, c, m] = amount
    else:
        fill[r, c, m - 1] += amount


@kernel
def spread(fill, seen, life, outgoing, r, c, m, rules):
    """Algorithm 2, lines 11 to 32."""
    here = seen[r, c, m]
    available = 0
    for k in range(rules.neighbours):
        dr, dc = way(k)
        if life[r + dr, c + dc, m] == 0 and here - seen[r + dr, c + dc, m] > rules.difference:
            available += 1
    if available >= 1:
        lock = 1.5 * 2.0**52 * rules.grain
        part = (here * rules.rate / available + lock) - lock
        for k in range(rules.neighbours):
            dr, dc = way(k)
            if life[r + dr, c + dc, m] == 0 and here - seen[r + dr, c + dc, m] > rules.difference:
                outgoing[k, r, c, m] = part
        fill[r, c, m] = here - available * part
    elif here > 1.0:
        above = life[r, c, m + 1]
        if above == 0 or (above > 0 and rules.rise_into_constraint):
            outgoing[UP, r, c, m] = here - 1.0
            fill[r, c, m] = here - (here - 1.0)


@kernel
def deliver(outgoing, incoming, r, c, m, rules):
    """ApplyFillOutgoing, seen from the cell that receives; pairs are added first, so that mirrors keep the last bit."""
    total = 0.0
    for pair in range(rules.neighbours // 2):
        dr, dc = way(2 * pair)
        total += outgoing[2 * pair + 1, r + dr, c + dc, m] + outgoing[2 * pair, r - dr, c - dc, m]
    incoming[r, c, m] = total + outgoing[UP, r, c, m - 1]
    if rules.down_in_transit:
        incoming[r, c, m] += outgoing[DOWN, r, c, m + 1]


@kernel
def plain_update(fill, incoming, life, rules):
    """One update (Algorithm 1) of the whole grid; whether anything changed."""
    rows, cols, high = fill.shape
    before, coming = fill.copy(), incoming.copy()
    outgoing = np.zeros((10, rows, cols, high))
    constraints = 0
    for r in range(rows):
        for c in range(cols):
            for m in range(high):
                if life[r, c, m] > 0:
                    life[r, c, m] -= 1
                    constraints += 1
    stages = 1 if rules.in_place else 3
    for stage in range(stages):
        seen = fill if rules.in_place else fill.copy()
        for r in range(1, rows - 1):
            for c in range(1, cols - 1):
                for m in range(1, high - 1):
                    if rules.in_place or stage == 0:
                        fill[r, c, m] += incoming[r, c, m]
                    if rules.in_place or stage == 1:
                        sink(fill, seen, life, outgoing, r, c, m, rules)
                    if rules.in_place or stage == 2:
                        spread(fill, seen, life, outgoing, r, c, m, rules)
    for r in range(1, rows - 1):
        for c in range(1, cols - 1):
            for m in range(1, high - 1):
                deliver(outgoing, incoming, r, c, m, rules)
    moving = constraints
    for r in range(rows):
        for c in range(cols):
            for m in range(high):
                moving += fill[r, c, m] != before[r, c, m] or incoming[r, c, m] != coming[r, c, m]
    return moving > 0
