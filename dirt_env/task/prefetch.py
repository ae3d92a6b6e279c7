"""What the next step of a world is going to read is asked for in good time: a large batch is not in the caches."""

from math import cos, sin

from dirt_env.sim.intrinsics import flat, prefetch
from dirt_env.sim.jit import kernel
from dirt_env.task.batch import Batch

LINE = 16  # numbers of 4 bytes that come from memory together
DRIVEN = 2.0  # cells around what is read now, which may be read when the machine has driven on
STEEP = 1e-3  # sides of the turned square that are closer to the axes than that count as this far from them


@kernel
def prefetch_world(batch: Batch, w: int, size: int) -> None:
    """Ask for ground and aim under the patch of world w, of size x size pixels, and for the job at its blade."""
    pose, scene, job = batch.machine[w], batch.scenes[w], batch.job
    cell, ahead_x, ahead_y = scene.cell, cos(pose.heading), sin(pose.heading)
    x, y = pose.x / cell, pose.y / cell
    side, reach = size * scene.eye.resolution / cell, scene.blade.reach / cell
    middle, half = (scene.eye.ahead - 0.5) * side, 0.5 * side + DRIVEN
    height, aim = flat(batch.height[w]), flat(job.aim[w])
    target, haul, kind = flat(job.target[w]), flat(job.haul[w]), flat(job.kind[w])
    rows, cols = batch.height.shape[1], batch.height.shape[2]
    x_patch, y_patch, sides = x + middle * ahead_x, y + middle * ahead_y, sides_of(half, ahead_x, ahead_y)
    farthest = half * (abs(ahead_x) + abs(ahead_y))
    first_row, end_row = cells(y_patch - farthest, y_patch + farthest, rows)
    for r in range(first_row, end_row, 2):  # two rows together; asking for what lies beyond the map does no harm
        left, right = chord(sides, r + 1.0 - y_patch)
        first, end = cells(x_patch + left, x_patch + right, cols)
        for p in range((r * cols + first) // LINE * LINE, r * cols + end, LINE):
            prefetch(height, p)
            prefetch(aim, p)
            prefetch(height, p + cols)
            prefetch(aim, p + cols)
    x_blade, y_blade, wide = x + reach * ahead_x, y + reach * ahead_y, scene.blade.width / cell
    first_row, end_row = cells(y_blade - wide, y_blade + wide, rows)
    first, end = cells(x_blade - wide, x_blade + wide, cols)
    for r in range(first_row, end_row):
        for p in range((r * cols + first) // LINE * LINE, r * cols + end, LINE):
            prefetch(target, p)
            prefetch(haul, p)
            prefetch(kind, p)


@kernel
def cells(low, high, count):
    """(first, end) of the `count` cells of a row or column that reach from `low` to `high`, in cells."""
    return min(max(int(low), 0), count), min(max(int(high) + 1, 0), count)


@kernel
def sides_of(half, ahead_x, ahead_y):
    """The sides of a square 2 `half` wide that is turned to (ahead_x, ahead_y), for `chord`."""
    ahead_x = ahead_x if abs(ahead_x) > STEEP else STEEP
    ahead_y = ahead_y if abs(ahead_y) > STEEP else STEEP
    return -ahead_y / ahead_x, half / abs(ahead_x), ahead_x / ahead_y, half / abs(ahead_y)


@kernel
def chord(sides, up):
    """(left, right) of its middle, where the square lies on a line along the rows that is `up` from it.

    Beyond it `right` is less than `left`.
    """
    slope, wide, other_slope, other_wide = sides
    return max(slope * up - wide, other_slope * up - other_wide), min(slope * up + wide, other_slope * up + other_wide)
