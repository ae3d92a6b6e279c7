"""The patch of ground around the machine: to each pixel of a turned square its cell, without a test for each pixel.

Cells are numbered, fetched and clipped in plain loops of their own; until it is filled itself, the last channel holds
the numbers. A pixel outside the site is treated as the nearest cell's and painted over at the end, where there are any:
a row of pixels is a straight line over the site, and those of it inside are one run, found from its ends.
"""

from math import floor

import numpy as np

from dirt_env.sim.jit import flat, kernel
from dirt_env.task.kinds import SOLID, least_todo, todo

HEIGHT, TODO, WALLS = range(3)
CHANNELS = ("height", "todo", "walls")
STEEP = 1e300  # one over the slope of a line along the border
COARSEST = 2.0**25  # cells that a pixel counts as wide at most: its neighbours lie beyond any site anyway
SURE = 1e-6  # cells that a corner of the patch must be clear of a border for it not to be looked at


@kernel
def fill_patch(height, job, pose, facing, cell, view, patch):
    """Fill the channels `view.channels` of patch[channels, size, size]; row 0 farthest ahead, column 0 farthest left.

    `facing` is that of the heading of the machine's record `pose`. A pixel shows the cell that its centre lies in; on a
    line between two cells, to the precision of single numbers, that is the eastern or northern one.
    """
    channels, rows, cols = view.channels, height.shape[0], height.shape[1]
    size, step = patch.shape[1], min(view.resolution / cell, COARSEST)
    east, north = facing[0] * step, facing[1] * step
    x, y, ahead, left = pose.x / cell, pose.y / cell, view.ahead * size - 0.5, 0.5 * size - 0.5
    number = patch[-1].view(np.int32)
    _number_cells(x, y, ahead, left, east, north, rows, cols, number)
    numbers, heights, aims, kinds = flat(number), flat(height), flat(job.aim), flat(job.kind)
    base, shared = -1, job.design_cells == 0.0
    for k in range(len(channels)):
        base = k if channels[k] == HEIGHT else base
    shared &= base >= 0  # heights are fetched once for both channels
    for k in range(len(channels)):
        pixels = flat(patch[k])
        if channels[k] == HEIGHT:
            _fetch(heights, numbers, pixels)
        elif channels[k] == WALLS:
            _fetch_walls(kinds, numbers, pixels)
        elif shared:
            _fetch(aims, numbers, pixels)
        elif job.design_cells > 0.0:
            _fetch_design(heights, aims, kinds, job.limit, numbers, pixels)
        else:
            _fetch_todo(heights, aims, numbers, pixels)
    for k in range(len(channels)):
        if channels[k] == TODO:
            pixels = flat(patch[k])
            if shared:
                _take_from(flat(patch[base]), pixels)
            _clip_todo(job.limit, job.goal_depth, pixels)
    if base >= 0:
        _clip_height(pose.z, view.limit, flat(patch[base]))
    _paint_outside(channels, view.beyond, x, y, ahead, left, east, north, rows, cols, patch)


@kernel
def _row_start(x, y, ahead, left, east, north, i):
    """Where the centre of the leftmost pixel of row i lies, in cells from the site's corner."""
    return x + (ahead - i) * east - left * north, y + (ahead - i) * north + left * east


@kernel
def _number_cells(x, y, ahead, left, east, north, rows, cols, number):
    """Write row * cols + column of the cell under each pixel, or of the nearest, to number[size, size].

    In single precision, counted from the machine's cell, so that a large site costs none of it near the machine. The
    bounds are whole numbers that it holds exactly: no rounding leads beyond them.
    """
    size, real, whole = number.shape[0], np.float32, np.int32
    own_column, own_row = floor(x), floor(y)
    west, east_end, south, north_end = (
        real(-own_column), real(cols - 1.0 - own_column), real(-own_row), real(rows - 1.0 - own_row),
    )  # fmt: skip
    wide, own, along_x, along_y = whole(cols), whole(own_row * cols + own_column), real(north), real(east)
    for i in range(size):
        x0, y0 = _row_start(x - own_column, y - own_row, ahead, left, east, north, i)
        first_x, first_y = real(x0), real(y0)
        for j in range(size):
            k = real(whole(j))
            column = np.floor(min(max(first_x + k * along_x, west), east_end))
            row = np.floor(min(max(first_y - k * along_y, south), north_end))
            start = whole(whole(row) * wide)  # numba makes 64 bits of every product and sum
            number[i, np.uint64(j)] = whole(whole(start + whole(column)) + own)


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
    per_x, per_y = 1.0 / north if north != 0.0 else STEEP, -1.0 / east if east != 0.0 else STEEP
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
        for k in range(len(channels)):
            value = np.float32(beyond if channels[k] == HEIGHT else (1.0 if channels[k] == WALLS else 0.0))
            _paint(patch[k, i], np.int32(first), np.int32(end), value)


@kernel
def _keep(first, end, start, slope, per_slope, level, count, is_after):
    """The run [first, end) of a row's pixels, cut where start + j slope crosses a level: kept is what comes after."""
    crossing = _crossing(start, slope, per_slope, level, count)
    return (max(first, crossing), end) if is_after else (first, min(end, crossing))


@kernel
def _crossing(start, slope, per_slope, level, count):
    """The first j of [0, count) where start + j slope has come to the level, or if it falls, below it; else `count`.

    `per_slope`, one over the slope, finds it or the one before it, as the numbers themselves then tell.
    """
    j = int(min(max((level - start) * per_slope, 0.0), float(count)))
    is_before = (start + j * slope >= level) != (slope >= 0.0)
    return j + (1 if is_before & (j < count) else 0)


@kernel
def _paint(pixels, first, end, value):
    """Make a row's pixels before `first` and from `end` on, or all of them, `value`: all in vectors, without a jump."""
    for j in range(pixels.shape[0]):
        k = np.int32(j)
        pixels[np.uint64(j)] = value if (k < first) | (k >= end) else pixels[np.uint64(j)]


@kernel
def _fetch(cells, number, pixels):
    """What is in the cells [n], at every pixel's."""
    for j in range(pixels.shape[0]):
        pixels[j] = cells[np.uint32(number[j])]


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
def _take_from(height, pixels):
    """The height over the aim, from the height and the aim; soil to take away only."""
    for j in range(pixels.shape[0]):
        pixels[j] = max(height[j] - pixels[j], np.float32(0.0))


@kernel
def _clip_height(ground, limit, pixels):
    level, most = np.float32(ground), np.float32(limit)
    for j in range(pixels.shape[0]):
        pixels[j] = min(max(pixels[j] - level, -most), most)


@kernel
def _clip_todo(limit, goal_depth, pixels):
    most, goal = np.float32(limit), np.float32(goal_depth)
    for j in range(pixels.shape[0]):
        pixels[j] = todo(pixels[j], most, goal)
