"""Long avalanches: super-time-stepping with exact volume, many sweeps' worth of slumping for few sweeps' work.

A super-step of s stages is worth s (s + 1) / 2 explicit sweeps: the Runge-Kutta-Legendre method of first order (Meyer,
Balsara and Aslam 2014), Y_j = mu_j Y_{j-1} + (1 - mu_j) Y_{j-2} + ..., with mu_j = (2 j - 1) / j. Written for what
crosses a link in stage j it is a sweep with momentum,

    H_j = (j - 1) / j H_{j-1} + a (2 j - 1) / j F(Y_{j-1}),   Y_j = Y_{j-1} - div round(H_j),

in which s no longer appears: a super-step can end after any stage, and heights stay exact.
"""

from math import sqrt

import numpy as np

from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.laws import RATE, quantise
from dirt_env.sim.params import Grid, Soil
from dirt_env.sim.sheet import (
    FLOW_X,
    FLOW_Y,
    GROUND,
    HALF,
    NEXT,
    OPEN_X,
    OPEN_Y,
    RATE_X,
    RATE_Y,
    drain_rim,
    hold_ring,
    move_flows,
    new_sheet,
    pack_ground,
    pack_links,
    reached,
    unpack_ground,
)
from dirt_env.sim.slump import limits
from dirt_env.sim.state import World
from dirt_env.sim.window import clear, widen, window_around

BLOCK = 4096  # cells that are swept at a time: what they need stays in the nearest cache
LOOK = 4  # stages between two looks whether all is settled and whether the window is wide enough
BAND = LOOK + 2  # cells along the window's sides that soil may not have reached at a look
SHARE = 0.5  # length of a super-step, as a share of the pseudo-time before it


@kernel
def lean_flows(low, here, high, flow_x, flow_y, n, momentum, gain, threshold2):
    """flow = momentum * flow + gain * F on the right and upper links of n cells, where all links around are open.

    `low`, `here`, `high` begin one cell to the left of them. F = drop (1 - T / g) of g2 > T2 needs no root: 1 - T / g
    is Pade's approximant about g = T, true to 1 % up to 2.5 T; cliffs give 4/5 of their due.
    """
    real = here.dtype.type
    quarter, nothing, four, five, ten = real(0.25), real(0.0), real(4.0), real(5.0), real(10.0)
    fourth, tenfold = threshold2 * threshold2, ten * threshold2
    for p in range(n):
        drop = here[p + 2] - here[p + 1]
        across = quarter * ((high[p + 1] - low[p + 1]) + (high[p + 2] - low[p + 2]))
        steep = drop * drop + across * across
        share = (four * (steep * steep - fourth)) / (fourth + steep * (tenfold + five * steep))
        flow_x[p] = momentum * flow_x[p] + gain * (drop * share if steep > threshold2 else nothing)
        drop = high[p + 1] - here[p + 1]
        across = quarter * ((here[p + 2] - here[p]) + (high[p + 2] - high[p]))
        steep = drop * drop + across * across
        share = (four * (steep * steep - fourth)) / (fourth + steep * (tenfold + five * steep))
        flow_y[p] = momentum * flow_y[p] + gain * (drop * share if steep > threshold2 else nothing)


@kernel
def masked_flows_x(low, here, high, open_x, above, below, rate, flow, n, momentum, gain, threshold2):
    """The same on right links; closed ones carry nothing and give nothing to the gradients around them.

    `open_x`, `above`, `below`: masks of the right link and of the upper and lower links of n + 1 cells.
    """
    real = here.dtype.type
    quarter, nothing, four, five, ten = real(0.25), real(0.0), real(4.0), real(5.0), real(10.0)
    fourth, tenfold = threshold2 * threshold2, ten * threshold2
    for p in range(n):
        drop = open_x[p] * (here[p + 2] - here[p + 1])
        left = above[p] * (high[p + 1] - here[p + 1]) + below[p] * (here[p + 1] - low[p + 1])
        right = above[p + 1] * (high[p + 2] - here[p + 2]) + below[p + 1] * (here[p + 2] - low[p + 2])
        across = quarter * (left + right)
        steep = drop * drop + across * across
        share = (four * (steep * steep - fourth)) / (fourth + steep * (tenfold + five * steep))
        flow[p] = momentum * flow[p] + gain * rate[p] * (drop * share if steep > threshold2 else nothing)


