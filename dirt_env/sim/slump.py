"""Relaxation of the ground to the angle of repose, on an exact active window (see `window` for its layout)."""

from dirt_env.sim.blade import Line, blocked_links
from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.laws import RATE, link_excess, quantise, slump_share
from dirt_env.sim.params import Grid, Soil
from dirt_env.sim.state import World
from dirt_env.sim.window import (
    DROP_X,
    DROP_Y,
    FLUX_X,
    FLUX_Y,
    GROUND,
    OPEN_X,
    OPEN_Y,
    RATE_X,
    RATE_Y,
    clear,
    drain,
    moving_box,
    pack,
    touches_ring,
    unpack,
    widen,
    window_around,
)  # fmt: skip

MARGIN = 4  # cells around the active ones that are packed with them; at least 2, so that the outer two stand still
PATIENCE = 24  # sweeps between two looks whether a smaller window would do
FLOOR = 0.01  # slope below which the tolerance does not shrink any further with the slope of repose [-]


@kernel
def limits(height, quantum, cell, slope, tolerance):
    """(T, the steepest drop that counts as settled, the rounding constant), in the ground's own precision."""
    real = height.dtype.type
    slack = max(tolerance * max(slope, FLOOR) * cell, 4 * quantum)
    lock = 1.5 * 2.0 ** (23 if height.itemsize == 4 else 52) * quantum
    return real(slope * cell), real(slope * cell + slack), real(lock)


@kernel
def differences(buffers, stride, n):
    """Height differences over the open links; a closed link's is 0, as a mirror there would have it."""
    ground = buffers[GROUND]
    here, right, above = ground[stride : stride + n], ground[stride + 1 :], ground[2 * stride :]
    open_x, open_y = buffers[OPEN_X][stride:], buffers[OPEN_Y][stride:]
    drop_x, drop_y = buffers[DROP_X][stride:], buffers[DROP_Y][stride:]
    for p in range(n):
        drop_x[p] = open_x[p] * (right[p] - here[p])
    for p in range(n):
        drop_y[p] = open_y[p] * (above[p] - here[p])


@kernel
def fluxes(drop, near_a, near_b, near_c, near_d, rate, flux, n, threshold, settled, lock):
    """F = a drop max(0, 1 - T / |grad|), rounded; `near_*` are the four links across, next to each of the n links.

    Returns how many links move soil.
    """
    quarter = drop.dtype.type(0.25)
    nothing = drop.dtype.type(0.0)
    count = 0
    for p in range(n):
        across = quarter * ((near_a[p] + near_b[p]) + (near_c[p] + near_d[p]))
        flow = quantise(rate[p] * drop[p] * slump_share(drop[p], across, threshold, settled), lock)
        flux[p] = flow
        count += flow != nothing
    return count


@kernel
def link_fluxes(buffers, links, levels, count, threshold, settled, lock):
    """The same over the links that the blade closes; returns how many of them move soil."""
    ground = buffers[GROUND]
    rate, nothing = ground.dtype.type(RATE), ground.dtype.type(0.0)
    moving = 0
    for k in range(count):
        p, q, along_x = links[k, 0], links[k, 1], links[k, 2]
        high, low = max(ground[p], ground[q]), min(ground[p], ground[q])
        excess = link_excess(high, low, levels[k, 0], levels[k, 1], threshold)
        flow = quantise(rate * excess, lock) if excess > settled - threshold else nothing
        moving += flow != nothing
        flow = flow if ground[q] > ground[p] else -flow
        if along_x:
            buffers[FLUX_X, p] = flow
        else:
            buffers[FLUX_Y, p] = flow
    return moving


@kernel
def divergence(buffers, stride, n):
    """h -= div F, every cell at once."""
    here = buffers[GROUND][stride : stride + n]
    out_x, in_x = buffers[FLUX_X][stride:], buffers[FLUX_X][stride - 1 :]
    out_y, in_y = buffers[FLUX_Y][stride:], buffers[FLUX_Y]
    for p in range(n):
        here[p] += (out_x[p] - in_x[p]) + (out_y[p] - in_y[p])


@kernel
def sweep(buffers, stride, n, links, levels, count, threshold, settled, lock):
    """One explicit step of the whole window; returns how many links moved soil."""
    differences(buffers, stride, n)
    x, y, s = buffers[DROP_X], buffers[DROP_Y], stride
    moving = fluxes(
        x[s:], y[s:], y[s + 1 :], y, y[1:], buffers[RATE_X][s:], buffers[FLUX_X][s:], n, threshold, settled, lock
    )
    moving += fluxes(
        y[s:],
        x[s:],
        x[2 * s :],
        x[s - 1 :],
        x[2 * s - 1 :],
        buffers[RATE_Y][s:],
        buffers[FLUX_Y][s:],
        n,
        threshold,
        settled,
        lock,
    )
    if count > 0:
        moving += link_fluxes(buffers, links, levels, count, threshold, settled, lock)
    divergence(buffers, stride, n)
    return moving


@kernel
def relax(height, solid, outside, buffers, links, levels, changed, pending, cell, soil, quantum, line, blade_low):
    """Let the ground slump until no face is steeper than repose (within the tolerance) or the sweeps are used up.

    `pending` is the window where the ground may be unsettled; what is left of it stays there. `line` is the blade, a
    barrier where `blade_low`. Returns (sweeps, height lost over an open border [m of one cell]).
    """
    rows, cols = height.shape
    border = 0 if outside is None else 1
    largest = (-border, rows + border, -border, cols + border)
    threshold, settled, lock = limits(height, quantum, cell, soil.slope, soil.tolerance)
    sweeps = 0
    lost = 0.0
    while pending[1] > pending[0] and sweeps < soil.max_sweeps:
        margin = MARGIN + max(pending[1] - pending[0], pending[3] - pending[2]) // 8
        window = window_around(pending, margin, rows, cols, border)
        stride = pack(height, solid, outside, buffers, window, border)
        n = (window[1] - window[0]) * stride
        count = 0
        if blade_low:
            count = blocked_links(line, cell, window, stride, buffers, links, levels)
        since = 0
        moving = 1
        while moving > 0 and sweeps < soil.max_sweeps:
            moving = sweep(buffers, stride, n, links, levels, count, threshold, settled, lock)
            if outside is not None and moving > 0:
                lost += drain(outside, buffers, stride, window, rows, cols)
            sweeps += 1
            since += 1
            if since >= margin - 1 and touches_ring(buffers, stride, window, largest):
                break
            if since == PATIENCE:
                break
        unpack(height, buffers, stride, window)
        widen(changed, max(window[0], 0), min(window[1], rows), max(window[2], 0), min(window[3], cols))
        if moving > 0:
            moving_box(buffers, stride, window, pending)
        else:
            clear(pending)
    return sweeps, lost


@entry
def settle_window(world: World, grid: Grid, soil: Soil, line: Line) -> int:
    """Relax what is pending of a world whose blade is up; returns the sweeps it took."""
    sweeps, lost = relax(
        world.height, world.solid, world.outside, world.buffers, world.links, world.link_levels, world.changed,
        world.pending, grid.cell, soil, world.quantum, line, False,
    )  # fmt: skip
    world.tally[0].lost += lost * grid.cell**2
    return sweeps
