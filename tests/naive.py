"""Slow, obvious twins of the kernels: the whole map at once, no windows, no packing, one plain loop per thought.

The arithmetic is written in the same order as in the kernels, so that tests can ask for equality to the last bit.
"""

from math import cos, floor, sin

import numpy as np

RATE = 0.24


def thresholds(dtype, quantum, cell, soil, slopes=None):
    """(T, settled, lock) as in `slump.limits`; with slopes[rows, cols] the first two of right and upper links."""
    if slopes is not None:
        each = [thresholds(dtype, quantum, cell, soil._replace(slope=slope)) for slope in slopes.ravel()]
        low, calm = (np.reshape([row[k] for row in each], slopes.shape) for k in (0, 1))
        pairs = [(np.minimum(m[:, :-1], m[:, 1:]), np.minimum(m[:-1], m[1:])) for m in (low, calm)]
        return *pairs, each[0][2]
    slack = max(soil.tolerance * max(soil.slope, 0.01) * cell, 4 * quantum)
    lock = 1.5 * 2.0 ** (23 if dtype == np.float32 else 52) * quantum
    return dtype(soil.slope * cell), dtype(soil.slope * cell + slack), dtype(lock)


def settle(height, quantum, cell, soil, solid=None, outside=None, line=None, slopes=None):
    """Sweep the whole map until nothing moves. Returns (height, sweeps, height lost over the open border)."""
    h = np.array(height)
    rim = None
    if outside is not None:
        h = np.pad(h, 1)
        rim = np.pad(np.zeros(np.shape(height), bool), 1, constant_values=True)
        ground_outside = np.pad(np.asarray(outside), 1, mode="edge")
        solid = np.pad(solid, 1) if solid is not None else None
    if slopes is not None and rim is not None:
        slopes = np.pad(slopes, 1, mode="edge")
    shift = 0 if rim is None else 1
    crossed = [] if line is None else held_links(np.pad(height, shift, mode="edge"), cell, line, shift)
    lost = 0.0
    sweeps = 0
    while True:
        if rim is not None:  # the ground outside takes soil and gives none
            h[rim] = np.minimum(ground_outside, np.pad(h[1:-1, 1:-1], 1, mode="edge"))[rim]
        new, moved = sweep(h, quantum, cell, soil, solid, rim, crossed, slopes)
        sweeps += 1
        if rim is not None:
            lost += float(np.sum(new[rim].astype(np.float64) - h[rim]))
        h = new
        if not moved or sweeps >= soil.max_sweeps:
            return (h if rim is None else h[1:-1, 1:-1]), sweeps, lost


def sweep(h, quantum, cell, soil, solid, rim, crossed=(), slopes=None):
    """One explicit step of the whole map; returns the new heights and whether anything moved."""
    dtype = h.dtype.type
    threshold, settled, lock = thresholds(dtype, quantum, cell, soil, slopes)
    (t_x, t_y), (s_x, s_y) = (pair if slopes is not None else (pair, pair) for pair in (threshold, settled))
    open_x = np.ones((h.shape[0], h.shape[1] - 1), bool)
    open_y = np.ones((h.shape[0] - 1, h.shape[1]), bool)
    for mask, both in ((solid, False), (rim, True)):
        if mask is not None:
            pair_x, pair_y = (mask[:, :-1], mask[:, 1:]), (mask[:-1], mask[1:])
            open_x &= ~(pair_x[0] & pair_x[1] if both else pair_x[0] | pair_x[1])
            open_y &= ~(pair_y[0] & pair_y[1] if both else pair_y[0] | pair_y[1])
    blocked = [link for link in crossed if (open_x if link[0] else open_y)[link[1], link[2]]]
    for along_x, r, c, _, _ in blocked:
        (open_x if along_x else open_y)[r, c] = False
    # Differences, padded by closed links all round, so that every link has four across.
    x = np.pad(np.where(open_x, h[:, 1:] - h[:, :-1], dtype(0)), 1)
    y = np.pad(np.where(open_y, h[1:] - h[:-1], dtype(0)), 1)
    up, down = y[1:, 1:-1], y[:-1, 1:-1]
    across_x = dtype(0.25) * ((up[:, :-1] + up[:, 1:]) + (down[:, :-1] + down[:, 1:]))
    right, left = x[1:-1, 1:], x[1:-1, :-1]
    across_y = dtype(0.25) * ((right[:-1] + right[1:]) + (left[:-1] + left[1:]))
    flux_x = _flux(x[1:-1, 1:-1], across_x, t_x, s_x, lock)
    flux_y = _flux(y[1:-1, 1:-1], across_y, t_y, s_y, lock)
    for along_x, r, c, edge, top in blocked:
        a, b = h[r, c], h[r, c + 1] if along_x else h[r + 1, c]
        limits = (t_x, s_x) if along_x else (t_y, s_y)
        low, calm = limits if slopes is None else (limit[r, c] for limit in limits)
        flow = _link_flux(max(a, b), min(a, b), dtype(edge), dtype(top), low, calm, lock)
        (flux_x if along_x else flux_y)[r, c] = flow if b > a else -flow
    fx, fy = np.pad(flux_x, ((0, 0), (1, 1))), np.pad(flux_y, ((1, 1), (0, 0)))
    new = h + ((fx[:, 1:] - fx[:, :-1]) + (fy[1:] - fy[:-1]))
    return new, bool(np.any(flux_x) or np.any(flux_y))


