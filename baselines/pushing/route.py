"""Ways for the machine's pivot round what it must not meet: straight where it can, else by way points."""

from math import ceil, hypot

import numpy as np

from dirt_env.task.haul import haul_distance

Point = tuple[float, float]
SIGHT = 8.0  # m; how far the next way point may be
LEAVE = 3.0  # m
MOST = 32  # way points
LOOKS = 24  # points tried as the next way point, best first


def is_clear(blocked: np.ndarray, cell: float, start: Point, end: Point) -> bool:
    """Whether a straight line meets no blocked cell [row, col]; it looks twice a cell.

    A line that starts on blocked cells may leave them within `LEAVE` metres.
    """
    rows, cols = blocked.shape
    pieces = max(2, ceil(2.0 * hypot(end[0] - start[0], end[1] - start[1]) / cell))
    share = np.arange(1, pieces + 1) / pieces
    c = ((start[0] + share * (end[0] - start[0])) // cell).astype(int)
    r = ((start[1] + share * (end[1] - start[1])) // cell).astype(int)
    if c.min() < 0 or r.min() < 0 or c.max() >= cols or r.max() >= rows:
        return False
    met = blocked[r, c]
    left = int(np.argmin(met)) if blocked[_index(start, cell, blocked.shape)] else 0
    return not met[left:].any() and left * cell / 2 <= LEAVE


def way(blocked: np.ndarray, cell: float, start: Point, end: Point) -> list[Point] | None:
    """Way points from `start` to `end`, `end` included; None if there is no way."""
    if is_clear(blocked, cell, start, end):
        return [end]
    goal = np.zeros(blocked.shape, bool)
    goal[_index(end, cell, blocked.shape)] = True
    left = np.where(blocked & ~goal, np.inf, haul_distance(goal, blocked & ~goal, cell))
    points, at = [], start
    while not is_clear(blocked & ~goal, cell, at, end):
        at = _next(blocked, left, cell, at)
        if at is None or len(points) > MOST:
            return None
        points.append(at)
    return [*points, end]


def _next(blocked: np.ndarray, left: np.ndarray, cell: float, at: Point) -> Point | None:
    """The cell in sight by which the whole way is shortest, at least half a cell nearer to the end; or None."""
    r, c = np.nonzero(np.isfinite(left))
    x, y = (c + 0.5) * cell, (r + 0.5) * cell
    way_there = np.hypot(x - at[0], y - at[1])
    here = left[_index(at, cell, left.shape)]
    here = here if np.isfinite(here) else np.inf
    useful = np.nonzero((way_there <= SIGHT) & (left[r, c] < here - 0.5 * cell))[0]
    total = way_there[useful] + left[r, c][useful]
    # Of ways equally long the one with the farther point, so that there are few points.
    order = useful[np.lexsort((left[r, c][useful], np.round(total / cell)))]
    for i in order[:: max(1, len(order) // (4 * LOOKS))]:
        if is_clear(blocked, cell, at, (x[i], y[i])):
            return float(x[i]), float(y[i])
    return None


def _index(point: Point, cell: float, shape: tuple[int, int]) -> tuple[int, int]:
    return min(max(int(point[1] // cell), 0), shape[0] - 1), min(max(int(point[0] // cell), 0), shape[1] - 1)
