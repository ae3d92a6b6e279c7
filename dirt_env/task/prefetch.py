"""What the next step of a world is going to read is asked for in good time: a large batch is not in the caches."""

from math import cos, sin

from dirt_env.sim.jit import kernel, prefetch
from dirt_env.task.batch import Batch

LINE = 16  # numbers of 4 bytes that come from memory together
DRIVEN = 2.0  # cells around what is read now, which may be read when the machine has driven on


@kernel
def prefetch_world(batch: Batch, w: int, size: int) -> None:
    """Ask for ground and aim under the patch of world w, of size x size pixels, and for the job at its blade."""
    pose, scene, job = batch.machine[w], batch.scenes[w], batch.job
    cell, ahead_x, ahead_y = scene.cell, cos(pose.heading), sin(pose.heading)
    x, y, turned = pose.x / cell, pose.y / cell, abs(ahead_x) + abs(ahead_y)
    side, reach = size * scene.eye.resolution / cell, scene.blade.reach / cell
    middle, half = (scene.eye.ahead - 0.5) * side, 0.5 * side * turned + DRIVEN
    height, aim = batch.height[w].ravel(), job.aim[w].ravel()
    target, haul, kind = job.target[w].ravel(), job.haul[w].ravel(), job.kind[w].ravel()
    rows, cols = batch.height.shape[1], batch.height.shape[2]
    r0, r1, c0, c1 = square(x + middle * ahead_x, y + middle * ahead_y, half, rows, cols)
    for r in range(r0, r1):
        for p in range((r * cols + c0) // LINE * LINE, r * cols + c1, LINE):
            prefetch(height, p)
            prefetch(aim, p)
    r0, r1, c0, c1 = square(x + reach * ahead_x, y + reach * ahead_y, scene.blade.width / cell, rows, cols)
    for r in range(r0, r1):
        for p in range((r * cols + c0) // LINE * LINE, r * cols + c1, LINE):
            prefetch(target, p)
            prefetch(haul, p)
            prefetch(kind, p)


@kernel
def square(x, y, half, rows, cols):
    """(r0, r1, c0, c1): the cells of a map no farther than `half` from (x, y) to all sides, all in cells."""
    r0, r1 = max(int(y - half), 0), min(int(y + half) + 1, rows)
    return r0, r1, max(int(x - half), 0), min(int(x + half) + 1, cols)