def _flux(drop, across, threshold, settled, lock):
    steep = drop * drop + across * across
    calm = threshold * threshold
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(steep > settled * settled, (steep - calm) / steep, drop.dtype.type(0))
    return (drop.dtype.type(RATE) * drop * share + lock) - lock


def _link_flux(high, low, edge, top, threshold, settled, lock):
    excess = max(high - max(low, top), min(high, edge) - low) - threshold
    return (type(high)(RATE) * excess + lock) - lock if excess > settled - threshold else type(high)(0)


def frame(line, x, y):
    """(ahead, left) of a point in the blade's frame [m]."""
    dx, dy = x - line.x, y - line.y
    return dx * line.ahead_x + dy * line.ahead_y, dy * line.ahead_x - dx * line.ahead_y


def blocked_links(shape, cell, line, shift=0):
    """Every link of the map that crosses the blade: (along x, row, column, edge there, top there)."""
    for r in range(shape[0]):
        for c in range(shape[1]):
            for along_x, r2, c2 in ((1, r, c + 1), (0, r + 1, c)):
                if r2 >= shape[0] or c2 >= shape[1]:
                    continue
                a, u = frame(line, (c - shift + 0.5) * cell, (r - shift + 0.5) * cell)
                a2, u2 = frame(line, (c2 - shift + 0.5) * cell, (r2 - shift + 0.5) * cell)
                if (a > 0) == (a2 > 0):
                    continue
                u += (u2 - u) * a / (a - a2)
                if abs(u) <= line.half:
                    edge = line.edge + line.roll * u
                    yield along_x, r, c, edge, edge + line.height


def held_links(h, cell, line, shift=0):
    """Those that the blade closes: not where it hangs above both cells."""
    found = []
    for along_x, r, c, edge, top in blocked_links(h.shape, cell, line, shift):
        if h.dtype.type(edge) < max(h[r, c], h[r, c + 1] if along_x else h[r + 1, c]):
            found.append((along_x, r, c, edge, top))
    return found


def ground_behind(height, cell, x, y, facing, limit):
    """Ground at a point, of the cells around it only those whose centres lie no farther along `facing` than `limit`."""
    rows, cols = height.shape
    column, row = np.clip(x / cell - 0.5, 0, cols - 1), np.clip(y / cell - 0.5, 0, rows - 1)
    c, r = int(column), int(row)
    total = weights = 0.0
    for i in range(2):
        for j in range(2):
            weight = abs(1 - i - (row - r)) * abs(1 - j - (column - c))
            is_behind = (c + j + 0.5) * cell * facing[0] + (r + i + 0.5) * cell * facing[1] <= limit
            if is_behind and weight > 0.0:
                total, weights = total + weight * height[r + i, c + j], weights + weight
    return total / weights if weights > 1e-9 else height[r, c]


