"""Relaxation of the ground to the angle of repose, on an exact active window (see `window` for its layout)."""

import numpy as np

from dirt_env.sim.bank import bank_of, loosen
from dirt_env.sim.blade import close_links
from dirt_env.sim.intrinsics import flat, uncounted
from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.lanes import LANES, among, choose, load, load_all, none, some, spread, store_all
from dirt_env.sim.laws import RATE, link_excess, quantise, slump_share
from dirt_env.sim.params import Grid, Soil
from dirt_env.sim.state import World
from dirt_env.sim.window import (
    FLUX_X,
    FLUX_Y,
    GROUND,
    OPEN_X,
    OPEN_Y,
    RATE_Y,
    SETTLED,
    THRESHOLD,
    WHOLE,
    clear,
    close_solid,
    drain,
    fill,
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
def at_rest(height, solid, buffers, box, links, held, settled):
    """Whether no link near the changed cells of `box` is steeper than `settled`.

    `held` links of the list are closed. What lies beyond the window counts as closed, so that of the links along its
    rim, which no cell of the box has to do with, some may be taken for steep.
    """
    rows, cols = height.shape
    r0, r1, c0, c1 = max(box[0] - 2, 0), min(box[1] + 2, rows), max(box[2] - 2, 0), min(box[3] + 2, cols)
    tall, wide = r1 - r0, c1 - c0
    stride = wide + 1
    x, y, ground = buffers[FLUX_X], buffers[FLUX_Y], flat(height)
    nothing = x.dtype.type(0.0)
    no = spread(nothing)
    fill(x, 0, stride, nothing)
    fill(y, 0, stride, nothing)
    for i in range(tall):
        p, to = (r0 + i) * cols + c0, (i + 1) * stride
        above = wide if i + 1 < tall else 0
        for c in range(0, stride, LANES):
            here = load(ground, p + c, wide - c)
            store_all(x, to + c, choose(among(wide - 1 - c), load(ground, p + c + 1, wide - 1 - c) - here, no))
            store_all(y, to + c, choose(among(above - c), load(ground, p + c + cols, above - c) - here, no))
    fill(x, (tall + 1) * stride, (tall + 2) * stride, nothing)
    fill(y, (tall + 1) * stride, (tall + 2) * stride, nothing)
    for k in range(held):
        r, c, along_x = links[k, 0] - r0, links[k, 1] - c0, links[k, 2]
        if r >= 0 and r < tall and c >= 0 and c < wide:
            (x if along_x else y)[(r + 1) * stride + c] = 0
    if solid is not None:
        close_solid(solid, x, y, stride, (r0, r1, c0, c1), rows, cols)
    steep, quarter, most = none(), x.dtype.type(0.25), settled * settled
    for first in range(stride, (tall + 1) * stride, LANES):
        p, n = first, (tall + 1) * stride - first
        along_x, along_y = load_all(x, p), load_all(y, p)
        below = load_all(y, p - stride) + load_all(y, p - stride + 1)
        left = load_all(x, p - 1) + load_all(x, p + stride - 1)
        across_x = (along_y + load_all(y, p + 1) + below) * quarter
        across_y = (along_x + load_all(x, p + stride) + left) * quarter
        steep |= (along_x * along_x + across_x * across_x > most) & among(n)
        steep |= (along_y * along_y + across_y * across_y > most) & among(n)
    return not some(steep)


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
    near = start + max(moving[0] - stride - 1 - start, 0) // WHOLE * WHOLE
    far = min(start + (moving[1] + 2 * stride - start + WHOLE - 1) // WHOLE * WHOLE, stop)
    fluxes(buffers, stride, near, far, threshold, settled, lock, zones)
    if count > 0:
        link_fluxes(buffers, links, levels, count, threshold, settled, lock, zones)
    first, last = moving_range(buffers, near, far)
    if last > first:
        divergence(buffers, stride, first, min(first + (last + stride - first + WHOLE - 1) // WHOLE * WHOLE, stop))
    return first, last


@kernel
def relax(
    height, solid, outside, buffers, links, levels, changed, pending, cell, soil, quantum, held, most,
    zones=None, bank=None,
):  # fmt: skip
    """Let the ground slump until no face is steeper than repose (within the tolerance), by at most `most` sweeps.

    `pending` is the window where the ground may be unsettled; what is left of it stays there. The blade closes the
    first `held` links of the list (see `blade.held_links`). Bank soil that slumps away loosens where it was (see
    `bank`). Returns (sweeps, height lost over an open border [m of one cell]).
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
        stop = start + ((last - first) * stride + WHOLE - 1) // WHOLE * WHOLE
        count = close_links(window, stride, start, stop, buffers, links, levels, held)
        closed, closed_levels = links[held:], levels[held:]
        since = 0
        moving = start, stop
        low, high = stop, start
        while moving[1] > moving[0] and sweeps < most:
            moving = sweep(
                buffers, stride, start, stop, moving, closed, closed_levels, count, threshold, settled, lock, zones
            )
            sweeps += 1
            since += 1
            if moving[1] <= moving[0]:
                break
            low, high = min(low, moving[0]), max(high, moving[1])
            if outside is not None:
                lost += drain(outside, buffers, stride, window, rows, cols)
                moving = start, stop  # what was drained moves links too
            if since >= margin - 1 and touches_ring(buffers, stride, window, moving, largest):
                break
            if since == PATIENCE:
                break
        if since > 1 or moving[1] > moving[0]:
            unpack(height, buffers, stride, window, (low, high), changed)
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
def settle_window(world: World, grid: Grid, soil: Soil, zones: Zones | None = None) -> int:
    """Relax what is pending of a world whose blade is up; returns the sweeps it took."""
    world, zones = uncounted(world), uncounted(zones)
    sweeps, lost = relax(
        world.height, world.solid, world.outside, world.buffers, world.links, world.link_levels, world.changed,
        world.pending, grid.cell, soil, world.quantum, 0, soil.max_sweeps,
        zones, bank_of(world.bank, world.natural, soil.swell),
    )  # fmt: skip
    world.tally[0].lost += lost * grid.cell**2
    return sweeps
