"""Wide windows of the ground, laid out for fast sweeps, with a ring of one cell around them.

A sheet is an array [14, size] of rows laid out end to end; cell (i, j) of the window lies at
p = (i + 1) * stride + j + 1, its right link at p of the rows `_X`, to p + 1, its upper link at p of the rows
`_Y`, to p + stride. The ring holds what lies around the window: the ground, or beyond a wall a mirror of it,
over which there are no differences.
"""

import numpy as np

from dirt_env.sim.jit import kernel

# The first four as in `window`, for `blade.close_links`; NEXT takes the ground after a sweep, HALF is work space.
# FLOW is what links carry, SENT its whole quanta, REST what is left to send; FINE is the ground without rounding.
GROUND, OPEN_X, OPEN_Y, RATE_Y, RATE_X, NEXT, HALF, FLOW_X, FLOW_Y, SENT_X, SENT_Y, REST_X, REST_Y, FINE = range(14)
LANES = 16  # the stride is a multiple of this: whole vector registers


@kernel
def is_open(solid, outside, r, c, rows, cols):
    """Whether soil can lie in cell (r, c): on the map or beyond an open border, and not solid."""
    if r < 0 or c < 0 or r >= rows or c >= cols:
        return outside is not None
    return solid is None or not solid[r, c]


@kernel
def on_rim(r, c, rows, cols):
    """1 for a cell beyond the border, 0 on the map."""
    return 1 if r < 0 or c < 0 or r >= rows or c >= cols else 0


@kernel
def new_sheet(height, window):
    """(sheet, stride) for a window (r0, r1, c0, c1), empty."""
    tall, wide = window[1] - window[0], window[3] - window[2]
    stride = (wide + 2 + LANES - 1) // LANES * LANES
    return np.zeros((14, (tall + 2) * stride + 2 * LANES), height.dtype), stride


@kernel
def pack_ground(height, sheet, stride, window):
    """Copy heights of and around the window into GROUND, FINE and NEXT; beyond the map lies the nearest cell."""
    rows, cols = height.shape
    r0, r1, c0, c1 = window
    for r in range(r0 - 1, r1 + 1):
        line = height[min(max(r, 0), rows - 1)]
        base = (r - r0 + 1) * stride - c0 + 1
        for c in range(c0 - 1, c1 + 1):
            level = line[min(max(c, 0), cols - 1)]
            sheet[GROUND, base + c] = sheet[FINE, base + c] = sheet[NEXT, base + c] = level


@kernel
def pack_links(solid, outside, sheet, stride, window, rows, cols, masked):
    """Write which links soil can cross (OPEN), and which of them the window sweeps (RATE): those inside it."""
    r0, r1, c0, c1 = window
    if not masked:  # all links inside the window, and no need of OPEN
        for p in range(stride + 1, (r1 - r0 + 1) * stride + 1, stride):
            sheet[RATE_X, p : p + c1 - c0 - 1] = 1
            if p <= (r1 - r0) * stride:
                sheet[RATE_Y, p : p + c1 - c0] = 1
        return
    for r in range(r0 - 1, r1 + 1):
        base = (r - r0 + 1) * stride - c0 + 1
        for c in range(c0 - 1, c1 + 1):
            if not is_open(solid, outside, r, c, rows, cols):
                continue
            rim = on_rim(r, c, rows, cols)
            if c < c1 and is_open(solid, outside, r, c + 1, rows, cols):
                if rim + on_rim(r, c + 1, rows, cols) < 2:
                    sheet[OPEN_X, base + c] = 1
                    sheet[RATE_X, base + c] = 1 if r0 <= r < r1 and c >= c0 and c + 1 < c1 else 0
            if r < r1 and is_open(solid, outside, r + 1, c, rows, cols):
                if rim + on_rim(r + 1, c, rows, cols) < 2:
                    sheet[OPEN_Y, base + c] = 1
                    sheet[RATE_Y, base + c] = 1 if c0 <= c < c1 and r >= r0 and r + 1 < r1 else 0