@kernel
def masked_flows_y(here, high, open_y, right, right_high, rate, flow, n, momentum, gain, threshold2):
    """The same on upper links. `right`, `right_high`: masks of the right links of both rows, from one cell before."""
    real = here.dtype.type
    quarter, nothing, four, five, ten = real(0.25), real(0.0), real(4.0), real(5.0), real(10.0)
    fourth, tenfold = threshold2 * threshold2, ten * threshold2
    for p in range(n):
        drop = open_y[p] * (high[p + 1] - here[p + 1])
        lower = right[p + 1] * (here[p + 2] - here[p + 1]) + right[p] * (here[p + 1] - here[p])
        upper = right_high[p + 1] * (high[p + 2] - high[p + 1]) + right_high[p] * (high[p + 1] - high[p])
        across = quarter * (lower + upper)
        steep = drop * drop + across * across
        share = (four * (steep * steep - fourth)) / (fourth + steep * (tenfold + five * steep))
        flow[p] = momentum * flow[p] + gain * rate[p] * (drop * share if steep > threshold2 else nothing)


@kernel
def update(ground, out_x, in_x, out_y, in_y, after, n, lock):
    """h - div F, with every flow rounded to the quantum."""
    for p in range(n):
        after[p] = ground[p] + (
            (quantise(out_x[p], lock) - quantise(in_x[p], lock)) + (quantise(out_y[p], lock) - quantise(in_y[p], lock))
        )


@kernel
def lean_rows(ground, after, flow_x, flow_y, stride, window, rows, cols, a, b, momentum, gain, threshold2, lock):
    """One stage of the sheet's rows [a, b), counted with the ring, of a window in which all links are open."""
    tall, wide = window[1] - window[0], window[3] - window[2]
    p, n = a * stride + 1, (b - a) * stride
    lean_flows(
        ground[p - stride - 1 :], ground[p - 1 :], ground[p + stride - 1 :], flow_x[p:], flow_y[p:], n,
        momentum, gain, threshold2,
    )  # fmt: skip
    for q in range(p - 1, p - 1 + n, stride):  # nothing crosses the window's sides
        flow_x[q] = flow_x[q + wide] = 0
    if b == tall + 1:
        flow_y[p + n - stride : p + n] = 0
    update(ground[p:], flow_x[p:], flow_x[p - 1 :], flow_y[p:], flow_y[p - stride :], after[p:], n, lock)
    hold_ring(ground, after, stride, window, rows, cols, a, b)


@kernel
def weights(stage, real):
    """(momentum, gain) of a stage of a super-step, counted from 1."""
    return real((stage - 1) / stage), real(RATE * (2 * stage - 1) / stage)


