"""Relaxation of the ground to the angle of repose, on an exact active window (see `window` for its layout)."""

from math import sqrt

import numpy as np

from dirt_env.sim.bank import bank_of, loosen
from dirt_env.sim.blade import Line, blocked_links
from dirt_env.sim.jit import entry, kernel, uncounted
from dirt_env.sim.laws import RATE, link_excess, quantise, slump_share
from dirt_env.sim.params import Grid, Soil
from dirt_env.sim.state import World
from dirt_env.sim.window import (
    FLUX_X,
    FLUX_Y,
    GROUND,
    LANES,
    OPEN_X,
    OPEN_Y,
    RATE_Y,
    SETTLED,
    THRESHOLD,
    clear,
    drain,
    moving_box,
    moving_range,
    on_map,
    pack,
    swept_rows,
    touches_ring,
    unpack,
    widen,
    window_around,
)
from dirt_env.sim.zones import Zones

MARGIN = 2  # cells around the active ones that are packed with them; no fewer, so that the outer two stand still
PATIENCE = 36  # sweeps between two looks whether a smaller window would do
FLOOR = 0.01  # slope below which the tolerance does not shrink any further with the slope of repose [-]


@kernel
def limits(height, quantum, cell, slope, tolerance):
    """(T, the steepest drop that counts as settled, the rounding constant), in the ground's own precision."""
    real = height.dtype.type
    slack = max(tolerance * max(slope, FLOOR) * cell, 4 * quantum)
    lock = 1.5 * 2.0 ** (23 if height.itemsize == 4 else 52) * quantum
    return real(slope * cell), real(slope * cell + slack), real(lock)


@kernel
def at_rest(height, box, settled):
    """Whether no link near the changed cells of `box` can be steeper than `settled`, if all others are at rest.

    A link next to the changed ones has at most two differences across it that are not looked at here, each at most
    `settled`, and two of at most 0.6 of it: so |grad|**2 <= (0.6**2 + (0.3 + 0.5)**2) settled**2.
    """
    rows, cols = height.shape
    r0, r1, c0, c1 = max(box[0] - 1, 0), min(box[1] + 1, rows), max(box[2] - 1, 0), min(box[3] + 1, cols)
    calm = height.dtype.type(0.5999) * settled
    steep = 0
    for r in range(r0, r1):
        above = min(r + 1, r1 - 1)
        for c in range(c0, c1):
            h = height[r, c]
            steep += (abs(height[r, min(c + 1, c1 - 1)] - h) > calm) | (abs(height[above, c] - h) > calm)
        if steep > 0:
            return False
    return True


@kernel
def pack_limits(zones, buffers, stride, window, height, quantum, cell, tolerance):
    """Write T and what counts as settled for the soil of every cell of the window; beyond the map for the nearest."""
    rows, cols = height.shape
    r0, r1, c0, c1 = window
    for r in range(r0, r1):
        for c in range(c0, c1):
            index = zones.index[min(max(r, 0), rows - 1), min(max(c, 0), cols - 1)]
            threshold, settled, _ = limits(height, quantum, cell, zones.soils[index].slope, tolerance)
            p = (r - r0 + 1) * stride + c - c0
            buffers[THRESHOLD, p], buffers[SETTLED, p] = threshold, settled


@kernel
def safe_bound(settled, steepest):
    """The bound for `at_rest` where links may be settled up to anything from `settled` to the `steepest` [m].

    With differences of at most c looked at, and those across unseen at most `steepest`, |grad|**2 is at most
    c**2 + (steepest + c)**2 / 4; c is the largest for which that is settled**2, and 0.6 settled where both are equal.
    """
    if steepest == settled:
        return settled
    c = (sqrt(max(5.0 * settled * settled - steepest * steepest, 0.0)) - 0.5 * steepest) / 2.5
    return type(settled)(max(c, 0.0) / 0.6)


