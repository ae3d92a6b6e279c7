"""The patch of ground around the machine: to each pixel of a turned square its cell, sixteen pixels at a time.

A pixel outside the site is treated as the nearest cell's and then painted over.
"""

from math import floor

import numpy as np

from dirt_env.sim.intrinsics import flat
from dirt_env.sim.jit import kernel
from dirt_env.sim.lanes import WIDE, choose, clamp, floors, gather, has, store, store_all, wide_ramp
from dirt_env.task.kinds import DESIGN, HIGH, SOLID

HEIGHT, TODO, WALLS = range(3)
CHANNELS = ("height", "todo", "walls")
COARSEST = 2.0**25  # cells that a pixel counts as wide at most: its neighbours lie beyond any site anyway


@kernel
def fill_patch(height, job, pose, facing, cell, view, patch):
    """Fill the channels `view.channels` of patch[channels, size, size]; row 0 farthest ahead, column 0 farthest left.

    `facing` is that of the heading of the machine's record `pose`. A pixel shows the cell that its centre lies in; on a
    line between two cells, to the precision of single numbers, that is the eastern or northern one. Those are counted
    from the machine's cell, so that a large site costs none of it near the machine; the site's ends are whole numbers
    that they hold exactly, so that no rounding leads beyond them.
    """
    channels, rows, cols, real = view.channels, height.shape[0], height.shape[1], np.float32
    size, step = patch.shape[1], min(view.resolution / cell, COARSEST)
    east, north = facing[0] * step, facing[1] * step
    x, y, ahead, left = pose.x / cell, pose.y / cell, view.ahead * size - 0.5, 0.5 * size - 0.5
    own_column, own_row = floor(x), floor(y)
    own, x, y = np.int32(own_row * cols + own_column), x - own_column, y - own_row
    west_end, east_end, south_end, north_end = (
        real(-own_column), real(cols - own_column), real(-own_row), real(rows - own_row),
    )  # fmt: skip
    along_x, along_y, nothing = real(north), real(east), real(0.0)
    level, limit, beyond = real(pose.z), real(view.limit), real(view.beyond)
    most, goal_depth, has_design = real(job.limit), real(job.goal_depth), job.design_cells > 0.0
    ground, aims, kinds, pixels = flat(height), flat(job.aim), flat(job.kind), flat(patch)
    height_at, todo_at, walls_at = place_of(HEIGHT, channels), place_of(TODO, channels), place_of(WALLS, channels)
    for i in range(size):
        row_x = real(x + (ahead - i) * east - left * north)
        row_y = real(y + (ahead - i) * north + left * east)
        for j in range(0, size, WIDE):
            n, p = wide_ramp(real(j), real(1.0)), i * size + j
            column, row = n * along_x + row_x, row_y - n * along_y
            inside = (column >= west_end) & (column < east_end) & (row >= south_end) & (row < north_end)
            column = clamp(column, west_end, east_end - real(1.0))
            row = clamp(row, south_end, north_end - real(1.0))
            places = floors(row) * cols + floors(column) + own
            here = gather(ground, places)
            if height_at >= 0:
                shown = choose(inside, clamp(here - level, -limit, limit), beyond)
                put(pixels, height_at * size * size + p, shown, size - j)
            if todo_at >= 0:
                over = here - gather(aims, places)
                in_goal = over > HIGH
                if has_design:
                    over = clamp(over, choose(has(gather(kinds, places), DESIGN), -most, nothing), most)
                else:
                    over = clamp(over, nothing, most)
                over = choose(in_goal, -goal_depth, over)
                put(pixels, todo_at * size * size + p, choose(inside, over, nothing), size - j)
            if walls_at >= 0:
                shown = choose(has(gather(kinds, places), SOLID), real(1.0), nothing)
                put(pixels, walls_at * size * size + p, choose(inside, shown, real(1.0)), size - j)


@kernel
def place_of(channel, channels):
    """Where a channel is among `channels`, -1 if it is not."""
    found = -1
    for k in range(len(channels)):
        if channels[k] == channel:
            found = k
    return found


@kernel
def put(pixels, place, lanes, count):
    """Write the lanes, or only the first `count`, from `place` on."""
    if count >= WIDE:
        store_all(pixels, place, lanes)
    else:
        store(pixels, place, lanes, count)
