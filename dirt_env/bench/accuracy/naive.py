"""What a first attempt at this simulator does, to show once why the care: borders that wrap around, a rate that is not
stable, a blade rounded to cells. In numpy, as such attempts are; nothing else uses it.
"""

from math import cos, sin

import numpy as np

WRAPPING_RATE = 0.5  # share of the excess over repose that goes to each neighbour


def wrapping_sweep(height: np.ndarray, threshold: float, rate: float = WRAPPING_RATE) -> np.ndarray:
    """Each cell gives `rate` of what exceeds `threshold` [m] to each of 4 neighbours; the rim's are across the map.

    A share of 1/2 for each of four neighbours gives away twice what there is: more than 1/4 is not stable.
    """
    change = np.zeros_like(height)
    for axis in (0, 1):
        for way in (1, -1):
            given = rate * np.maximum(height - np.roll(height, way, axis) - threshold, 0.0)
            change += np.roll(given, -way, axis) - given
    return height + change


def rounded_push(height: np.ndarray, cell: float, pose, width: float, threshold: float, sweeps: int = 8):
    """The blade has come to `pose` (x, y, heading) [m, m, rad]; soil above 0 in the cells it lies on goes ahead.

    Each of those cells gives all it has to the nearest cell ahead, and the ground relaxes a little (rate 1/4).
    """
    x, y, heading = pose
    ahead_x, ahead_y = cos(heading), sin(heading)
    height = height.copy()
    for u in np.arange(-0.5 * width, 0.5 * width + 1e-9, cell):
        row, col = round((y + u * ahead_x) / cell - 0.5), round((x - u * ahead_y) / cell - 0.5)
        onto = round(row + ahead_y), round(col + ahead_x)
        inside = all(0 <= r < height.shape[0] and 0 <= c < height.shape[1] for r, c in ((row, col), onto))
        if inside and (row, col) != onto:
            height[onto] += max(height[row, col], 0.0)
            height[row, col] = min(height[row, col], 0.0)
    for _ in range(sweeps):
        height = wrapping_sweep(height, threshold, 0.25)
    return height
