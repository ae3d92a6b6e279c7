"""The blade: a vertical plate that cuts what it crosses, carries it ahead, and closes the links it stands across."""

from math import ceil, cos, floor, inf, sin
from typing import NamedTuple

import numpy as np

from dirt_env.sim.bank import growth
from dirt_env.sim.jit import kernel
from dirt_env.sim.laws import quantise
from dirt_env.sim.window import OPEN_X, OPEN_Y, RATE_Y

DEPOSIT = 0.75  # cells ahead of a crossed cell's centre where its soil is put down
NEAR = 1e-6  # cells, farther than rounding reaches: so close to a cell's centre, a line may be on either side of it
EVERYWHERE = 2**40  # more columns than any map has
EXACT = 1.3  # heights up to this many rounding constants are exact; the limit is 4/3


class Line(NamedTuple):
    """The blade as a segment on the map: centre, unit normal (the heading), half its width, edge level, tilt, height.

    The edge lies at `edge` + `roll` * u metres, u metres to the left of the centre; the top is `height` above it.
    """

    x: float
    y: float
    ahead_x: float
    ahead_y: float
    half: float
    edge: float
    roll: float
    height: float


@kernel
def line_of(x, y, heading, z, pitch, roll, edge, blade):
    """The blade's Line for a machine's pose; see `state.POSE`."""
    ahead_x, ahead_y = cos(heading), sin(heading)
    return Line(
        x + blade.reach * ahead_x,
        y + blade.reach * ahead_y,
        ahead_x,
        ahead_y,
        0.5 * blade.width,
        z + pitch * blade.reach + edge,
        roll,
        blade.height,
    )


@kernel
def blade_frame(line, x, y):
    """(ahead, left): metres in front of the blade and to the left of its centre."""
    dx, dy = x - line.x, y - line.y
    return dx * line.ahead_x + dy * line.ahead_y, dy * line.ahead_x - dx * line.ahead_y


@kernel
def crossing(ahead_0, left_0, ahead_1, left_1):
    """Where the segment between two points meets the blade's line, metres left of its centre; nowhere, or anywhere, if
    they do not lie on two sides of it.
    """
    apart = ahead_0 - ahead_1
    return left_0 + (left_1 - left_0) * ahead_0 / apart if apart != 0.0 else inf


