"""One-shot projection: the settled ground closest to the start, from coarse grids to fine, for very large collapses.

One backward Euler step of Prigozhin's model, min |h - h0|^2 with |grad h| <= k, solved for what crosses each link in
all (Prigozhin and Zaltzman 2003): h = h0 + div y, w = y + drop / 8, q = w max(0, 1 - T / (8 |w|)), and y follows q with
momentum (Beck and Teboulle 2009). A coarse grid's q is the start on the next finer one, so nothing is lost by going on
too far: unlike heights, flows can be taken back.

Soil here moves at once, along the slopes of the final ground; it ends elsewhere than soil that slumps little by little.
"""

from math import sqrt

import numpy as np

from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.laws import quantise
from dirt_env.sim.params import Grid, Soil
from dirt_env.sim.sheet import LANES
from dirt_env.sim.slump import limits
from dirt_env.sim.state import World
from dirt_env.sim.window import widen

START, GROUND, OPEN_X, OPEN_Y, FLOW_X, FLOW_Y, TRIAL_X, TRIAL_Y, WORK_X, WORK_Y = range(10)
COARSEST = 24  # cells along the shorter side of the coarsest grid, at least
FIRST, ITERATIONS = 200, 60  # on the coarsest grid, and on the finest; in between so many for each grid below
MARGIN = 6  # cells around those that the coarser grid moves that are swept as well
BLOCK = 1024  # cells that are swept at a time
TOGETHER, LAG = 4, 2  # iterations that go over the rows together, and the rows between them


@kernel
def attempts(here, ahead, trial, open_, work, n):
    """w = y + drop / 8 on n open links; nothing on closed ones."""
    eighth = here.dtype.type(0.125)
    for p in range(n):
        work[p] = open_[p] * (trial[p] + eighth * (ahead[p] - here[p]))


@kernel
def shrink(along, near_a, far_a, near_b, far_b, flow, trial, n, momentum, least):
    """q = w max(0, 1 - T / (8 |w|)) on n links and y = q + momentum (q - last q); `least` is T / 8.

    `near_a`, `far_a`, `near_b`, `far_b`: w of the links across, on either side (a, b) of both ends of each link.
    """
    quarter, nothing, one = along.dtype.type(0.25), along.dtype.type(0.0), along.dtype.type(1.0)
    for p in range(n):
        across = quarter * ((near_a[p] + far_a[p]) + (near_b[p] + far_b[p]))
        size = sqrt(along[p] * along[p] + across * across)
        share = one - least / size if size > least else nothing
        new = along[p] * share
        trial[p] = new + momentum * (new - flow[p])
        flow[p] = new


@kernel
def add_flows(start, out_x, in_x, out_y, in_y, ground, n):
    """h = h0 + div y."""
    for p in range(n):
        ground[p] = start[p] + ((out_x[p] - in_x[p]) + (out_y[p] - in_y[p]))


@kernel
def iterate_rows(level, stride, r, rows, r0, r1, c0, n, momentum, least):
    """One iteration's w in rows [r, r + rows) and the rest of it one row behind, of those in [r0, r1)."""
    ground, work_x, work_y = level[GROUND], level[WORK_X], level[WORK_Y]
    first, last = max(r, r0 - 1), min(r + rows, r1 + 1)  # w one row more on each side
    if first < last:
        p, m = first * stride + c0, n if n < stride else (last - first) * stride
        attempts(ground[p:], ground[p + 1 :], level[TRIAL_X][p:], level[OPEN_X][p:], work_x[p:], m)
        attempts(ground[p:], ground[p + stride :], level[TRIAL_Y][p:], level[OPEN_Y][p:], work_y[p:], m)
    first, last = max(r - 1, r0), min(r + rows - 1, r1)
    if first >= last:
        return
    p, m = first * stride + c0, n if n < stride else (last - first) * stride
    shrink(
        work_x[p:], work_y[p:], work_y[p + 1 :], work_y[p - stride :], work_y[p - stride + 1 :],
        level[FLOW_X][p:], level[TRIAL_X][p:], m, momentum, least,
    )  # fmt: skip
    shrink(
        work_y[p:], work_x[p:], work_x[p + stride :], work_x[p - 1 :], work_x[p + stride - 1 :],
        level[FLOW_Y][p:], level[TRIAL_Y][p:], m, momentum, least,
    )  # fmt: skip
    add_flows(
        level[START][p:], level[TRIAL_X][p:], level[TRIAL_X][p - 1 :], level[TRIAL_Y][p:],
        level[TRIAL_Y][p - stride :], ground[p:], m,
    )  # fmt: skip


