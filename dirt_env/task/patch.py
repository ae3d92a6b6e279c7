"""The patch of ground around the machine: to each pixel of a turned square its cell, without a test for each pixel.

Cells are numbered, fetched and clipped in plain loops of their own; until it is filled itself, the last channel holds
the numbers. A pixel outside the site is treated as the nearest cell's and painted over at the end, where there are any:
a row of pixels is a straight line over the site, and those of it inside are one run, found from its ends.
"""

from math import cos, sin

import numpy as np

from dirt_env.sim.jit import kernel
from dirt_env.task.kinds import SOLID, least_todo, todo

HEIGHT, TODO, WALLS = range(3)
CHANNELS = ("height", "todo", "walls")
SURE = 1e-6  # cells that a corner of the patch must be clear of a border for it not to be looked at


@kernel
def fill_patch(height, job, pose, cell, view, patch):
    """Fill the channels `view.channels` of patch[channels, size, size]; row 0 farthest ahead, column 0 farthest left.

    A pixel shows the cell that its centre lies in; on a line between two cells that is the eastern or northern one.
    """
    channels, ground = view.channels, pose.z
    rows, cols = height.shape
    size, step = patch.shape[1], view.resolution / cell
    east, north = cos(pose.heading) * step, sin(pose.heading) * step
    x, y, ahead, left = pose.x / cell, pose.y / cell, view.ahead * size - 0.5, 0.5 * size - 0.5
    number = patch[-1].view(np.int32)
    for i in range(size):
        x0, y0 = _row_start(x, y, ahead, left, east, north, i)
        _number_row(x0, north, y0, east, rows, cols, number, i)
    numbers, heights, aims, kinds = number.ravel(), height.ravel(), job.aim.ravel(), job.kind.ravel()
    for k in range(len(channels)):
        pixels = patch[k].ravel()
        if channels[k] == HEIGHT:
            _fetch_height(heights, numbers, pixels)
            _clip_height(ground, view.limit, pixels)
        elif channels[k] == WALLS:
            _fetch_walls(kinds, numbers, pixels)
        else:
            if job.design_cells > 0.0:
                _fetch_design(heights, aims, kinds, job.limit, numbers, pixels)
            else:
                _fetch_todo(heights, aims, numbers, pixels)
            _clip_todo(job.limit, job.goal_depth, pixels)
    _paint_outside(channels, view.beyond, x, y, ahead, left, east, north, rows, cols, patch)


@kernel
def _row_start(x, y, ahead, left, east, north, i):
    """Where the centre of the leftmost pixel of row i lies, in cells from the site's corner."""
    return x + (ahead - i) * east - left * north, y + (ahead - i) * north + left * east


@kernel
def _number_row(x, north, y, east, rows, cols, number, i):
    """Write row * cols + column of the cell under each pixel, or of the nearest, to number[i]."""
    wide, right, top = np.int32(cols), cols - 1.0, rows - 1.0
    for j in range(number.shape[1]):
        row, column = min(max(y - j * east, 0.0), top), min(max(x + j * north, 0.0), right)
        number[i, np.uint64(j)] = np.int32(row) * wide + np.int32(column)


@kernel
def _paint_outside(channels, beyond, x, y, ahead, left, east, north, rows, cols, patch):
    """Make the pixels outside the site those of ground outside; only borders that the patch's corners lie beyond count.

    Along a row of pixels x goes up by `north` each, and y by -`east`.
    """
    size = patch.shape[1]
    corner_x, corner_y = _row_start(x, y, ahead, left, east, north, 0)
    x_right, y_left = (size - 1) * north, (size - 1) * east  # along the top row; down a column x falls by y_left
    west = corner_x + min(x_right, 0.0) - max(y_left, 0.0) < SURE
    past_east = corner_x + max(x_right, 0.0) - min(y_left, 0.0) > cols - SURE
    south = corner_y - max(y_left, 0.0) - max(x_right, 0.0) < SURE
    past_north = corner_y - min(y_left, 0.0) - min(x_right, 0.0) > rows - SURE
    if not (west or past_east or south or past_north):
        return
    per_x, per_y = 1.0 / north if north != 0.0 else 0.0, -1.0 / east if east != 0.0 else 0.0
    for i in range(size):
        x0, y0 = _row_start(x, y, ahead, left, east, north, i)
        first, end = 0, size
        if west:
            first, end = _keep(first, end, x0, north, per_x, 0.0, size, north >= 0.0)
        if past_east:
            first, end = _keep(first, end, x0, north, per_x, float(cols), size, north < 0.0)
        if south:
            first, end = _keep(first, end, y0, -east, per_y, 0.0, size, east <= 0.0)
        if past_north:
            first, end = _keep(first, end, y0, -east, per_y, float(rows), size, east > 0.0)
        if first > 0 or end < size:
            _paint(channels, beyond, patch, i, first, end)


@kernel
def _keep(first, end, start, slope, per_slope, level, count, is_after):
    """The run [first, end) of a row's pixels, cut where start + j slope crosses a level: kept is what comes after."""
    crossing = _crossing(start, slope, per_slope, level, count)
    return (max(first, crossing), end) if is_after else (first, min(end, crossing))


@kernel
def _paint(channels, beyond, patch, i, first, end):
    """Make the pixels of row i before `first` and from `end` on, or all of them, those of ground outside the site."""
    size = patch.shape[1]
    for k in range(len(channels)):
        value = np.float32(beyond if channels[k] == HEIGHT else (1.0 if channels[k] == WALLS else 0.0))
        for j in range(min(first, size) if first < end else size):
            patch[k, i, np.uint64(j)] = value
        for j in range(end, size):
            patch[k, i, np.uint64(j)] = value


@kernel
def _crossing(start, slope, per_slope, level, count):
    """The first j of [0, count) where start + j slope has come to the level, or if it falls, below it; else `count`.

    `per_slope`, one over the slope, finds it, and the numbers themselves put right what it rounded.
    """
    rising = slope >= 0.0
    j = 0 if (start >= level) == rising else count
    if abs(slope) > 1e-6:
        j = int(min(max((level - start) * per_slope, 0.0), float(count)))
    while j > 0 and (start + (j - 1) * slope >= level) == rising:
        j -= 1
    while j < count and (start + j * slope >= level) != rising:
        j += 1
    return j


@kernel
def _fetch_height(height, number, pixels):
    for j in range(pixels.shape[0]):
        pixels[j] = height[np.uint32(number[j])]


@kernel
def _fetch_walls(kind, number, pixels):
    for j in range(pixels.shape[0]):
        pixels[j] = 1.0 if kind[np.uint32(number[j])] & SOLID else 0.0


@kernel
def _fetch_todo(height, aim, number, pixels):
    for j in range(pixels.shape[0]):
        p = np.uint32(number[j])
        pixels[j] = max(height[p] - aim[p], np.float32(0.0))


@kernel
def _fetch_design(height, aim, kind, limit, number, pixels):
    for j in range(pixels.shape[0]):
        p = np.uint32(number[j])
        pixels[j] = max(height[p] - aim[p], least_todo(kind[p], limit))


@kernel
def _clip_height(ground, limit, pixels):
    for j in range(pixels.shape[0]):
        pixels[j] = min(max(float(pixels[j]) - ground, -limit), limit)


@kernel
def _clip_todo(limit, goal_depth, pixels):
    for j in range(pixels.shape[0]):
        pixels[j] = todo(pixels[j], limit, goal_depth)
