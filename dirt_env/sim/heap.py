"""Soil poured out at a point: h = max(h0, c - k dist) at once, with the level c that gives the volume.

This is the exact pile of a point source on ground no steeper than k (Prigozhin 1996); walls and corners hold it back.
What a cell gets is the average over the cell, of the plane that touches the cone at its centre, or near the tip of 8 x
8 points.
"""

from math import asinh, floor, hypot, pi, sqrt

import numpy as np

from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.laws import quantise
from dirt_env.sim.params import Grid, Soil
from dirt_env.sim.state import World
from dirt_env.sim.window import widen

NEAR = 1.5  # cells from the source within which averages are taken over points
POINTS = 8  # by as many
SLACK = 0.1  # of the drop of a cell's width: how far the level may move before the foot's cells are looked up anew


@kernel
def corner_distance(a, b):
    """Integral of the distance to the origin over [0, a] x [0, b]; odd in a and in b."""
    if a == 0.0 or b == 0.0:
        return 0.0
    p, q = abs(a), abs(b)
    total = p * q * hypot(p, q) / 3.0 + (p**3 * asinh(q / p) + q**3 * asinh(p / q)) / 6.0
    return total if (a > 0) == (b > 0) else -total


@kernel
def mean_distance(dx, dy):
    """Mean distance of the points of a cell from the source, in cells; its centre is (dx, dy) away.

    Exact near the source; farther out by d + 1 / (24 d), the Laplacian of the distance being 1 / d.
    """
    square = dx * dx + dy * dy
    if square >= NEAR * NEAR:
        return sqrt(square + 1.0 / 12.0)
    x0, x1, y0, y1 = dx - 0.5, dx + 0.5, dy - 0.5, dy + 0.5
    return (corner_distance(x1, y1) - corner_distance(x0, y1)) - (corner_distance(x1, y0) - corner_distance(x0, y0))


@kernel
def plane_excess(above, large, small):
    """(mean, share) of max(0, above + large X + small Y) over |X|, |Y| < 1/2: its mean, the part where it is above 0.

    Third and second differences of the powers of what stands above the cell's corners; large >= small > 0.
    """
    sum_, difference = 0.5 * (large + small), 0.5 * (large - small)
    p, q = max(above + sum_, 0.0), max(above + difference, 0.0)
    r, s = max(above - difference, 0.0), max(above - sum_, 0.0)
    area = 2.0 * large * small
    share = ((p * p - q * q) - (r * r - s * s)) / area
    return ((p * p * p - q * q * q) - (r * r * r - s * s * s)) / (3.0 * area), share


@kernel
def tip_excess(tip, dx, dy, drop):
    """(mean, share) of max(0, tip - drop * distance) over the points of a cell near the source."""
    total = 0.0
    count = 0
    for i in range(POINTS):
        y = dy + (i + 0.5) / POINTS - 0.5
        for j in range(POINTS):
            x = dx + (j + 0.5) / POINTS - 0.5
            above = tip - drop * sqrt(x * x + y * y)
            if above > 0.0:
                total += above
                count += 1
    return total / POINTS**2, count / POINTS**2


@kernel
def sees(solid, column, row, c, r):
    """Whether the straight line from the source (column, row) [cells] to cell (r, c) is free; looks every half cell."""
    x, y = c + 0.5, r + 0.5
    steps = int(2 * max(abs(x - column), abs(y - row))) + 1
    for i in range(steps + 1):
        t = i / steps
        a = min(int(row + t * (y - row)), solid.shape[0] - 1)
        b = min(int(column + t * (x - column)), solid.shape[1] - 1)
        if solid[a, b]:
            return False
    return True


