"""The active window: the part of the ground that may move, packed into short one-dimensional buffers.

One sweep is then two loops over contiguous memory, whatever the window's shape. Cell (i, j) of a window with `stride`
columns (one more than it has, the last one closed) lies at p = (i + 1) * stride + j; its right link is x[p], to p + 1,
its upper link y[p], to p + stride. The rows of the buffers are named below.
"""

import numpy as np

from dirt_env.sim.intrinsics import flat
from dirt_env.sim.jit import kernel
from dirt_env.sim.lanes import LANES, first_of, last_of, load, some, spread, store, store_all
from dirt_env.sim.laws import RATE

GROUND, OPEN_X, OPEN_Y, RATE_Y, FLUX_X, FLUX_Y = range(6)
THRESHOLD, SETTLED = 6, 7  # of each cell, where the angle of repose differs from cell to cell
WHOLE = 8  # the loops of a sweep run over multiples of it, so that none of their work is left over as scalars


@kernel
def widen(box, r0, r1, c0, c1):
    """Make `box` hold the rows [r0, r1) and columns [c0, c1) as well; an empty one has r1 <= r0."""
    if box[1] <= box[0]:
        box[0], box[1], box[2], box[3] = r0, r1, c0, c1
    else:
        box[0], box[1] = min(box[0], r0), max(box[1], r1)
        box[2], box[3] = min(box[2], c0), max(box[3], c1)


@kernel
def clear(box):
    """Make `box` empty."""
    box[0], box[1], box[2], box[3] = 0, 0, 0, 0


@kernel
def on_map(box, rows, cols):
    """(r0, r1, c0, c1): the part of a box that lies on the map; at least one cell, the nearest."""
    r0, c0 = min(max(box[0], 0), rows - 1), min(max(box[2], 0), cols - 1)
    return r0, max(min(box[1], rows), r0 + 1), c0, max(min(box[3], cols), c0 + 1)


@kernel
def within(box, margin, rows, cols):
    """Whether a box grown by `margin` lies on the map."""
    return box[0] >= margin and box[1] + margin <= rows and box[2] >= margin and box[3] + margin <= cols


@kernel
def window_around(active, margin, rows, cols, border):
    """(r0, r1, c0, c1): `active` grown by `margin`, within the map and its `border` cells of ground outside."""
    return (
        max(active[0] - margin, -border),
        min(active[1] + margin, rows + border),
        max(active[2] - margin, -border),
        min(active[3] + margin, cols + border),
    )


@kernel
def swept_rows(window, rows, border):
    """(first, last + 1) row of the window that is swept: all but the outermost, unless the map ends there."""
    r0, r1 = window[0], window[1]
    return 0 if r0 <= -border else 1, r1 - r0 if r1 >= rows + border else r1 - r0 - 1


@kernel
def drain(outside, buffers, stride, window, rows, cols):
    """Take away what crossed the border in the last sweep; returns it [m of one cell].

    A cell beyond the border then lies at its own level, or at its neighbour's on the map if that is lower: the ground
    outside takes soil and gives none.
    """
    r0, r1, c0, c1 = window
    ground, flux_x, flux_y = buffers[GROUND], buffers[FLUX_X], buffers[FLUX_Y]
    gone = 0.0
    for r in range(r0, r1):
        beyond = r < 0 or r >= rows
        for c in range(c0, c1, 1 if beyond else max(c1 - c0 - 1, 1)):
            if beyond == (c < 0 or c >= cols):
                continue  # on the map, or beyond a corner, where there are no links
            p = (r - r0 + 1) * stride + c - c0
            if beyond:
                neighbour = p + stride if r < 0 else p - stride
                gone += flux_y[p] if r < 0 else -flux_y[neighbour]
            else:
                neighbour = p + 1 if c < 0 else p - 1
                gone += flux_x[p] if c < 0 else -flux_x[neighbour]
            level = outside[min(max(r, 0), rows - 1), min(max(c, 0), cols - 1)]
            ground[p] = min(level, ground[neighbour])
    return gone


@kernel
def copy_cells(source, place, target, to, count):
    """Copy `count` numbers of a flat array to another; up to LANES - 1 places behind them are written to, too."""
    for k in range(0, count, LANES):
        store_all(target, to + k, load(source, place + k, count - k))


