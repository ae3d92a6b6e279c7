"""The blade: a vertical plate that cuts what it crosses, carries it ahead, and closes the links it stands across."""

from math import ceil, floor, inf
from typing import NamedTuple

import numpy as np

from dirt_env.sim.bank import growth
from dirt_env.sim.intrinsics import flat
from dirt_env.sim.jit import kernel
from dirt_env.sim.lanes import LANES, among, choose, doubles, load, none, ramp, some, total
from dirt_env.sim.laws import link_excess, quantise
from dirt_env.sim.window import OPEN_X, OPEN_Y, RATE_Y

DEPOSIT = 0.75  # cells ahead of a crossed cell's centre where its soil is put down
NEAR = 1e-6  # cells, farther than rounding reaches: so close to a cell's centre, a line may be on either side of it
EVERYWHERE = 2**40  # more columns than any map has
KEY, KEYS = 2654435, 2**40  # a list's number is one of so many; links are mixed in by an odd factor
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
def line_of(pose, facing, blade):
    """The blade's Line for a machine's record, see `state.POSE`; `facing` is that of its heading."""
    ahead_x, ahead_y = facing
    return Line(
        pose.x + blade.reach * ahead_x,
        pose.y + blade.reach * ahead_y,
        ahead_x,
        ahead_y,
        0.5 * blade.width,
        pose.z + pose.pitch * blade.reach + pose.edge,
        pose.roll,
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
def held_links(height, line, cell, threshold, settled, links, levels):
    """List the links that the blade closes: those that it stands across, unless its edge is above both cells.

    Row k of `links` is then (row, column, along x) of the link from that cell to the next one, row k of `levels` the
    blade's edge and top there. Its line crosses the centres of each row, and of each column, in one place. Returns how
    many they are, a number that tells one list from another (0 for an empty one), and whether soil would pass.
    """
    rows, cols = height.shape
    per_metre, found = 1.0 / cell, (0, 0, False)
    if line.ahead_x != 0.0:
        first, end = centres(line.y, line.ahead_x, line.half, per_metre)
        per = 1.0 / line.ahead_x
        for r in range(max(first, 0), min(end, rows)):
            u = ((r + 0.5) * cell - line.y) * per
            if not abs(u) <= line.half + NEAR * cell:  # of a line along this row, NEAR is a long way
                continue
            c = before(line, cell, (line.x - u * line.ahead_y) * per_metre - 0.5, line.ahead_x, r, True)
            found = take_link(height, line, r, c, 1, u, threshold, settled, links, levels, found)
    if line.ahead_y != 0.0:
        first, end = centres(line.x, line.ahead_y, line.half, per_metre)
        per = -1.0 / line.ahead_y
        for c in range(max(first, 0), min(end, cols)):
            u = ((c + 0.5) * cell - line.x) * per
            if not abs(u) <= line.half + NEAR * cell:
                continue
            r = before(line, cell, (line.y + u * line.ahead_x) * per_metre - 0.5, line.ahead_y, c, False)
            found = take_link(height, line, r, c, 0, u, threshold, settled, links, levels, found)
    return found


@kernel
def take_link(height, line, r, c, along_x, u, threshold, settled, links, levels, found):
    """`found`, of `held_links`, with the link of cell (r, c), `u` m left of the blade's centre, if closed."""
    count, key, passes = found
    rows, cols = height.shape
    real = height.dtype.type
    next_r, next_c = r + 1 - along_x, c + along_x
    if next_r < 0 or next_c < 0 or r >= rows or c >= cols:
        return found
    a = height[np.uint64(max(r, 0)), np.uint64(max(c, 0))]
    b = height[np.uint64(min(next_r, rows - 1)), np.uint64(min(next_c, cols - 1))]
    edge = line.edge + line.roll * u
    low, top = real(edge), real(edge + line.height)
    links[count, 0], links[count, 1], links[count, 2] = r, c, along_x
    levels[count, 0], levels[count, 1] = low, top
    high = max(a, b)
    if low >= high:
        return found
    passes |= link_excess(high, min(a, b), low, top, threshold) > settled - threshold
    place = 2 * ((r + 1) * (cols + 2) + c + 1) + along_x
    return count + 1, (key * KEY + place) % KEYS, passes


@kernel
def centres(middle, ahead, half, per_metre):
    """(first, end) of the rows, or columns, on whose centres the blade lies, from its middle [m] along them."""
    span = abs(ahead) * half
    return (
        int(ceil((middle - span) * per_metre - 0.5 - NEAR)),
        int(floor((middle + span) * per_metre - 0.5 + NEAR)) + 1,
    )


@kernel
def before(line, cell, place, ahead, other, along_x):
    """The last cell before the blade in row `other` (`along_x`), or column; it crosses that at `place` [cells].

    `ahead`: how much of the blade's normal leads to higher cells. Of a cell whose centre lies on the line, within
    rounding, its distance decides, as in its row so in its column: else soil could go through between the two.
    """
    k = floor(place + 0.5)
    in_front = (k - place) * ahead > 0.0
    if abs(k - place) < NEAR:
        x, y = (k + 0.5) * cell, (other + 0.5) * cell
        in_front = blade_frame(line, x if along_x else y, y if along_x else x)[0] > 0.0
    return int(k) - (1 if in_front == (ahead > 0.0) else 0)


@kernel
def close_links(window, stride, start, stop, buffers, links, levels, count):
    """Close the first `count` links of the list in the packed window.

    Those that are swept, in [start, stop), are listed behind them: row `count` + k of `links` is (place, next place,
    along x). Returns how many they are. A closed link gives nothing to the gradients of its neighbours;
    `slump.link_fluxes` moves soil over and under it.
    """
    r0, r1, c0, c1 = window
    n = count
    for k in range(count):
        r, c, along_x = links[k, 0], links[k, 1], links[k, 2]
        if r < r0 or r >= r1 or c < c0 or c >= c1:
            continue
        p = np.uint64((r - r0 + 1) * stride + c - c0)
        mask = OPEN_X if along_x else OPEN_Y
        is_swept = (buffers[mask, p] != 0) & (start <= p) & (p < stop) & ((along_x == 1) | (buffers[RATE_Y, p] != 0))
        buffers[mask, p] = 0
        links[n, 0], links[n, 1], links[n, 2] = p, p + np.uint64(1 if along_x else stride), along_x
        levels[n, 0], levels[n, 1] = levels[k, 0], levels[k, 1]
        n += is_swept
    return n - count


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
    ground, limit = flat(height), height.dtype.type(level)
    first, end = max(box[2], 0), min(box[3], cols)
    higher = none()
    for r in range(max(box[0], 0), min(box[1], rows)):
        for c in range(first, end, LANES):
            higher |= (load(ground, r * cols + c, end - c) > limit) & among(end - c)
    return some(higher)


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
    ground = flat(height)
    step_ahead, step_left = ramp(0.0, side * cell * line.ahead_x), ramp(0.0, -cell * line.ahead_y)
    standing, touching = ramp(0.0, 0.0), none()
    for r in range(r0, r1):
        for c in range(c0, c1, LANES):
            ahead_0, left_0 = blade_frame(line, (c + 0.5) * cell, (r + 0.5) * cell)
            stands = doubles(load(ground, r * cols + c, c1 - c)) - base
            ahead, left = step_ahead + side * ahead_0, step_left + left_0
            counts = (stands > 0.0) & (ahead > 0.0) & (ahead <= far) & (left <= line.half) & (left >= -line.half)
            counts &= among(c1 - c)
            if solid is not None:
                counts &= load(flat(solid), r * cols + c, c1 - c) < 1
            standing += choose(counts, stands, 0.0)
            touching |= counts & (ahead <= cell)
    return total(standing) * cell * cell, some(touching)