@kernel
def fluxes(buffers, stride, start, stop, threshold, settled, lock, zones=None):
    """F = a drop (1 - (T / |grad|)**2) over the links [start, stop), rounded.

    The difference over a closed link is 0, as a mirror there would have it. Unsigned indices need no test for the sign
    that Python's allow; with them the loop becomes one run of vector instructions. Between two soils a slope stands as
    the weaker of them does.
    """
    ground, open_x, open_y, rate_y = buffers[GROUND], buffers[OPEN_X], buffers[OPEN_Y], buffers[RATE_Y]
    flux_x, flux_y = buffers[FLUX_X], buffers[FLUX_Y]
    real = ground.dtype.type
    rate, quarter = real(RATE), real(0.25)
    one, row = np.uint64(1), np.uint64(stride)
    for k in range(start, stop):
        p = np.uint64(k)
        here, right, above, beyond = ground[p], ground[p + one], ground[p + row], ground[p + row + one]
        x, y = open_x[p] * (right - here), open_y[p] * (above - here)
        x_above = open_x[p + row] * (beyond - above)
        x_left = open_x[p - one] * (here - ground[p - one])
        x_above_left = open_x[p + row - one] * (above - ground[p + row - one])
        y_right = open_y[p + one] * (beyond - right)
        y_below = open_y[p - row] * (here - ground[p - row])
        y_below_right = open_y[p - row + one] * (right - ground[p - row + one])
        across_x = quarter * ((y + y_right) + (y_below + y_below_right))
        across_y = quarter * ((x + x_above) + (x_left + x_above_left))
        threshold_x = threshold_y = threshold
        settled_x = settled_y = settled
        if zones is not None:
            low, calm = buffers[THRESHOLD], buffers[SETTLED]
            threshold_x, threshold_y = min(low[p], low[p + one]), min(low[p], low[p + row])
            settled_x, settled_y = min(calm[p], calm[p + one]), min(calm[p], calm[p + row])
        flux_x[p] = quantise(rate * x * slump_share(x, across_x, threshold_x, settled_x), lock)
        flux_y[p] = quantise(rate_y[p] * y * slump_share(y, across_y, threshold_y, settled_y), lock)


@kernel
def link_fluxes(buffers, links, levels, count, threshold, settled, lock, zones=None):
    """The same over the links that the blade closes."""
    ground = buffers[GROUND]
    rate, nothing = ground.dtype.type(RATE), ground.dtype.type(0.0)
    for k in range(count):
        p, q, along_x = links[k, 0], links[k, 1], links[k, 2]
        if zones is not None:
            threshold = min(buffers[THRESHOLD, p], buffers[THRESHOLD, q])
            settled = min(buffers[SETTLED, p], buffers[SETTLED, q])
        high, low = max(ground[p], ground[q]), min(ground[p], ground[q])
        excess = link_excess(high, low, levels[k, 0], levels[k, 1], threshold)
        flow = quantise(rate * excess, lock) if excess > settled - threshold else nothing
        flow = flow if ground[q] > ground[p] else -flow
        if along_x:
            buffers[FLUX_X, p] = flow
        else:
            buffers[FLUX_Y, p] = flow


@kernel
def divergence(buffers, stride, start, stop):
    """h -= div F, every cell of [start, stop) at once."""
    ground, flux_x, flux_y = buffers[GROUND], buffers[FLUX_X], buffers[FLUX_Y]
    one, row = np.uint64(1), np.uint64(stride)
    for k in range(start, stop):
        p = np.uint64(k)
        ground[p] += (flux_x[p] - flux_x[p - one]) + (flux_y[p] - flux_y[p - row])