def track_plane(sample, x, y, heading, machine, stations=5):
    """(z, pitch, roll) by numpy's least squares through samples of the ground under the tracks."""
    rows = []
    heights = []
    for s in np.linspace(-0.5, 0.5, stations) * machine.length:
        for u in np.array([-0.5, 0.0, 0.5]) * machine.width:
            rows.append((1.0, s, u))
            heights.append(sample(x + s * cos(heading) - u * sin(heading), y + s * sin(heading) + u * cos(heading)))
    return np.linalg.lstsq(np.array(rows), np.array(heights), rcond=None)[0]


def todo(place, height, goal_depth, limit):
    """What is to do in every cell [m], from the masks of a layout."""
    solid = np.zeros(height.shape, bool) if place.solid is None else place.solid
    design = np.zeros(height.shape, bool) if place.design is None else place.design & ~solid
    off = height.astype(np.float32) - aim(place).astype(np.float32)
    result = np.where(design, np.clip(off, -limit, limit), np.clip(off, 0, limit))
    result[solid] = 0
    result[place.goal & ~solid] = -goal_depth
    return result


def aim(place):
    """The target where there is a design, else the ground that was there under the soil."""
    ground = place.height.astype(np.float32)
    solid = np.zeros(ground.shape, bool) if place.solid is None else place.solid
    design = np.zeros(ground.shape, bool) if place.design is None else place.design & ~solid
    return np.where(design, place.target, ground - (place.height - place.target))


def patch(place, height, cell, size, ahead, resolution, pose, goal_depth, limit, beyond):
    """The channels of the patch by name, pixel by pixel: each shows the cell its centre lies in."""
    x, y, heading, z = pose
    step = resolution / cell
    east, north = cos(heading) * step, sin(heading) * step
    front, left = ahead * size - 0.5, 0.5 * size - 0.5
    found = {
        name: np.full((size, size), end, np.float32) for name, end in (("height", beyond), ("todo", 0), ("walls", 1))
    }
    height = height.astype(np.float32)
    to_do = todo(place, height, goal_depth, limit)
    for i in range(size):
        for j in range(size):
            column = x / cell + (front - i) * east - left * north + j * north
            row = y / cell + (front - i) * north + left * east - j * east
            r, c = floor(row), floor(column)
            if 0 <= r < height.shape[0] and 0 <= c < height.shape[1]:
                found["height"][i, j] = min(max(float(height[r, c]) - z, -limit), limit)
                found["todo"][i, j] = to_do[r, c]
                found["walls"][i, j] = place.solid is not None and place.solid[r, c]
    return found


def overview(place, height, cell, squares, square, pose, doubt=0.0):
    """Share of the soil to move, where it is higher than `doubt`, and of the goal, in squares of `square` m."""
    x, y, heading = pose
    result = np.zeros((2, squares, squares))
    solid = np.zeros(height.shape, bool) if place.solid is None else place.solid
    goal = place.goal & ~solid
    excess = np.maximum(height - aim(place), 0) * ~goal * ~solid
    excess[excess <= doubt] = 0
    for r, c in np.ndindex(height.shape):
        dx, dy = (c + 0.5) * cell - x, (r + 0.5) * cell - y
        i = floor(0.5 * squares - (dx * cos(heading) + dy * sin(heading)) / square)
        j = floor(0.5 * squares + (dx * sin(heading) - dy * cos(heading)) / square)
        i, j = (min(max(k, 0), squares - 1) for k in (i, j))
        result[:, i, j] += excess[r, c] * cell**2 / place.soil, goal[r, c] / max(goal.sum(), 1)
    return np.minimum(result, [[[4.0]], [[1.0]]])


def site_map(place, height, goal_depth, limit):
    """The channels of the map: height, what is to do, and walls if there can be any."""
    channels = [np.clip(height, -1000, 1000), todo(place, height, goal_depth, limit)]
    return np.stack(channels + ([] if place.solid is None else [place.solid])).astype(np.float32)