@kernel
def fill_levels(height, solid, column, row, drop, window, levels):
    """Level of the source at which each cell of the window begins to fill, h0 + k dist [m]; inf where it cannot."""
    r0, r1, c0, c1 = window
    for r in range(r0, r1):
        dy = r + 0.5 - row
        ground, line = height[r, c0:c1], levels[r - r0]
        first = c0 + 0.5 - column
        rest = dy * dy + 1.0 / 12.0
        for j in range(c1 - c0):
            dx = first + j
            line[j] = ground[j] + drop * sqrt(dx * dx + rest)
        if abs(dy) < NEAR:
            for c in range(max(floor(column - NEAR), c0), min(floor(column + NEAR) + 1, c1)):
                line[c - c0] = ground[c - c0] + drop * mean_distance(c + 0.5 - column, dy)
        if solid is not None:
            for c in range(c0, c1):
                if not sees(solid, column, row, c, r):
                    line[c - c0] = np.inf


@kernel
def sort_line(line, low, high, counts, totals, feet):
    """Add to `counts` and `totals` the cells of a line below `low`, and to `feet` 1 for those up to `high`."""
    for j in range(line.size):
        full = line[j] < low
        counts[j] += 1.0 if full else 0.0
        totals[j] += line[j] if full else 0.0
        feet[j] = 1.0 if line[j] < high and not full else 0.0


@kernel
def sort_out(levels, level, reach, foot, lines):
    """Which cells are full at any level close to this one, and which are at the foot.

    The latter's places go into `foot`. Returns (full ones, sum of their levels, the foot's cells).
    """
    lines[:] = 0.0
    wide = levels.shape[1]
    edge = 0
    for i in range(levels.shape[0]):
        feet = lines[2]
        sort_line(levels[i], level - reach, level + reach, lines[0], lines[1], feet)
        found = int(feet.sum())
        # They lie at the two ends of a line, as a rule: look from both sides until all are found.
        left, right = 0, wide - 1
        while found > 0:
            for j in (left, right):
                if feet[j] > 0.0 and found > 0:
                    foot[edge, 0], foot[edge, 1] = i, j
                    feet[j] = 0.0
                    edge += 1
                    found -= 1
            left += 1
            right -= 1
    return lines[0].sum(), lines[1].sum(), edge


@kernel
def foot_slopes(foot, edge, column, row, drop, window, levels, cells):
    """Write (level, larger, smaller component of the cone's gradient) [m] of the foot's cells into `cells` f8[3, n].

    Cells near the source come first; returns how many they are.
    """
    near = 0
    for k in range(edge):
        i, j = foot[k, 0], foot[k, 1]
        dx, dy = abs(j + window[2] + 0.5 - column), abs(i + window[0] + 0.5 - row)
        distance = sqrt(dx * dx + dy * dy)
        if distance < NEAR:
            foot[k, 0], foot[k, 1] = foot[near, 0], foot[near, 1]
            foot[near, 0], foot[near, 1] = i, j
            cells[0, k], cells[1, k], cells[2, k] = cells[0, near], cells[1, near], cells[2, near]
            k = near
            near += 1
        scale = drop / distance if distance > 0.0 else drop
        large = max(max(dx, dy) * scale, 1e-9 * drop)
        cells[0, k], cells[1, k] = levels[i, j], large
        cells[2, k] = max(min(dx, dy) * scale, 1e-3 * large)  # level across: the error is of the order of 1e-7
    return near


@kernel
def foot_excess(level, cells, foot, near, edge, column, row, drop, window, means, shares):
    """What the foot's cells get at that level, and the parts of them that soil covers."""
    base, large, small = cells[0], cells[1], cells[2]
    for k in range(edge):
        means[k], shares[k] = plane_excess(level - base[k], large[k], small[k])
    for k in range(near):
        dx, dy = foot[k, 1] + window[2] + 0.5 - column, foot[k, 0] + window[0] + 0.5 - row
        tip = level - base[k] + drop * mean_distance(dx, dy)
        means[k], shares[k] = tip_excess(tip, dx, dy, drop)