@kernel
def move_flows(old, old_stride, old_window, new, new_stride, new_window):
    """Take the flows of one sheet, and what is left to send, over to another."""
    r0, r1 = max(old_window[0], new_window[0]), min(old_window[1], new_window[1])
    c0, c1 = max(old_window[2], new_window[2]), min(old_window[3], new_window[3])
    n = c1 - c0
    for r in range(r0, r1):
        p = (r - old_window[0] + 1) * old_stride + c0 - old_window[2] + 1
        q = (r - new_window[0] + 1) * new_stride + c0 - new_window[2] + 1
        for part in (FLOW_X, FLOW_Y, REST_X, REST_Y):
            new[part, q : q + n] = old[part, p : p + n]


@kernel
def unpack_ground(height, ground, stride, window):
    """Copy the window's ground back onto the map."""
    rows, cols = height.shape
    r0, r1, c0, c1 = max(window[0], 0), min(window[1], rows), max(window[2], 0), min(window[3], cols)
    for r in range(r0, r1):
        p = (r - window[0] + 1) * stride + c0 - window[2] + 1
        height[r, c0:c1] = ground[p : p + c1 - c0]


@kernel
def hold_ring(ground, after, stride, window, rows, cols, a, b):
    """Put the ring beside the sheet's rows [a, b), counted with the ring, where it was before the sweep.

    Beyond the map's edges it lies at the level of the cells next to it.
    """
    r0, r1, c0, c1 = window
    last = c1 - c0
    left, right = 1 if c0 == 0 else 0, last if c1 == cols else last + 1
    before_left, before_right = after if c0 == 0 else ground, after if c1 == cols else ground
    for p in range(a * stride, b * stride, stride):
        after[p] = before_left[p + left]
        after[p + last + 1] = before_right[p + right]
    if a == 1 and r0 == 0:
        after[:stride] = after[stride : 2 * stride]
    if b == r1 - r0 + 1 and r1 == rows:
        after[b * stride : (b + 1) * stride] = after[(b - 1) * stride : b * stride]


@kernel
def drain_rim(outside, before, after, fine, stride, window, rows, cols):
    """Take away what crossed an open border in the last sweep; returns it [m of one cell].

    A cell beyond the border then lies at its own level, or at its neighbour's on the map if that is lower: the ground
    outside takes soil and gives none. `fine`: the ground without rounding, which is put at that level too.
    """
    r0, r1, c0, c1 = window
    gone = 0.0
    for r in range(r0, r1):
        beyond = r < 0 or r >= rows
        for c in range(c0, c1, 1 if beyond else max(c1 - c0 - 1, 1)):
            if beyond == (c < 0 or c >= cols):
                continue  # on the map, or beyond a corner, where there are no links
            p = (r - r0 + 1) * stride + c - c0 + 1
            if beyond:
                neighbour = p + stride if r < 0 else p - stride
            else:
                neighbour = p + 1 if c < 0 else p - 1
            gone += after[p] - before[p]
            level = outside[min(max(r, 0), rows - 1), min(max(c, 0), cols - 1)]
            after[p] = fine[p] = min(level, after[neighbour])
    return gone


@kernel
def reached(height, ground, stride, window, largest, band):
    """Which sides soil has come within `band` cells of, where the window can still grow: a bit each, 1 2 4 8."""
    rows, cols = height.shape
    r0, r1, c0, c1 = window
    sides = 0
    for side in range(4):
        if (r0, -r1, c0, -c1)[side] <= (largest[0], -largest[1], largest[2], -largest[3])[side]:
            continue
        a, b = (r0 if side != 1 else max(r1 - band, r0)), (r1 if side != 0 else min(r0 + band, r1))
        left, right = (c0 if side != 3 else max(c1 - band, c0)), (c1 if side != 2 else min(c0 + band, c1))
        moved = False
        for r in range(max(a, 0), min(b, rows)):
            base = (r - r0 + 1) * stride - c0 + 1
            for c in range(max(left, 0), min(right, cols)):
                moved = moved or ground[base + c] != height[r, c]
            if moved:
                sides += 1 << side
                break
    return sides