@kernel
def lean_stages(ground, after, flow_x, flow_y, stride, window, rows, cols, stage, count, threshold2, lock):
    """`count` stages after number `stage` of a super-step.

    Each follows the one before it one row behind, a few rows at a time, while these are still in the cache; the last
    leaves the ground in `ground` if `count` is even, else in `after`.
    """
    real = ground.dtype.type
    tall = window[1] - window[0]
    block = max(1, BLOCK // stride)
    for first in range(1, tall + count, block):
        for i in range(count):
            a, b = max(first - i, 1), min(first + block - i, tall + 1)
            if a < b:
                momentum, gain = weights(stage + i + 1, real)
                old, new = (ground, after) if i % 2 == 0 else (after, ground)
                lean_rows(old, new, flow_x, flow_y, stride, window, rows, cols, a, b, momentum, gain, threshold2, lock)


@kernel
def masked_stage(sheet, ground, after, stride, tall, momentum, gain, threshold, lock):
    """The same with walls and solid cells in the window."""
    p, n = stride + 1, tall * stride
    open_x, open_y = sheet[OPEN_X], sheet[OPEN_Y]
    low, here, high = ground[p - stride - 1 :], ground[p - 1 :], ground[p + stride - 1 :]
    threshold2 = threshold * threshold
    masked_flows_x(
        low, here, high, open_x[p:], open_y[p:], open_y[p - stride :], sheet[RATE_X][p:], sheet[FLOW_X][p:], n,
        momentum, gain, threshold2,
    )  # fmt: skip
    masked_flows_y(
        here, high, open_y[p:], open_x[p - 1 :], open_x[p + stride - 1 :], sheet[RATE_Y][p:], sheet[FLOW_Y][p:], n,
        momentum, gain, threshold2,
    )  # fmt: skip
    flow_x, flow_y = sheet[FLOW_X], sheet[FLOW_Y]
    update(ground[p:], flow_x[p:], flow_x[p - 1 :], flow_y[p:], flow_y[p - stride :], after[p:], n, lock)


@kernel
def count_steep(low, here, high, rate_x, rate_y, n, limit):
    """How many of the links that are swept have a gradient with a square above `limit`; all links are open."""
    quarter = here.dtype.type(0.25)
    count = 0
    for p in range(n):
        drop = here[p + 2] - here[p + 1]
        across = quarter * ((high[p + 1] - low[p + 1]) + (high[p + 2] - low[p + 2]))
        count += rate_x[p] * (drop * drop + across * across) > limit
        drop = high[p + 1] - here[p + 1]
        across = quarter * ((here[p + 2] - here[p]) + (high[p + 2] - high[p]))
        count += rate_y[p] * (drop * drop + across * across) > limit
    return count


@kernel
def count_steep_masked(low, here, high, x, x_low, x_high, y, y_low, rate_x, rate_y, n, limit):
    """The same where links are closed; `x` and `y` are the masks OPEN of the rows, from one cell before."""
    quarter = here.dtype.type(0.25)
    count = 0
    for p in range(n):
        drop = x[p + 1] * (here[p + 2] - here[p + 1])
        left = y[p + 1] * (high[p + 1] - here[p + 1]) + y_low[p + 1] * (here[p + 1] - low[p + 1])
        right = y[p + 2] * (high[p + 2] - here[p + 2]) + y_low[p + 2] * (here[p + 2] - low[p + 2])
        across = quarter * (left + right)
        count += rate_x[p] * (drop * drop + across * across) > limit
        drop = y[p + 1] * (high[p + 1] - here[p + 1])
        lower = x[p + 1] * (here[p + 2] - here[p + 1]) + x[p] * (here[p + 1] - here[p])
        upper = x_high[p + 1] * (high[p + 2] - high[p + 1]) + x_high[p] * (high[p + 1] - high[p])
        across = quarter * (lower + upper)
        count += rate_y[p] * (drop * drop + across * across) > limit
    return count


@kernel
def count_unsettled(sheet, ground, stride, tall, masked, settled):
    """How many links are steeper than what counts as settled, by the same arithmetic as `slump`."""
    p, n = stride + 1, tall * stride
    open_x, open_y = sheet[OPEN_X], sheet[OPEN_Y]
    limit = largest_square(settled)
    low, here, high = ground[p - stride - 1 :], ground[p - 1 :], ground[p + stride - 1 :]
    if not masked:
        return count_steep(low, here, high, sheet[RATE_X][p:], sheet[RATE_Y][p:], n, limit)
    return count_steep_masked(
        low, here, high, open_x[p - 1 :], open_x[p - stride - 1 :], open_x[p + stride - 1 :], open_y[p - 1 :],
        open_y[p - stride - 1 :], sheet[RATE_X][p:], sheet[RATE_Y][p:], n, limit,
    )  # fmt: skip


@kernel
def largest_square(bound):
    """The largest number whose root is at most `bound`."""
    real = type(bound)
    square = bound * bound
    while sqrt(square) > bound:
        square = np.nextafter(square, real(0.0))
    while sqrt(np.nextafter(square, real(np.inf))) <= bound:
        square = np.nextafter(square, real(np.inf))
    return square


@kernel
def largest_drop(sheet, ground, stride, tall):
    """Largest height difference over a link that is swept [m]."""
    rate_x, rate_y, work = sheet[RATE_X], sheet[RATE_Y], sheet[HALF]
    n = tall * stride
    drop_lines(ground[stride + 1 :], ground[2 * stride + 1 :], rate_x[stride + 1 :], rate_y[stride + 1 :], work, n)
    largest = work[0]
    for p in range(1, n):
        largest = max(largest, work[p])
    return largest


@kernel
def drop_lines(here, high, rate_x, rate_y, result, n):
    """The larger of the differences over the two links of n cells."""
    for p in range(n):
        result[p] = max(rate_x[p] * abs(here[p + 1] - here[p]), rate_y[p] * abs(high[p] - here[p]))


@kernel
def stages_allowed(elapsed, largest, quantum, single):
    """How many stages the next super-step may have, after `elapsed` pseudo-time (one sweep is worth RATE).

    Its worth, RATE s (s + 1) / 2, is at most SHARE of `elapsed`, and no flow may leave the range in which rounding to
    the quantum is exact: 2**22 quanta in single precision.
    """
    stages = int((sqrt(1.0 + 8.0 * SHARE * elapsed / RATE) - 1.0) / 2.0)
    if single and largest > 0:
        stages = min(stages, int(2.0**22 * quantum / (2.0 * RATE * largest)))
    return max(stages, 1)


@kernel
def grown(window, sides, largest):
    """The window with the `sides` that soil has come near to (see `sheet.reached`) moved outwards."""
    r0, r1, c0, c1 = window
    more = BAND + 2 + max(r1 - r0, c1 - c0) // 8
    return (
        max(r0 - more, largest[0]) if sides & 1 else r0,
        min(r1 + more, largest[1]) if sides & 2 else r1,
        max(c0 - more, largest[2]) if sides & 4 else c0,
        min(c1 + more, largest[3]) if sides & 8 else c1,
    )


@kernel
def avalanche(height, solid, outside, changed, pending, cell, soil, quantum, elapsed, most):
    """`slump.relax` by super-steps: at most `most` stages, the ground having slumped for `elapsed` pseudo-time before.

    Returns (stages, height lost over an open border [m of one cell]).
    """
    rows, cols = height.shape
    real = height.dtype.type
    border = 0 if outside is None else 1
    largest = (-border, rows + border, -border, cols + border)
    threshold, settled, lock = limits(height, quantum, cell, soil.slope, soil.tolerance)
    masked = solid is not None or outside is not None
    stages = stage = length = sides = 0
    lost = 0.0
    window = window_around(pending, BAND + 2, rows, cols, border)
    sheet, stride = new_sheet(height, (0, 0, 0, 0))
    ground, after = sheet[GROUND], sheet[NEXT]
    before = (0, 0, 0, 0)
    tall = 0
    while True:
        if window != before:
            old, old_stride = sheet, stride
            sheet, stride = new_sheet(height, window)
            ground, after = sheet[GROUND], sheet[NEXT]
            tall = window[1] - window[0]
            pack_ground(height, sheet, stride, window)
            pack_links(solid, outside, sheet, stride, window, rows, cols, masked)
            move_flows(old, old_stride, before, sheet, stride, window)
            if outside is not None:
                drain_rim(outside, ground, ground, stride, window, rows, cols)
                after[:] = ground
            before = window
        if stages % LOOK == 0:
            if count_unsettled(sheet, ground, stride, tall, masked, settled) == 0:
                clear(pending)
                break
            sides = reached(height, ground, stride, window, largest, BAND)
            if sides:
                unpack_ground(height, ground, stride, window)
                widen(changed, max(window[0], 0), min(window[1], rows), max(window[2], 0), min(window[3], cols))
                window = grown(window, sides, largest)
                continue
        if stages >= most:
            pending[0], pending[1] = max(window[0], 0), min(window[1], rows)
            pending[2], pending[3] = max(window[2], 0), min(window[3], cols)
            break
        if stage == length:
            elapsed += RATE * stage * (stage + 1) / 2
            length = stages_allowed(elapsed, largest_drop(sheet, ground, stride, tall), quantum, height.itemsize == 4)
            stage = 0
        run = min(length - stage, most - stages, LOOK - stages % LOOK, 1 if masked else LOOK)
        if masked:
            momentum, gain = weights(stage + 1, real)
            masked_stage(sheet, ground, after, stride, tall, momentum, gain, threshold, lock)
            if outside is not None:
                lost += drain_rim(outside, ground, after, stride, window, rows, cols)
        else:
            flow_x, flow_y = sheet[FLOW_X], sheet[FLOW_Y]
            lean_stages(
                ground, after, flow_x, flow_y, stride, window, rows, cols, stage, run, threshold * threshold, lock
            )
        stage += run
        stages += run
        if run % 2 == 1:
            ground, after = after, ground
    unpack_ground(height, ground, stride, window)
    widen(changed, max(window[0], 0), min(window[1], rows), max(window[2], 0), min(window[3], cols))
    return stages, lost


@entry
def settle_long(world: World, grid: Grid, soil: Soil, elapsed: float) -> int:
    """Relax what is pending of a world whose blade is up; returns the stages it took. See `avalanche`."""
    stages, lost = avalanche(
        world.height, world.solid, world.outside, world.changed, world.pending, grid.cell, soil, world.quantum,
        elapsed, soil.max_sweeps,
    )  # fmt: skip
    world.tally[0].lost += lost * grid.cell**2
    return stages


@entry
def is_settled(world: World, grid: Grid, soil: Soil) -> bool:
    """Whether no open link of a world with walls and nothing solid is steeper than what counts as settled."""
    height = world.height
    _, settled, _ = limits(height, world.quantum, grid.cell, soil.slope, soil.tolerance)
    window = (0, grid.rows, 0, grid.cols)
    sheet, stride = new_sheet(height, window)
    pack_ground(height, sheet, stride, window)
    pack_links(None, None, sheet, stride, window, grid.rows, grid.cols, False)
    return count_unsettled(sheet, sheet[GROUND], stride, grid.rows, False, settled) == 0
