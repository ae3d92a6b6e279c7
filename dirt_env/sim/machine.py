"""The machine: how it stands on the ground, where it may go, and how one substep moves it."""

from math import cos, pi, sin

from dirt_env.sim.intrinsics import flat
from dirt_env.sim.jit import kernel
from dirt_env.sim.lanes import among, choose, clamp, doubles, gather, ramp, total, whole
from dirt_env.sim.timestep import STRIDE

STATIONS = 5  # samples of the ground along the tracks; three across


@kernel
def wrap(angle):
    """The angle in [-pi, pi)."""
    return angle if -pi <= angle < pi else (angle + pi) % (2 * pi) - pi


@kernel
def facing_of(heading):
    """(x, y): the unit vector of a heading."""
    return cos(heading), sin(heading)


@kernel
def ground_at(height, cell, x, y):
    """Ground height [m] at a point [m], bilinear between the cells' centres; beyond them that of the nearest."""
    rows, cols = height.shape
    column, row = x / cell - 0.5, y / cell - 0.5
    column = 0.0 if column < 0.0 else (cols - 1.0 if column > cols - 1.0 else column)
    row = 0.0 if row < 0.0 else (rows - 1.0 if row > rows - 1.0 else row)
    left, low = int(column), int(row)
    right, high = min(left + 1, cols - 1), min(low + 1, rows - 1)
    fx, fy = column - left, row - low
    below = height[low, left] + fx * (height[low, right] - height[low, left])
    above = height[high, left] + fx * (height[high, right] - height[high, left])
    return below + fy * (above - below)


@kernel
def grounds_between(height, columns, rows, ahead_x, ahead_y, limit):
    """Ground heights [m] at LANES points, so many `columns` and `rows` from the centre of cell (0, 0), as doubles.

    Bilinear between the centres that lie behind the blade, where column * ahead_x + row * ahead_y <= `limit`: the soil
    that it carries lifts no track. Both are computed, and what it is without a blade taken where all four lie behind.
    """
    tall, wide = height.shape
    ground = flat(height)
    columns, rows = clamp(columns, 0.0, wide - 1.0), clamp(rows, 0.0, tall - 1.0)
    left, low = whole(columns), whole(rows)
    at_left, at_low = doubles(left), doubles(low)
    fx, fy = columns - at_left, rows - at_low
    right, high = choose(left + 1 < wide, left + 1, left), choose(low + 1 < tall, low + 1, low)
    low_left, low_right = doubles(gather(ground, low * wide + left)), doubles(gather(ground, low * wide + right))
    high_left, high_right = doubles(gather(ground, high * wide + left)), doubles(gather(ground, high * wide + right))
    below = low_left + fx * (low_right - low_left)
    above = high_left + fx * (high_right - high_left)
    between = below + fy * (above - below)
    ahead = at_left * ahead_x + at_low * ahead_y
    span = max(ahead_x, 0.0) + max(ahead_y, 0.0)
    is_whole = (left + 1 < wide) & (low + 1 < tall) & (ahead + span <= limit)
    weight = choose(ahead <= limit, (1.0 - fy) * (1.0 - fx), 0.0)
    sums, weights = weight * low_left, weight
    weight = choose(ahead + ahead_x <= limit, (1.0 - fy) * fx, 0.0)
    sums, weights = sums + weight * low_right, weights + weight
    weight = choose(ahead + ahead_y <= limit, fy * (1.0 - fx), 0.0)
    sums, weights = sums + weight * high_left, weights + weight
    weight = choose(ahead + ahead_x + ahead_y <= limit, fy * fx, 0.0)
    sums, weights = sums + weight * high_right, weights + weight
    mean = sums / choose(weights > 1e-9, weights, 1.0)
    return choose(is_whole, between, choose(weights > 1e-9, mean, low_left))