@kernel
def fill(numbers, start, stop, value):
    """Make numbers[start:stop] of a flat array `value`, and up to LANES - 1 more."""
    same = spread(value)
    for k in range(start, stop, LANES):
        store_all(numbers, k, same)


@kernel
def fill_rows(numbers, first, last, end, no, value):
    """Make numbers[first:last] `value`, and those before and after it up to `end` or a few more `no`."""
    fill(numbers, 0, first, no)
    fill(numbers, first, last, value)
    fill(numbers, last, end, no)


@kernel
def open_links(buffers, tall, stride, first, last):
    """Open all links inside a window, and still those that are not swept, of all rows but [first, last)."""
    open_x, open_y, rate_y = buffers[OPEN_X], buffers[OPEN_Y], buffers[RATE_Y]
    flux_x, flux_y = buffers[FLUX_X], buffers[FLUX_Y]
    real = open_x.dtype.type
    no, yes, top, end = real(0.0), real(1.0), (tall + 1) * stride, (tall + 2) * stride + WHOLE
    fill_rows(open_x, stride, top, end, no, yes)
    fill_rows(open_y, stride, top - stride, end, no, yes)  # so that nothing crosses the top row's upper links
    fill_rows(rate_y, stride, top, end, no, real(RATE))
    for flux in (flux_x, flux_y):
        fill(flux, 0, (first + 1) * stride, no)
        fill(flux, (last + 1) * stride, end, no)
    for i in range(tall):
        p = np.uint64((i + 2) * stride - 1)  # the closed column
        open_x[p] = open_x[p - np.uint64(1)] = open_y[p] = no


@kernel
def close_rim(buffers, tall, wide, stride, window, rows, cols, border):
    """Take the links that lack neighbours, along the outermost rows and columns, out of the sweep.

    Not where the map ends there. The outermost row's links are left out of the loops' range; those above it and in the
    topmost row are closed, so that the loops may run on for a few cells.
    """
    _, r1, c0, c1 = window
    open_x, rate_y = buffers[OPEN_X], buffers[RATE_Y]
    no = rate_y.dtype.type(0.0)
    if r1 < rows + border:
        for k in range(tall * stride, (tall + 1) * stride):
            p = np.uint64(k)
            open_x[p] = rate_y[p - np.uint64(stride)] = no
    left, right = c0 > -border, c1 < cols + border
    for i in range(1, tall + 1):
        p = np.uint64(i * stride)
        if left:
            rate_y[p] = no
        if right:
            rate_y[p + np.uint64(wide - 1)] = no


@kernel
def close_solid(solid, x, y, stride, window, rows, cols):
    """Write 0 for the links to what is solid: x[p] and y[p] are numbers of the right and the upper ones."""
    r0, r1, c0, c1 = window
    no = x.dtype.type(0.0)
    for r in range(max(r0, 0), min(r1, rows)):
        for c in range(max(c0, 0), min(c1, cols)):
            if solid[r, c]:
                p = (r - r0 + 1) * stride + c - c0
                x[p] = x[p - 1] = y[p] = y[p - stride] = no


@kernel
def close_outside(buffers, stride, window, rows, cols):
    """Close the links between two cells beyond the border."""
    r0, r1, c0, c1 = window
    for r in range(r0, r1):
        for c in range(c0, c1):
            p = (r - r0 + 1) * stride + c - c0
            if r < 0 or r >= rows:
                buffers[OPEN_X, p] = 0
            if c < 0 or c >= cols:
                buffers[OPEN_Y, p] = 0


@kernel
def pack(height, solid, outside, buffers, window, border):
    """Copy the window's heights into the buffers, and find out which links soil can cross and which are swept.

    Returns the stride.
    """
    rows, cols = height.shape
    r0, r1, c0, c1 = window
    tall, wide = r1 - r0, c1 - c0
    stride = wide + 1
    open_links(buffers, tall, stride, *swept_rows(window, rows, border))
    close_rim(buffers, tall, wide, stride, window, rows, cols, border)
    ground, ground_map = buffers[GROUND], flat(height)
    first, count = max(c0, 0), min(c1, cols) - max(c0, 0)
    for r in range(max(r0, 0), min(r1, rows)):
        copy_cells(ground_map, r * cols + first, ground, (r - r0 + 1) * stride + first - c0, count)
    if solid is not None:
        close_solid(solid, buffers[OPEN_X], buffers[OPEN_Y], stride, window, rows, cols)
    if outside is not None and (r0 < 0 or c0 < 0 or r1 > rows or c1 > cols):
        close_outside(buffers, stride, window, rows, cols)
        drain(outside, buffers, stride, window, rows, cols)
    return stride