@kernel
def level_for(levels, column, row, drop, window, wanted, guess, foot, cells):
    """(level, cells at the foot): where the window holds `wanted` [m of one cell]; Newton on a convex function.

    What each of the foot's cells gets is then in `cells[3]`.
    """
    lines = np.empty((3, levels.shape[1]))
    slack = SLACK * drop + 1e-12 * abs(guess)
    reach = 0.75 * drop + slack  # half a cell's diagonal, and a little more near the tip
    level, middle = guess, np.inf
    full = total = 0.0
    edge = near = 0
    means, shares = cells[3], cells[4]
    for _ in range(100):
        if abs(level - middle) > slack:
            middle = level
            full, total, edge = sort_out(levels, level, reach, foot, lines)
            if drop > 0.0:
                near = foot_slopes(foot, edge, column, row, drop, window, levels, cells)
            else:
                edge = 0
        foot_excess(level, cells, foot, near, edge, column, row, drop, window, means, shares)
        short = wanted - (full * level - total) - means[:edge].sum()
        if abs(short) <= 1e-13 * wanted:
            break
        slope = full + shares[:edge].sum()
        level = level + short / slope if slope > 1e-9 else lowest(levels) + drop + wanted
    return level, edge


@kernel
def lowest(levels):
    """The smallest entry."""
    least = np.inf
    for i in range(levels.shape[0]):
        for j in range(levels.shape[1]):
            least = min(least, levels[i, j])
    return least


@kernel
def window_for(column, row, radius, rows, cols):
    """(r0, r1, c0, c1): the cells up to `radius` cells from the source and a few more, cut to the map."""
    r0, r1 = max(floor(max(row - radius, 0.0)) - 2, 0), min(floor(min(row + radius, float(rows))) + 3, rows)
    c0, c1 = max(floor(max(column - radius, 0.0)) - 2, 0), min(floor(min(column + radius, float(cols))) + 3, cols)
    return r0, r1, c0, c1


@kernel
def leaves(levels, level, window, rows, cols):
    """Whether soil gets to a side of the window beyond which the map goes on."""
    r0, r1, c0, c1 = window
    tall, wide = r1 - r0, c1 - c0
    found = False
    for j in range(wide):
        found = found or (r0 > 0 and levels[0, j] < level) or (r1 < rows and levels[tall - 1, j] < level)
    for i in range(tall):
        found = found or (c0 > 0 and levels[i, 0] < level) or (c1 < cols and levels[i, wide - 1] < level)
    return found


@kernel
def pile(height, solid, column, row, drop, wanted):
    """(window, gains): what each cell of a window gets [m] of `wanted` [m of one cell] poured out at (column, row).

    Everything is NaN where the source sees no cell that soil can lie in.
    """
    rows, cols = height.shape
    # The radius of a free cone, V = pi k r^3 / 3, and then that of the part of one that walls leave room for.
    radius = (3.0 * wanted / (pi * drop)) ** (1.0 / 3.0) if drop > 0.0 else float(rows + cols)
    share = 1.0
    for at, length in ((column, cols), (row, rows)):
        share *= min(max((min(at, radius) + min(length - at, radius)) / (2.0 * radius), 0.5), 1.0)
    radius = min(radius / share ** (1.0 / 3.0), float(rows + cols))
    source = height[min(int(row), rows - 1), min(int(column), cols - 1)]
    while True:
        window = window_for(column, row, radius, rows, cols)
        tall, wide = window[1] - window[0], window[3] - window[2]
        levels = np.empty((tall, wide))
        foot = np.empty((tall * wide, 2), np.int32)
        fill_levels(height, solid, column, row, drop, window, levels)
        if solid is not None and not np.isfinite(lowest(levels)):
            levels[:] = np.nan
            return window, levels, 0.0, foot
        cells = np.empty((5, tall * wide))
        guess = source + (drop * radius if drop > 0.0 else 0.0)
        level, edge = level_for(levels, column, row, drop, window, wanted, guess, foot, cells)
        if not leaves(levels, level + 0.75 * drop, window, rows, cols):
            break
        radius *= 1.5
    for i in range(tall):
        fill_line(levels[i], level)
    for k in range(edge):
        levels[foot[k, 0], foot[k, 1]] = cells[3, k]
    return window, levels, level, foot[:edge]


@kernel
def fill_line(line, level):
    """Turn levels into what each cell gets [m]."""
    for j in range(line.size):
        line[j] = max(level - line[j], 0.0)