@kernel
def track_plane(height, cell, x, y, facing, blade, machine):
    """(z, pitch, roll): plane of least squares through the ground under the tracks, at the pivot [m] and its slopes."""
    ahead_x, ahead_y = facing
    per_metre = 1.0 / cell
    column, row = x * per_metre - 0.5, y * per_metre - 0.5
    # Less what the blade may cross in one substep: those cells still hold the load when the tracks are laid down.
    limit = column * ahead_x + row * ahead_y + blade.reach * per_metre - STRIDE
    long, wide = machine.length * per_metre, machine.width * per_metre
    s, counts = ramp(-0.5 * long, long / (STATIONS - 1)), among(STATIONS)
    z, along, across = ramp(0.0, 0.0), ramp(0.0, 0.0), ramp(0.0, 0.0)
    for j in range(3):
        u = wide * (0.5 * j - 0.5)
        columns, rows = s * ahead_x + (column - u * ahead_y), s * ahead_y + (row + u * ahead_x)
        h = choose(counts, grounds_between(height, columns, rows, ahead_x, ahead_y, limit), 0.0)
        z += h
        along += s * h
        across += u * h
    s = choose(counts, s, 0.0)
    along_2, across_2 = 3 * total(s * s), 0.5 * STATIONS * wide * wide
    return total(z) / (3 * STATIONS), total(along) / along_2 * per_metre, total(across) / across_2 * per_metre


@kernel
def point_is_free(solid, outside, rows, cols, cell, x, y):
    """Whether a point of the machine may be there: on the site or beyond an open border, not on something solid."""
    if outside is None and (x < 0 or y < 0 or x > cols * cell or y > rows * cell):
        return False
    if solid is not None:
        r, c = int(y // cell), int(x // cell)
        if r >= 0 and c >= 0 and r < rows and c < cols:
            return not solid[r, c]
    return True


@kernel
def segment_is_free(solid, outside, rows, cols, cell, x0, y0, x1, y1):
    """Whether a straight part of the machine's outline is free; looks at a point every half cell, and at both ends."""
    if not point_is_free(solid, outside, rows, cols, cell, x0, y0):
        return False
    if not point_is_free(solid, outside, rows, cols, cell, x1, y1):
        return False
    if solid is not None:
        pieces = int(2 * ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5 / cell) + 1
        for i in range(1, pieces):
            t = i / pieces
            if not point_is_free(solid, outside, rows, cols, cell, x0 + t * (x1 - x0), y0 + t * (y1 - y0)):
                return False
    return True


@kernel
def is_free(solid, outside, rows, cols, cell, x, y, facing, blade, machine):
    """Whether the machine can stand there with its blade and its tracks; the pivot never leaves the site."""
    if x < 0 or y < 0 or x > cols * cell or y > rows * cell:
        return False
    ax, ay = facing
    long, wide, tip = 0.5 * machine.length, 0.5 * machine.width, 0.5 * blade.width
    # The blade, then lanes along the machine, each from (s0, u0) to (s1, u1), ahead and left of the pivot: all that a
    # straight wall can touch are the outer two, and between lanes half a cell apart no solid cell has room.
    lanes = 2 if solid is None else int(machine.width / (0.5 * cell)) + 2
    for part in range(lanes + 1):
        s0, s1 = (blade.reach, blade.reach) if part == 0 else (-long, long)
        u0 = tip if part == 0 else wide * (2.0 * (part - 1) / (lanes - 1) - 1.0)
        u1 = -tip if part == 0 else u0
        if not segment_is_free(
            solid, outside, rows, cols, cell,
            x + s0 * ax - u0 * ay, y + s0 * ay + u0 * ax, x + s1 * ax - u1 * ay, y + s1 * ay + u1 * ax,
        ):  # fmt: skip
            return False
    return True


@kernel
def drive(solid, outside, rows, cols, cell, pose, blade, machine, forward, turn):
    """Move the pose by `forward` [m] and `turn` [rad]; where something solid is in the way only one of them, or none.

    Returns (metres driven, radians turned, the way that it faces now).
    """
    for attempt in range(3):
        go = forward if attempt != 2 else 0.0
        swing = turn if attempt != 1 else 0.0
        heading = wrap(pose.heading + swing)
        facing, (way_x, way_y) = facing_of(heading), facing_of(pose.heading + 0.5 * swing)
        x, y = pose.x + go * way_x, pose.y + go * way_y
        if is_free(solid, outside, rows, cols, cell, x, y, facing, blade, machine):
            pose.x, pose.y, pose.heading = x, y, heading
            return go, swing, facing
    return 0.0, 0.0, facing_of(pose.heading)
