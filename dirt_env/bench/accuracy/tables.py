"""Problem of a table whose edges are open: slopes to the nearest way out, also round obstacles."""

from itertools import product
from math import hypot

import numpy as np

from dirt_env.bench.accuracy.case import SITE, SLOPE, Case, averages, site

# Solid rectangles [m]: west, south, east, north. On whole cells at every resolution from 32.
OBSTACLES = ((6.0, 8.0, 8.0, 24.0), (12.0, 4.0, 26.0, 6.0), (22.0, 18.0, 25.0, 27.0))
HIGH = 16.0  # m; no point is so far from the open edge that the table would keep its height there
CLOSE = 1e-9  # m by which a line may touch an obstacle


def crosses(rectangle, x0, y0, x1, y1):
    """Whether the straight way between two points goes through the inside of a rectangle (slab test; arrays)."""
    west, south, east, north = (np.asarray(side) for side in rectangle)
    enter, leave = np.zeros(np.broadcast(x0, y0, x1, y1).shape), np.ones(np.broadcast(x0, y0, x1, y1).shape)
    for low, high, begin, end in ((west, east, x0, x1), (south, north, y0, y1)):
        way = np.asarray(end - begin, float)
        inside = (begin > low + CLOSE) & (begin < high - CLOSE)
        with np.errstate(divide="ignore", invalid="ignore"):
            first, last = (low + CLOSE - begin) / way, (high - CLOSE - begin) / way
        still = np.abs(way) < 1e-15
        enter = np.maximum(enter, np.where(still, np.where(inside, 0.0, np.inf), np.minimum(first, last)))
        leave = np.minimum(leave, np.where(still, np.where(inside, 1.0, -np.inf), np.maximum(first, last)))
    return enter < leave


def straight_out(x, y, rim: float, obstacles=OBSTACLES):
    """Length of the shortest way out of the table along an axis [m], inf where obstacles are in all of them.

    The table ends `rim` metres outside the site.
    """
    best = np.full(np.broadcast(x, y).shape, np.inf)
    for x1, y1 in ((-rim, y), (SITE + rim, y), (x, -rim), (x, SITE + rim)):
        blocked = np.zeros(best.shape, bool)
        for rectangle in obstacles:
            blocked |= crosses(rectangle, x, y, x1, y1)
        best = np.where(blocked, best, np.minimum(best, np.abs(x - x1) + np.abs(y - y1)))
    return best


def way_out(x, y, rim: float, obstacles=OBSTACLES):
    """Geodesic distance to the open edge [m]: straight, or round corners of the obstacles, of which each knows its own.

    A shortest way turns at corners only; from the last one it leaves at right angles to the edge.
    """
    corners = [(cx, cy) for west, south, east, north in obstacles for cx, cy in product((west, east), (south, north))]
    known = [float(straight_out(np.array(cx), np.array(cy), rim, obstacles)) for cx, cy in corners]
    for _ in corners:  # Bellman and Ford
        for i, (cx, cy) in enumerate(corners):
            for j, (ox, oy) in enumerate(corners):
                if i != j and not any(crosses(rectangle, cx, cy, ox, oy).any() for rectangle in obstacles):
                    known[i] = min(known[i], known[j] + hypot(cx - ox, cy - oy))
    best = straight_out(x, y, rim, obstacles)
    for (cx, cy), onward in zip(corners, known, strict=True):
        away = np.hypot(x - cx, y - cy) + onward
        shorter = away < best
        for rectangle in obstacles:
            shorter &= ~crosses(rectangle, x, y, cx, cy)
        best = np.where(shorter, away, best)
    return best


def table(cells: int) -> Case:
    """16 m of soil on a site with open borders and three obstacles: h = k times the geodesic distance to the edge.

    The edge is where the ground outside begins: at the centres of the cells beyond the border.
    """
    grid = site(cells)
    solid = np.zeros((cells, cells), bool)
    for west, south, east, north in OBSTACLES:
        rows, cols = (slice(round(a / grid.cell), round(b / grid.cell)) for a, b in ((south, north), (west, east)))
        solid[rows, cols] = True
    exact = averages(lambda x, y: SLOPE * way_out(x, y, grid.cell / 2), grid)
    exact[solid] = 0.0
    start = np.where(solid, 0.0, HIGH)
    return Case(grid, start, exact, float(exact.sum()), solid=solid, outside=0.0, seen=~solid)