@kernel
def sweep(buffers, stride, start, stop, moving, links, levels, count, threshold, settled, lock, zones=None):
    """One explicit step of the window's links [start, stop); `moving` is the `moving_range` of the one before it.

    Returns that of this step. A gradient is taken over cells up to a row and one away, so links farther than that from
    what the last step moved carry what they carried in it, which is nothing.
    """
    near = start + max(moving[0] - stride - 1 - start, 0) // LANES * LANES
    far = min(start + (moving[1] + 2 * stride - start + LANES - 1) // LANES * LANES, stop)
    fluxes(buffers, stride, near, far, threshold, settled, lock, zones)
    if count > 0:
        link_fluxes(buffers, links, levels, count, threshold, settled, lock, zones)
    first, last = moving_range(buffers, near, far)
    if last > first:
        divergence(buffers, stride, first, min(first + (last + stride - first + LANES - 1) // LANES * LANES, stop))
    return first, last


@kernel
def relax(
    height, solid, outside, buffers, links, levels, changed, pending, cell, soil, quantum, line, blade_low, most,
    zones=None, bank=None,
):  # fmt: skip
    """Let the ground slump until no face is steeper than repose (within the tolerance), by at most `most` sweeps.

    `pending` is the window where the ground may be unsettled; what is left of it stays there. `line` is the blade, a
    barrier where `blade_low`. Bank soil that slumps away loosens where it was (see `bank`). Returns (sweeps, height
    lost over an open border [m of one cell]).
    """
    rows, cols = height.shape
    border = 0 if outside is None else 1
    largest = (-border, rows + border, -border, cols + border)
    threshold, settled, lock = limits(height, quantum, cell, soil.slope, soil.tolerance)
    sweeps = 0
    lost = 0.0
    while pending[1] > pending[0] and sweeps < most:
        margin = MARGIN + max(pending[1] - pending[0], pending[3] - pending[2]) // 16
        window = window_around(pending, margin, rows, cols, border)
        stride = pack(height, solid, outside, buffers, window, border)
        if zones is not None:
            pack_limits(zones, buffers, stride, window, height, quantum, cell, soil.tolerance)
        first, last = swept_rows(window, rows, border)
        start = (first + 1) * stride
        stop = start + ((last - first) * stride + LANES - 1) // LANES * LANES
        count = 0
        if blade_low:
            count = blocked_links(line, cell, window, stride, start, stop, buffers, links, levels)
        since = 0
        moving = start, stop
        while moving[1] > moving[0] and sweeps < most:
            moving = sweep(buffers, stride, start, stop, moving, links, levels, count, threshold, settled, lock, zones)
            sweeps += 1
            since += 1
            if moving[1] <= moving[0]:
                break
            if outside is not None:
                lost += drain(outside, buffers, stride, window, rows, cols)
                moving = start, stop  # what was drained moves links too
            if since >= margin - 1 and touches_ring(buffers, stride, window, moving, largest):
                break
            if since == PATIENCE:
                break
        if since > 1 or moving[1] > moving[0]:
            unpack(height, buffers, stride, window, changed)
        if moving[1] > moving[0]:
            moving_box(buffers, stride, window, pending)
            pending[0], pending[1], pending[2], pending[3] = on_map(pending, rows, cols)
        else:
            clear(pending)
        if bank is not None:
            r0, r1, c0, c1 = on_map(window, rows, cols)
            box = np.empty(4, np.int64)
            if loosen(height, bank, r0, r1, c0, c1, lock, box):
                widen(pending, box[0], box[1], box[2], box[3])
                widen(changed, box[0], box[1], box[2], box[3])
    return sweeps, lost


@entry
def settle_window(world: World, grid: Grid, soil: Soil, line: Line, zones: Zones | None = None) -> int:
    """Relax what is pending of a world whose blade is up; returns the sweeps it took."""
    world, zones = uncounted(world), uncounted(zones)
    sweeps, lost = relax(
        world.height, world.solid, world.outside, world.buffers, world.links, world.link_levels, world.changed,
        world.pending, grid.cell, soil, world.quantum, line, False, soil.max_sweeps,
        zones, bank_of(world.bank, world.natural, soil.swell),
    )  # fmt: skip
    world.tally[0].lost += lost * grid.cell**2
    return sweeps