@kernel
def unpack(height, buffers, stride, window, moved, changed):
    """Copy the window's ground back onto the map, and widen `changed` by the cells that this alters.

    `moved`: (first, last + 1) of the places of links that have moved soil; other rows than theirs are as they were.
    """
    rows, cols = height.shape
    r0, r1, c0, c1 = window
    ground, ground_map = buffers[GROUND], flat(height)
    first, end = max(c0, 0), min(c1, cols)
    low, high = r0 + moved[0] // stride - 1, r0 + (moved[1] - 1) // stride + 1  # a link of the row below moves it too
    for r in range(max(r0, low, 0), min(r1, high, rows)):
        for c in range(first, end, LANES):
            p, n = r * cols + c, end - c
            new = load(ground, (r - r0 + 1) * stride + c - c0, n)
            altered = load(ground_map, p, n) != new
            if some(altered):
                store(ground_map, p, new, n)
                widen(changed, r, r + 1, c + first_of(altered), c + last_of(altered) + 1)


@kernel
def moving_range(buffers, start, stop):
    """(first, last + 1) of the places in [start, stop) of links that moved soil; (stop, stop) if none did."""
    flux_x, flux_y = buffers[FLUX_X], buffers[FLUX_Y]
    none, count = np.int32(0), np.int32(stop - start)
    low, high = count, none
    for k in range(count):
        p, place = np.uint64(start) + np.uint64(k), np.int32(k)
        moves = (flux_x[p] != 0) | (flux_y[p] != 0)
        low = min(low, place if moves else count)
        high = max(high, np.int32(place + 1) if moves else none)
    return start + low, max(start + high, start + low)


@kernel
def moving_box(buffers, stride, window, box):
    """Write the cells next to a link that moved soil into `box`, as map rows and columns [r0, r1) x [c0, c1)."""
    r0, r1, c0, c1 = window
    flux_x, flux_y = buffers[FLUX_X], buffers[FLUX_Y]
    top, bottom, left, right = r1, r0 - 1, c1, c0 - 1
    for r in range(r0, r1):
        base = (r - r0 + 1) * stride - c0
        for c in range(c0, c1):
            x, y = flux_x[base + c] != 0, flux_y[base + c] != 0
            if x or y:
                top, bottom = min(top, r), max(bottom, r + (1 if y else 0))
                left, right = min(left, c), max(right, c + (1 if x else 0))
    box[0], box[1], box[2], box[3] = top, bottom + 1, left, right + 1


@kernel
def touches_ring(buffers, stride, window, moving, limits_):
    """Whether soil moved in one of the outer two rows or columns of a window that does not end there at the map's edge.

    `moving`: the `moving_range`; `limits_`: the window's largest extent. Every link of a line is looked at, because
    loops without a way out run on vectors.
    """
    r0, r1, c0, c1 = window
    tall, wide = r1 - r0, c1 - c0
    found = 0
    if r0 > limits_[0] and moving[0] < 3 * stride:
        found += count_moving(buffers, 2 * stride, wide, 1, stride)
    if r1 < limits_[1] and moving[1] > (tall - 2) * stride:
        found += count_moving(buffers, (tall - 1) * stride, wide, 1, stride)
    low, high = max(moving[0] // stride, 1), min((moving[1] - 1) // stride, tall)
    for side in range(2):
        if (c0 > limits_[2]) if side == 0 else (c1 < limits_[3]):
            column = 1 if side == 0 else wide - 2
            found += count_moving(buffers, low * stride + column, high - low + 1, stride, 1)
    return found > 0


@kernel
def count_moving(buffers, first, n, along, across):
    """How many of n cells from place `first` on have soil moving to the side of higher places or across the line.

    The line's places are `along` apart; `across` leads from the line before it to this one.
    """
    flux_x, flux_y = buffers[FLUX_X], buffers[FLUX_Y]
    before = flux_y if across > 1 else flux_x
    count = 0
    for k in range(n):
        p = np.uint64(first + k * along)
        count += (flux_x[p] != 0) | (flux_y[p] != 0) | (before[p - np.uint64(across)] != 0)
    return count
