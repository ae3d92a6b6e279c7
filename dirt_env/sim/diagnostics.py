"""What a height field is: its volume, its steepest slope."""

import numpy as np


def volume(height: np.ndarray, cell: float) -> float:
    """Volume over the datum [m3]; exact for heights that are multiples of a world's quantum."""
    return float(np.sum(height, dtype=np.float64)) * cell**2


def steepest(height: np.ndarray, cell: float) -> float:
    """Largest slope over a face [-]: the length of the gradient there, as `slump` measures it."""
    h = np.asarray(height, np.float64)
    over_x, over_y = np.diff(h, axis=1), np.diff(h, axis=0)
    along_y = np.pad(over_y, ((1, 1), (0, 0)))
    along_x = np.pad(over_x, ((0, 0), (1, 1)))
    across_x = (along_y[:-1, :-1] + along_y[1:, :-1] + along_y[:-1, 1:] + along_y[1:, 1:]) / 4
    across_y = (along_x[:-1, :-1] + along_x[:-1, 1:] + along_x[1:, :-1] + along_x[1:, 1:]) / 4
    slopes = [np.hypot(over_x, across_x), np.hypot(over_y, across_y)]
    return max((float(s.max()) for s in slopes if s.size), default=0.0) / cell