@kernel
def iterate(level, stride, box, count, least):
    """`count` iterations on the rows and columns of `box` (r0, r1, c0, c1; the ring counted).

    A few of them at a time, each two rows behind the one before it, while these rows are still in the cache.
    """
    r0, r1, c0, c1 = box
    real = level.dtype.type
    n = c1 - c0
    if n > stride // 2:  # whole rows
        c0, n = 1, stride
    rows = max(1, BLOCK // stride) if n == stride else 1
    for k in range(0, count, TOGETHER):
        together = min(TOGETHER, count - k)
        for r in range(r0 - 1, r1 + rows + LAG * (together - 1), rows):
            for i in range(together):
                momentum = real((k + i) / (k + i + 3))
                iterate_rows(level, stride, r - LAG * i, rows, r0, r1, c0, n, momentum, least)


@kernel
def new_level(ground, dtype_of):
    """(level, stride): a grid's buffers with a ring of one closed cell; `ground` [rows, cols] m."""
    rows, cols = ground.shape
    stride = (cols + 2 + LANES - 1) // LANES * LANES
    level = np.zeros((10, (rows + 4) * stride), dtype_of.dtype)
    for r in range(rows):
        p = (r + 1) * stride + 1
        level[START, p : p + cols] = ground[r]
        level[OPEN_X, p : p + cols - 1] = 1
        if r + 1 < rows:
            level[OPEN_Y, p : p + cols] = 1
    level[GROUND] = level[START]
    return level, stride


@kernel
def halved(ground):
    """The grid of cells twice as wide: means of up to four heights."""
    rows, cols = ground.shape
    result = np.empty(((rows + 1) // 2, (cols + 1) // 2), ground.dtype)
    quarter = ground.dtype.type(0.25)
    for r in range(result.shape[0]):
        a, b = ground[2 * r], ground[min(2 * r + 1, rows - 1)]
        for c in range(result.shape[1]):
            d = min(2 * c + 1, cols - 1)
            result[r, c] = quarter * ((a[2 * c] + a[d]) + (b[2 * c] + b[d]))
    return result


@kernel
def prolong(coarse, coarse_stride, fine, stride, rows, cols):
    """Start a level from the flows of the coarser one, linear along the flow; returns the box (r0, r1, c0, c1) moved.

    A coarse link's flow, in heights of a coarse cell, is twice that on each of the two fine links that make it up.
    """
    two = fine.dtype.type(2.0)
    top, bottom, left, right = rows + 2, 0, cols + 2, 0
    for r in range(1, rows + 1):
        for c in range(1, cols + 1):
            p = r * stride + c
            q = ((r + 1) // 2) * coarse_stride + (c + 1) // 2
            x, y = coarse[FLOW_X], coarse[FLOW_Y]
            flow_x = two * x[q] if c % 2 == 0 else x[q] + x[q - 1]
            flow_y = two * y[q] if r % 2 == 0 else y[q] + y[q - coarse_stride]
            if flow_x != 0 or flow_y != 0:
                fine[FLOW_X, p] = fine[TRIAL_X, p] = fine[OPEN_X, p] * flow_x
                fine[FLOW_Y, p] = fine[TRIAL_Y, p] = fine[OPEN_Y, p] * flow_y
                top, bottom, left, right = min(top, r), max(bottom, r + 1), min(left, c), max(right, c + 1)
    n = rows * stride
    p = stride + 1
    add_flows(
        fine[START][p:], fine[TRIAL_X][p:], fine[TRIAL_X][p - 1 :], fine[TRIAL_Y][p:], fine[TRIAL_Y][p - stride :],
        fine[GROUND][p:], n,
    )  # fmt: skip
    return (
        max(top - MARGIN, 1),
        min(bottom + MARGIN + 1, rows + 1),
        max(left - MARGIN, 1),
        min(right + MARGIN + 1, cols + 1),
    )


@kernel
def close(level, stride, box):
    """Close the links that lead out of a box, on all sides."""
    r0, r1, c0, c1 = box
    for r in range(r0, r1):
        level[OPEN_X, r * stride + c0 - 1] = level[OPEN_X, r * stride + c1 - 1] = 0
    for c in range(c0, c1):
        level[OPEN_Y, (r0 - 1) * stride + c] = level[OPEN_Y, (r1 - 1) * stride + c] = 0


@kernel
def cascade(ground, threshold):
    """(level, stride, iterations): the finest level of `ground` [rows, cols] m with its flows."""
    grids = [ground]
    while min(grids[-1].shape) >= 2 * COARSEST:
        grids.append(halved(grids[-1]))
    level, stride = new_level(grids[-1], ground)
    box = (1, grids[-1].shape[0] + 1, 1, grids[-1].shape[1] + 1)
    real = ground.dtype.type
    total = 0
    for depth in range(len(grids) - 1, -1, -1):
        if depth < len(grids) - 1:
            coarse, coarse_stride = level, stride
            level, stride = new_level(grids[depth], ground)
            box = prolong(coarse, coarse_stride, level, stride, grids[depth].shape[0], grids[depth].shape[1])
            close(level, stride, box)
        count = FIRST if depth == len(grids) - 1 else ITERATIONS * (1 + depth)
        iterate(level, stride, box, count, real(0.125 * threshold * 2.0**depth))
        total += count
    return level, stride, total


@entry
def project(world: World, grid: Grid, soil: Soil) -> int:
    """Move a world's ground, which has walls and nothing solid, to its projection, to within a few hundredths of T.

    Returns the iterations on all grids; flows are rounded to the quantum, so that the volume stays exact.
    """
    height = world.height
    rows, cols = height.shape
    threshold, _, lock = limits(height, world.quantum, grid.cell, soil.slope, soil.tolerance)
    level, stride, total = cascade(height, threshold)
    flow_x, flow_y = level[FLOW_X], level[FLOW_Y]
    for r in range(rows):
        for c in range(cols):
            p = (r + 1) * stride + c + 1
            height[r, c] += (quantise(flow_x[p], lock) - quantise(flow_x[p - 1], lock)) + (
                quantise(flow_y[p], lock) - quantise(flow_y[p - stride], lock)
            )
    widen(world.changed, 0, rows, 0, cols)
    return total
