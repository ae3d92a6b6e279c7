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
    for i in range(size):
        x0, y0 = _row_start(x, y, ahead, left, east, north, i)
        if not (_is_inside(x0, north, size, cols) and _is_inside(y0, -east, size, rows)):
            first, end = run_inside(x0, north, cols, size)
            first_too, end_too = run_inside(y0, -east, rows, size)
            _paint_outside(channels, view.beyond, patch, i, max(first, first_too), min(end, end_too))


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
def _paint_outside(channels, beyond, patch, i, first, end):
    """Make the pixels of row i before `first` and from `end` on, or all of them, those of ground outside the site."""
    size = patch.shape[1]
    for k in range(len(channels)):
        value = np.float32(beyond if channels[k] == HEIGHT else (1.0 if channels[k] == WALLS else 0.0))
        for j in range(min(first, size) if first < end else size):
            patch[k, i, np.uint64(j)] = value
        for j in range(end, size):
            patch[k, i, np.uint64(j)] = value


@kernel
def _is_inside(start, slope, count, length):
    """Whether start + j slope lies in [0, length) for all j of [0, count)."""
    end = start + (count - 1) * slope
    return start >= 0.0 and start < length and end >= 0.0 and end < length


@kernel
def run_inside(start, slope, length, count):
    """(first, end) of the j in [0, count) with start + j slope in [0, length); end <= first if there are none."""
    near, far = _crossing(start, slope, 0.0, count), _crossing(start, slope, float(length), count)
    return min(near, far), max(near, far)


@kernel
def _crossing(start, slope, level, count):
    """The first j of [0, count) where start + j slope has come to the level, or if it falls, below it; else `count`.

    A division finds it, and the numbers themselves put right what it rounded.
    """
    rising = slope >= 0.0
    j = 0 if (start >= level) == rising else count
    if abs(slope) > 1e-6:
        j = int(min(max((level - start) / slope, 0.0), float(count)))
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