@kernel
def round_line(line, scale, lock, total):
    """Round a line to whole numbers of quanta; adds them up in `total`."""
    for j in range(line.size):
        whole = quantise(line[j] * scale, lock)
        line[j] = whole
        total[j] += whole


@kernel
def add_line(ground, line, quantum):
    """ground += line, in quanta."""
    for j in range(line.size):
        ground[j] += line[j] * quantum


@kernel
def round_exactly(gains, quantum, total, foot):
    """Turn gains [m] into whole numbers of quanta that add up to `total`, in place.

    What rounding leaves over goes to the cells of the foot, those with the largest remainders first, so that symmetric
    piles stay so where they can; to all cells in turn if there are more.
    """
    scale, lock = 1.0 / quantum, 1.5 * 2.0**52
    edge = foot.shape[0]
    remainders = np.empty(edge)
    for k in range(edge):
        parts = gains[foot[k, 0], foot[k, 1]] * scale
        remainders[k] = parts - quantise(parts, lock)
    sums = np.zeros(gains.shape[1])
    for i in range(gains.shape[0]):
        round_line(gains[i], scale, lock, sums)
    left = total - int(sums.sum())
    one = 1.0 if left > 0 else -1.0
    order = np.argsort(-one * remainders)
    for k in order[: min(abs(left), edge)]:
        if gains[foot[k, 0], foot[k, 1]] + one >= 0.0:
            gains[foot[k, 0], foot[k, 1]] += one
            left -= int(one)
    while left != 0:
        for i in range(gains.shape[0]):
            for j in range(gains.shape[1]):
                if left != 0 and gains[i, j] > 0.0:
                    gains[i, j] += one
                    left -= int(one)


@entry
def pour(height, solid, changed, quantum, cell, slope, x, y, volume):
    """`dump` on the arrays of a world; returns by how much the pile would be too high [m], or NaN on solid ground."""
    window, gains, level, foot = pile(height, solid, x / cell, y / cell, slope * cell, volume / cell**2)
    if np.isnan(gains[0, 0]):
        return np.nan
    reach = 2.0 ** (24 if height.itemsize == 4 else 53) * quantum
    if level > reach:
        return level - reach
    round_exactly(gains, quantum, int(round(volume / cell**2 / quantum)), foot)
    r0, r1, c0, c1 = window
    for i in range(r1 - r0):
        add_line(height[r0 + i, c0:c1], gains[i], quantum)
    widen(changed, r0, r1, c0, c1)
    return 0.0


def dump(world: World, grid: Grid, soil: Soil, x: float, y: float, volume: float) -> float:
    """Pour `volume` m3 out at (x, y) m, in place; returns the volume poured, rounded to what one cell can take.

    Where the ground around is steeper than repose, settle it afterwards. Solid cells and what they hide from the source
    take none. Raises ValueError for a source off the site or on something solid, for a volume that is negative or not
    finite, and where the pile would be too high to be exact.
    """
    wide, deep = grid.cols * grid.cell, grid.rows * grid.cell
    if not (0.0 <= x <= wide and 0.0 <= y <= deep):
        raise ValueError(f"a heap at x {x:g} m, y {y:g} m; allowed: 0..{wide:g} m x 0..{deep:g} m")
    if not 0.0 <= volume < np.inf:
        raise ValueError(f"volume is {volume:g} m3; allowed: 0 or more")
    least = world.quantum * grid.cell**2
    if volume < 0.5 * least:
        return 0.0
    over = pour(
        world.height,
        world.solid,
        world.changed,
        world.quantum,
        grid.cell,
        soil.slope,
        float(x),
        float(y),
        float(volume),
    )
    if np.isnan(over):
        raise ValueError(f"a heap at x {x:g} m, y {y:g} m stands on a solid cell; allowed: open ground")
    if over > 0:
        raise ValueError(f"a heap of {volume:g} m3 would be {over:g} m higher than heights are exact to")
    world.machine[0].closed = -1.0  # the blade stands against other ground now
    return round(volume / least) * least