@kernel
def box_around(line, cell):
    """(r0, r1, c0, c1): the cells whose links the blade can cross, beyond the map too."""
    span_x, span_y = abs(line.ahead_y) * line.half, abs(line.ahead_x) * line.half
    return (
        int((line.y - span_y) // cell) - 1,
        int((line.y + span_y) // cell) + 2,
        int((line.x - span_x) // cell) - 1,
        int((line.x + span_x) // cell) + 2,
    )


@kernel
def cells_between(old, new, cell):
    """(r0, r1, c0, c1): the cells next to links that the blade crosses at `old` or `new`, and all it passes between.

    Those whose centres lie on the way, and one more on every side unless it is a whole cell off; beyond the map too.
    """
    old_x, old_y = abs(old.ahead_y) * old.half, abs(old.ahead_x) * old.half
    new_x, new_y = abs(new.ahead_y) * new.half, abs(new.ahead_x) * new.half
    return (
        int(floor(min(old.y - old_y, new.y - new_y) / cell - 0.5 - NEAR)),
        int(floor(max(old.y + old_y, new.y + new_y) / cell - 0.5 + NEAR)) + 2,
        int(floor(min(old.x - old_x, new.x - new_x) / cell - 0.5 - NEAR)),
        int(floor(max(old.x + old_x, new.x + new_x) / cell - 0.5 + NEAR)) + 2,
    )


@kernel
def course(line, cell):
    """(column, slope): the blade's endless line is at `column` + `slope` * r on the centre of row r, in cells from the
    centre of cell (0, 0). Of no use for a line along the rows, see `is_along_rows`.
    """
    slope = -line.ahead_y / line.ahead_x if line.ahead_x != 0.0 else 0.0
    return (line.x - slope * line.y) / cell - 0.5 + 0.5 * slope, slope


@kernel
def is_along_rows(old, new):
    """Whether one of two lines lies along the rows, or nearly so, or a turn from one to the other goes past them."""
    return min(old.ahead_x * new.ahead_x, abs(old.ahead_x), abs(new.ahead_x)) < 0.01


@kernel
def columns_between(old, new, along_rows, r):
    """(first, end) of the columns of row r whose cell centres lie between two courses, or so close to one (NEAR) that
    rounding decides; all of them where courses are `along_rows`.
    """
    if along_rows:
        return -EVERYWHERE, EVERYWHERE
    old_column, new_column = old[0] + old[1] * r, new[0] + new[1] * r
    return int(ceil(min(old_column, new_column) - NEAR)), int(floor(max(old_column, new_column) + NEAR)) + 1


@kernel
def blocked_links(line, cell, window, stride, start, stop, buffers, links, levels):
    """Close the packed window's links that cross the blade; lists each with the edge and top there. Returns how many.

    A closed link gives nothing to the gradients of its neighbours; `slump.link_fluxes` moves soil over and under it,
    if it is one of those that are swept, in [start, stop).
    """
    r0, r1, c0, c1 = window
    b0, b1, b2, b3 = cells_between(line, line, cell)
    left, right = max(c0, b2), min(c1, b3)
    way, along_rows = course(line, cell), is_along_rows(line, line)
    first, end = columns_between(way, way, along_rows, max(r0, b0))
    count = 0
    for r in range(max(r0, b0), min(r1, b1)):
        base = (r - r0 + 1) * stride - c0
        first_above, end_above = columns_between(way, way, along_rows, r + 1)
        for along_x in range(2):
            low, high = (first - 1, end) if along_x else (min(first, first_above), max(end, end_above))
            for c in range(max(left, low), min(right, high)):
                p, step = np.uint64(base + c), np.uint64(1 if along_x else stride)
                count += close_link(line, cell, start, stop, buffers, links, levels, count, r, c, along_x, p, step)
        first, end = first_above, end_above
    return count


@kernel
def close_link(line, cell, start, stop, buffers, links, levels, count, r, c, along_x, p, step):
    """Close the link of cell (r, c), at place p, to the next cell `along_x` or not, if it crosses the blade. Returns 1
    if it is swept: then it is entry number `count` of the list, else what is written there is to be written over.
    """
    real = levels.dtype.type
    mask = OPEN_X if along_x else OPEN_Y
    ahead, left = blade_frame(line, (c + 0.5) * cell, (r + 0.5) * cell)
    ahead_q, left_q = blade_frame(line, (c + along_x + 0.5) * cell, (r - along_x + 1.5) * cell)
    u = crossing(ahead, left, ahead_q, left_q)
    crosses = ((ahead > 0) != (ahead_q > 0)) & (abs(u) <= line.half) & (buffers[mask, p] != 0)
    buffers[mask, p] = 0 if crosses else buffers[mask, p]
    links[count, 0], links[count, 1], links[count, 2] = p, p + step, along_x
    levels[count, 0] = real(line.edge + line.roll * u)
    levels[count, 1] = real(line.edge + line.roll * u + line.height)
    return crosses & (start <= p) & (p < stop) & ((along_x == 1) | (buffers[RATE_Y, p] != 0))


@kernel
def is_shut(solid, r, c):
    """Whether cell (r, c) is solid; ground beyond the map is not."""
    return r >= 0 and c >= 0 and r < solid.shape[0] and c < solid.shape[1] and solid[r, c]


@kernel
def front_share(height, solid, outside, line, cell, side, from_r, from_c, r, c, highest_allowed):
    """1 if cell (r, c) can take soil of cell (from_r, from_c) on that `side` of the blade (1 ahead, -1 behind), else 0.

    One that is higher than `highest_allowed` [m] cannot: volumes would no longer be exact. Nor can one across a corner
    between two solid cells: that is a wall.
    """
    rows, cols = height.shape
    beyond = r < 0 or c < 0 or r >= rows or c >= cols
    if beyond:
        if outside is None:
            return 0.0
    elif height[r, c] > highest_allowed or (solid is not None and solid[r, c]):
        return 0.0
    if solid is not None and r != from_r and c != from_c:
        if is_shut(solid, from_r, c) and is_shut(solid, r, from_c):
            return 0.0
    ahead, _ = blade_frame(line, (c + 0.5) * cell, (r + 0.5) * cell)
    return 1.0 if (ahead > 0) == (side > 0) else 0.0


@kernel
def deposit(height, solid, outside, line, cell, lock, side, r, c, amount):
    """Put `amount` [m] of cell (r, c) down a little further on, bilinear over the cells on that side; the last takes
    the rest. Returns what fell over an open border [m], or -1 if there is no cell to take it and nothing was done.
    """
    rows, cols = height.shape
    real = height.dtype.type
    x = c + side * DEPOSIT * line.ahead_x
    y = r + side * DEPOSIT * line.ahead_y
    column, row = int(x // 1), int(y // 1)
    fx, fy = x - column, y - row
    total = 0.0
    room = EXACT * lock - amount
    for i in range(2):
        for j in range(2):
            weight = (fy if i else 1 - fy) * (fx if j else 1 - fx)
            total += weight * front_share(height, solid, outside, line, cell, side, r, c, row + i, column + j, room)
    if total < 1e-6:
        return real(-1.0)
    left_over = amount
    left_weight = total
    gone = real(0.0)
    for i in range(2):
        for j in range(2):
            weight = (fy if i else 1 - fy) * (fx if j else 1 - fx)
            weight *= front_share(height, solid, outside, line, cell, side, r, c, row + i, column + j, room)
            if weight <= 0.0:
                continue
            left_weight -= weight
            part = left_over if left_weight < 1e-9 else quantise(real(amount * (weight / total)), lock)
            part = min(part, left_over)
            left_over -= part
            if row + i < 0 or column + j < 0 or row + i >= rows or column + j >= cols:
                gone += part
            else:
                height[row + i, column + j] += part
    return gone


@kernel
def scrape(height, solid, outside, old, new, cell, lock, tally, bank=None):
    """Cut and carry: every cell whose centre the blade crosses on its way from `old` to `new` gives min(h, top) - edge.

    The soil goes to the side the blade moves to, so that back-blading works. Adds to the record `tally` what it cuts,
    what is lost over an open border, and what is stuck because nothing could take it [m of one cell]. Bank soil has
    swollen when it is put down. Returns whether any moved.
    """
    rows, cols = height.shape
    moved = False
    real = height.dtype.type
    r0, r1, c0, c1 = cells_between(old, new, cell)
    way, new_way, along_rows = course(old, cell), course(new, cell), is_along_rows(old, new)
    for r in range(max(r0, 0), min(r1, rows)):
        first, end = columns_between(way, new_way, along_rows, r)
        for c in range(max(c0, first, 0), min(c1, end, cols)):
            x, y = (c + 0.5) * cell, (r + 0.5) * cell
            ahead_0, left_0 = blade_frame(old, x, y)
            ahead_1, left_1 = blade_frame(new, x, y)
            u = crossing(ahead_0, left_0, ahead_1, left_1)
            is_crossed = ((ahead_0 > 0) != (ahead_1 > 0)) & (abs(u) <= new.half)  # one jump instead of two
            if not is_crossed or (solid is not None and solid[r, c]):
                continue
            edge = new.edge + new.roll * u
            amount = quantise(real(min(float(height[r, c]), edge + new.height) - edge), lock)
            if amount <= 0 or edge < -EXACT * lock:
                continue
            side = 1 if ahead_0 > 0 else -1
            more = real(0.0)
            if bank is not None:
                more = growth(bank, r, c, height[r, c] - amount, lock)
            gone = deposit(height, solid, outside, new, cell, lock, side, r, c, amount + more)
            if gone < 0:
                tally.stuck += amount
                continue
            height[r, c] -= amount
            if bank is not None:
                bank.now[r, c] = min(bank.now[r, c], height[r, c])
            tally.cut += amount
            tally.lost += gone
            moved = True
    return moved


@kernel
def stands_above(height, box, level):
    """Whether a cell of `box` is higher than a level [m]."""
    rows, cols = height.shape
    count = 0
    for r in range(max(box[0], 0), min(box[1], rows)):
        for c in range(max(box[2], 0), min(box[3], cols)):
            count += float(height[np.uint64(r), np.uint64(c)]) > level
    return count > 0


@kernel
def load_ahead(height, solid, line, cell, slope, plane, side):
    """(soil [m3] on one `side` of the blade, 1 ahead or -1 behind; whether it reaches up to the blade).

    It is what stands above the edge and the `plane` of the tracks, within the blade's width and as far as a heap as
    high as the blade would reach at repose.
    """
    rows, cols = height.shape
    far = line.height / max(slope, 0.2)
    base = max(line.edge, plane)
    x, y = line.x + 0.5 * side * far * line.ahead_x, line.y + 0.5 * side * far * line.ahead_y
    span_x = abs(line.ahead_y) * line.half + 0.5 * far * abs(line.ahead_x)
    span_y = abs(line.ahead_x) * line.half + 0.5 * far * abs(line.ahead_y)
    r0, r1 = max(int(floor((y - span_y) / cell)), 0), min(int(floor((y + span_y) / cell)) + 1, rows)
    c0, c1 = max(int(floor((x - span_x) / cell)), 0), min(int(floor((x + span_x) / cell)) + 1, cols)
    total = 0.0
    touching = 0
    for r in range(r0, r1):
        for c in range(c0, c1):
            stands = float(height[np.uint64(r), np.uint64(c)]) - base
            ahead, left = blade_frame(line, (c + 0.5) * cell, (r + 0.5) * cell)
            ahead *= side
            counts = (stands > 0) & (ahead > 0) & (ahead <= far) & (abs(left) <= line.half)
            if solid is not None:
                counts &= not solid[r, c]
            total += stands if counts else 0.0
            touching += counts & (ahead <= cell)
    return total * cell * cell, touching > 0
