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
    prefetch_square(batch.height[w], x + middle * ahead_x, y + middle * ahead_y, half)
    prefetch_square(job.aim[w], x + middle * ahead_x, y + middle * ahead_y, half)
    x, y, half = x + reach * ahead_x, y + reach * ahead_y, scene.blade.width / cell  # where soil moves
    prefetch_square(job.target[w], x, y, half)
    prefetch_square(job.haul[w], x, y, half)
    prefetch_square(job.kind[w], x, y, half)


@kernel
def prefetch_square(ground, x, y, half):
    """Ask for the cells of a map [rows, cols] no farther than `half` from (x, y) to all sides, all in cells."""
    rows, cols = ground.shape
    places, together = ground.ravel(), LINE * 4 // ground.itemsize
    r0, r1 = max(int(y - half), 0), min(int(y + half) + 1, rows)
    c0, c1 = max(int(x - half), 0), min(int(x + half) + 1, cols)
    for r in range(r0, r1):
        for p in range((r * cols + c0) // together * together, r * cols + c1, together):
            prefetch(places, p)
