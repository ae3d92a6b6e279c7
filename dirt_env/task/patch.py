"""The patch of ground around the machine: to each pixel of a turned square its cell, without a test for each pixel.

A row of pixels is a straight line over the site. Where both of its ends lie inside, all of it does; else the pixels
inside are one run, found from its ends. Cells are numbered, fetched and clipped in plain loops of their own; until it
is filled itself, the last channel holds the numbers.
"""

from math import cos, sin

import numpy as np

from dirt_env.sim.jit import kernel
from dirt_env.task.kinds import HUGE, SOLID, least_todo, todo

HEIGHT, TODO, WALLS = range(3)
CHANNELS = ("height", "todo", "walls")
NONE = -1  # number of the cell under a pixel outside the site
BEYOND = HUGE  # [m] height that stands for the ground outside the site until it is clipped


@kernel(forceinline=True)
def fill_patch(height, job, pose, cell, view, patch):
    """Fill the channels `view.channels` of patch[channels, size, size]; row 0 farthest ahead, column 0 farthest left.

    A pixel shows the cell that its centre lies in; on a line between two cells that is the eastern or northern one.
    """
    channels, ground = view.channels, pose.z
    number = patch[-1].view(np.int32)
    _number_cells(
        height.shape[0], height.shape[1], pose.x, pose.y, pose.heading, cell, view.resolution, view.ahead, number
    )
    numbers, heights, aims, kinds = number.ravel(), height.ravel(), job.aim.ravel(), job.kind.ravel()
    for k in range(len(channels)):
        pixels = patch[k].ravel()
        if channels[k] == HEIGHT:
            _fetch_height(heights, numbers, pixels)
            _clip_height(ground, view.limit, view.beyond, pixels)
        elif channels[k] == WALLS:
            _fetch_walls(kinds, numbers, pixels)
        else:
            if job.design_cells > 0.0:
                _fetch_design(heights, aims, kinds, job.limit, numbers, pixels)
            else:
                _fetch_todo(heights, aims, numbers, pixels)
            _clip_todo(job.limit, job.goal_depth, pixels)


@kernel
def _number_cells(rows, cols, x, y, heading, cell, resolution, ahead, number):
    """Write row * cols + column of the cell under each pixel to number[size, size], NONE outside the site."""
    size = number.shape[0]
    step = resolution / cell
    east, north = cos(heading) * step, sin(heading) * step
    ahead, left = ahead * size - 0.5, 0.5 * size - 0.5
    for i in range(size):
        x0 = x / cell + (ahead - i) * east - left * north
        y0 = y / cell + (ahead - i) * north + left * east
        if _is_inside(x0, north, size, cols) and _is_inside(y0, -east, size, rows):
            first, end = 0, size
        else:
            first, end = run_inside(x0, north, cols, size)
            first_too, end_too = run_inside(y0, -east, rows, size)
            first, end = max(first, first_too), min(end, end_too)
            number[i] = NONE
        _number_run(x0, north, y0, east, cols, number, i, first, end)


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
def _number_run(x, north, y, east, cols, number, i, first, end):
    """Number the cells of the pixels from `first` to `end` of row i, all of them inside the site."""
    wide = np.int32(cols)
    for j in range(first, end):
        number[i, np.uint64(j)] = np.int32(y - j * east) * wide + np.int32(x + j * north)


@kernel
def _fetch_height(height, number, pixels):
    for j in range(pixels.shape[0]):
        pixels[j] = height[np.uint32(max(number[j], 0))] if number[j] >= 0 else np.float32(BEYOND)


@kernel
def _fetch_walls(kind, number, pixels):
    for j in range(pixels.shape[0]):
        bits = kind[np.uint32(max(number[j], 0))] if number[j] >= 0 else np.uint8(SOLID)
        pixels[j] = 1.0 if bits & SOLID else 0.0


@kernel
def _fetch_todo(height, aim, number, pixels):
    for j in range(pixels.shape[0]):
        p = np.uint32(max(number[j], 0))
        over = height[p] - aim[p] if number[j] >= 0 else np.float32(0.0)
        pixels[j] = max(over, np.float32(0.0))


@kernel
def _fetch_design(height, aim, kind, limit, number, pixels):
    for j in range(pixels.shape[0]):
        p = np.uint32(max(number[j], 0))
        over = height[p] - aim[p] if number[j] >= 0 else np.float32(0.0)
        pixels[j] = max(over, least_todo(kind[p], limit))


@kernel
def _clip_height(ground, limit, beyond, pixels):
    for j in range(pixels.shape[0]):
        h = float(pixels[j])
        pixels[j] = beyond if h == BEYOND else min(max(h - ground, -limit), limit)


@kernel
def _clip_todo(limit, goal_depth, pixels):
    for j in range(pixels.shape[0]):
        pixels[j] = todo(pixels[j], limit, goal_depth)
