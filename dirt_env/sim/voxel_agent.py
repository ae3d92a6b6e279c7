"""Agent constraints (Section IV): the blade keeps fill out of the cells it occupies, and so moves it.

The blade occupies the cells whose centres it has just passed: the line of cells behind its face, as thick as it takes
to be without gaps for soil that moves along x or z, from the level of its edge to that of its top. Each of them gets a
constraint of full life, again and again while the blade is there; behind the blade constraints last until they expire.

How constraint cells displace the fill they meet: what lies in such a cell between edge and top goes, at once, to the
incoming fill of the cells ahead on the same level, a little before the blade's face, in bilinear shares; where those
have constraints themselves or are shut, farther ahead. The next update accepts it there, sinks it, spreads it or lets
it rise, as any other. What lies below the edge stays (the blade at an edge in mid-cell cuts that cell in two). Where
nothing ahead can take it, it stays in the cell and is counted as stuck. The side is that of the blade's own motion, for
each part of it, so that back-blading works.
"""

from math import ceil, floor, inf

from dirt_env.sim.blade import blade_frame, box_around
from dirt_env.sim.jit import kernel
from dirt_env.sim.laws import quantise
from dirt_env.sim.voxel_state import FOREVER
from dirt_env.sim.window import widen

AHEAD = 0.75  # cells before the face where displaced soil is put down
STRIDE, TRIES = 0.5, 8  # cells farther on that it is tried again, and how often


@kernel
def constrain(life, r, c, m, updates):
    """Give a cell a constraint that blocks that many updates from now on."""
    if life[r, c, m] != FOREVER:
        life[r, c, m] = updates + 1


@kernel
def side_of(line, cell, forward, turn, r, c):
    """1 or -1 if the blade occupies the column (r, c): the side it pushes to there, ahead or behind; else 0."""
    ahead, left = blade_frame(line, (c - 0.5) * cell, (r - 0.5) * cell)
    if abs(left) > line.half:
        return 0
    side = 1 if forward - turn * left >= 0.0 else -1
    thick = cell * max(abs(line.ahead_x), abs(line.ahead_y))
    return side if 0.0 <= -side * ahead < thick else 0


@kernel
def levels_of(line, cell, bottom, dy, levels, r, c):
    """(first, last + 1, edge): the levels of the column (r, c) that the blade reaches, and its edge there in levels."""
    _, left = blade_frame(line, (c - 0.5) * cell, (r - 0.5) * cell)
    edge = (line.edge + line.roll * left - bottom) / dy
    first = min(max(int(floor(edge + 1e-9)), 0), levels)
    last = min(max(int(ceil(edge + line.height / dy - 1e-9)), 0), levels)
    return first + 1, last + 1, edge


@kernel
def share_ahead(life, line, cell, side, from_r, from_c, r, c, m):
    """1 if the cell is before the blade's face and fill of the column (from_r, from_c) may enter it, else 0.

    Beyond the rim it is as on the rim.
    """
    rows, cols, _ = life.shape
    q, p = min(max(r, 0), rows - 1), min(max(c, 0), cols - 1)
    if life[q, p, m] != 0:
        return 0.0
    ahead, _ = blade_frame(line, (c - 0.5) * cell, (r - 0.5) * cell)
    return 1.0 if side * ahead > 0.0 and way_is_open(life, from_r, from_c, q, p, m) else 0.0


@kernel
def way_is_open(life, r, c, q, p, m):
    """Whether no cell that is shut for ever lies on the straight way between two columns on a level.

    Two such cells that touch at a corner are a wall: nothing goes through between them.
    """
    pieces = 2 * max(abs(q - r), abs(p - c))
    at_r, at_c = r, c
    for i in range(1, pieces + 1):
        to_r, to_c = int(floor(r + (q - r) * i / pieces + 0.5)), int(floor(c + (p - c) * i / pieces + 0.5))
        if life[to_r, to_c, m] == FOREVER:
            return False
        if life[at_r, to_c, m] == FOREVER and life[to_r, at_c, m] == FOREVER:
            return False
        at_r, at_c = to_r, to_c
    return True


@kernel
def put_ahead(incoming, life, active, line, cell, side, lock, r, c, m, amount):
    """Send `amount` (share of a cell) of the cell (r, c, m) ahead; whether something there could take it.

    What goes over an open border is gone: the rim gives nothing back.
    """
    rows, cols, _ = incoming.shape
    ahead, _ = blade_frame(line, (c - 0.5) * cell, (r - 0.5) * cell)
    for attempt in range(TRIES):
        way = (AHEAD + STRIDE * attempt) * cell - side * ahead
        x, y = c + side * way * line.ahead_x / cell, r + side * way * line.ahead_y / cell
        column, row = int(floor(x)), int(floor(y))
        fx, fy = x - column, y - row
        total = 0.0
        for i in range(4):
            weight = (fy if i // 2 else 1.0 - fy) * (fx if i % 2 else 1.0 - fx)
            total += weight * share_ahead(life, line, cell, side, r, c, row + i // 2, column + i % 2, m)
        if total < 1e-6:
            continue
        left_over, left_weight = amount, total
        for i in range(4):
            q, p = row + i // 2, column + i % 2
            weight = (fy if i // 2 else 1.0 - fy) * (fx if i % 2 else 1.0 - fx)
            weight *= share_ahead(life, line, cell, side, r, c, q, p, m)
            if weight <= 0.0:
                continue
            left_weight -= weight
            part = left_over if left_weight < 1e-9 else min(quantise(amount * (weight / total), lock), left_over)
            left_over -= part
            if 0 < q < rows - 1 and 0 < p < cols - 1:
                incoming[q, p, m] += part
                widen(active, q, q + 1, p, p + 1)
        return True
    return False


@kernel
def occupy(fill, incoming, life, active, bottom, dy, cell, line, forward, turn, rules, tally):
    """Set the blade's constraints for one substep and displace the fill they meet.

    `forward` m and `turn` rad are what the machine did. Adds to the record `tally` what it cut and
    what is stuck [m of one column].
    """
    rows, cols, high = fill.shape
    b0, b1, b2, b3 = box_around(line, cell)
    r0, r1, c0, c1 = max(b0, 1), min(b1 + 2, rows - 1), max(b2, 1), min(b3 + 2, cols - 1)
    for r in range(r0, r1):
        for c in range(c0, c1):
            if side_of(line, cell, forward, turn, r, c) != 0:
                first, end, _ = levels_of(line, cell, bottom, dy, high - 2, r, c)
                for m in range(first, end):
                    constrain(life, r, c, m, rules.life)
                    widen(active, r, r + 1, c, c + 1)
    lock = 1.5 * 2.0**52 * rules.grain
    for r in range(r0, r1):
        for c in range(c0, c1):
            side = side_of(line, cell, forward, turn, r, c)
            if side == 0:
                continue
            first, end, edge = levels_of(line, cell, bottom, dy, high - 2, r, c)
            for m in range(first, end):
                here = fill[r, c, m] + incoming[r, c, m]
                low, up = max(edge - (m - 1), 0.0), edge + line.height / dy - (m - 1)
                amount = quantise(min(here, up if up < 1.0 else inf) - low, lock)
                if here <= 0.0 or amount <= 0.0:
                    continue
                if put_ahead(incoming, life, active, line, cell, side, lock, r, c, m, amount):
                    fill[r, c, m], incoming[r, c, m] = here - amount, 0.0
                    tally.cut += amount * dy
                else:
                    tally.stuck += amount * dy
