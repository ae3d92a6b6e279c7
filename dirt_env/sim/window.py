"""The active window: the part of the ground that may move, packed into short one-dimensional buffers.

One sweep is then a handful of loops over contiguous memory, whatever the window's shape. Cell (i, j) of a window with
`stride` columns (one more than it has, the last one closed) lies at p = (i + 1) * stride + j; its right link is x[p],
to p + 1, its upper link y[p], to p + stride. The rows of the buffers are named below.
"""

from dirt_env.sim.jit import kernel
from dirt_env.sim.laws import RATE

GROUND, OPEN_X, OPEN_Y, RATE_X, RATE_Y, DROP_X, DROP_Y, FLUX_X, FLUX_Y = range(9)


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
def window_around(active, margin, rows, cols, border):
    """(r0, r1, c0, c1): `active` grown by `margin`, within the map and its `border` cells of ground outside."""
    return (
        max(active[0] - margin, -border),
        min(active[1] + margin, rows + border),
        max(active[2] - margin, -border),
        min(active[3] + margin, cols + border),
    )


@kernel
def is_open(solid, outside, r, c, rows, cols):
    """Whether soil can lie in cell (r, c): on the map or beyond an open border, and not solid."""
    if outside is None and (r < 0 or c < 0 or r >= rows or c >= cols):
        return False
    if solid is not None and r >= 0 and c >= 0 and r < rows and c < cols:
        return not solid[r, c]
    return True


@kernel
def on_rim(r, c, rows, cols):
    """1 for a cell beyond the border, 0 on the map."""
    return 1 if r < 0 or c < 0 or r >= rows or c >= cols else 0


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
def pack(height, solid, outside, buffers, window, border):
    """Copy the window's heights into the buffers, and find out which links soil can cross and which are swept.

    The links along an outermost row or column lack neighbours and are not swept, unless the map ends there.
    """
    rows, cols = height.shape
    r0, r1, c0, c1 = window
    first_row, last_row = r0 if r0 > -border else r0 - 1, r1 - 1 if r1 < rows + border else r1
    first_col, last_col = c0 if c0 > -border else c0 - 1, c1 - 1 if c1 < cols + border else c1
    wide = c1 - c0
    stride = wide + 1
    end = (r1 - r0 + 2) * stride + 1
    ground, open_x, open_y = buffers[GROUND], buffers[OPEN_X], buffers[OPEN_Y]
    rate_x, rate_y = buffers[RATE_X], buffers[RATE_Y]
    for b in range(buffers.shape[0]):
        line = buffers[b]
        for p in range(end):
            line[p] = 0
    real = height.dtype.type
    yes, rate = real(1.0), real(RATE)
    for r in range(r0, r1):
        base = (r - r0 + 1) * stride - c0
        for c in range(c0, c1):
            if not on_rim(r, c, rows, cols):
                ground[base + c] = height[r, c]
    if outside is not None:
        drain(outside, buffers, stride, window, rows, cols)
    # A link between two cells beyond the border stays closed; so do links to what is solid.
    for r in range(r0, r1):
        base = (r - r0 + 1) * stride - c0
        for c in range(c0, c1):
            if not is_open(solid, outside, r, c, rows, cols):
                continue
            rim = on_rim(r, c, rows, cols)
            if c + 1 < c1 and is_open(solid, outside, r, c + 1, rows, cols):
                if rim + on_rim(r, c + 1, rows, cols) < 2:
                    open_x[base + c] = yes
                    if first_row < r < last_row:
                        rate_x[base + c] = rate
            if r + 1 < r1 and is_open(solid, outside, r + 1, c, rows, cols):
                if rim + on_rim(r + 1, c, rows, cols) < 2:
                    open_y[base + c] = yes
                    if first_col < c < last_col:
                        rate_y[base + c] = rate
    return stride


@kernel
def unpack(height, buffers, stride, window):
    """Copy the window's ground back onto the map."""
    rows, cols = height.shape
    r0, r1, c0, c1 = window
    for r in range(max(r0, 0), min(r1, rows)):
        base = (r - r0 + 1) * stride - c0
        for c in range(max(c0, 0), min(c1, cols)):
            height[r, c] = buffers[GROUND, base + c]


@kernel
def moving_box(buffers, stride, window, box):
    """Write the cells next to a link that moved soil into `box`, as map rows and columns [r0, r1) x [c0, c1)."""
    r0, r1, c0, c1 = window
    top, bottom, left, right = r1, r0 - 1, c1, c0 - 1
    for r in range(r0, r1):
        base = (r - r0 + 1) * stride - c0
        for c in range(c0, c1):
            x, y = buffers[FLUX_X, base + c] != 0, buffers[FLUX_Y, base + c] != 0
            if x or y:
                top, bottom = min(top, r), max(bottom, r + (1 if y else 0))
                left, right = min(left, c), max(right, c + (1 if x else 0))
    box[0], box[1], box[2], box[3] = top, bottom + 1, left, right + 1


@kernel
def touches_ring(buffers, stride, window, limits_):
    """Whether soil moved in one of the outer two rows or columns of a window that does not end there at the map's edge.

    `limits_`: the window's largest extent.
    """
    r0, r1, c0, c1 = window
    flux_x, flux_y = buffers[FLUX_X], buffers[FLUX_Y]
    tall, wide = r1 - r0, c1 - c0
    for side in range(2):
        inner = (r0 > limits_[0]) if side == 0 else (r1 < limits_[1])
        if inner:
            line = (2 if side == 0 else tall - 1) * stride  # the second row from that side
            for p in range(line, line + wide):
                if flux_x[p] != 0 or flux_y[p] != 0 or flux_y[p - stride] != 0:
                    return True
    for side in range(2):
        inner = (c0 > limits_[2]) if side == 0 else (c1 < limits_[3])
        if inner:
            first = stride + (1 if side == 0 else wide - 2)
            for p in range(first, first + tall * stride, stride):
                if flux_y[p] != 0 or flux_x[p] != 0 or flux_x[p - 1] != 0:
                    return True
    return False
