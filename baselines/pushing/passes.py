"""Passes over a design surface: which straight lane the blade should go along, from where to where.

A pass is valued on the profile of its lane: what is too high is cut and carried, at most a blade full, and drops into
what is too low; what is left at the end stays as a pile. Its gain is the fall of the squared error over the lane.
"""

from math import ceil, cos, pi, sin
from typing import NamedTuple

import numpy as np

from .choose import Push, has_room
from .parameters import GradeParameters
from .route import Point
from .site import Site
from .worth import Candidates, time_there

HEADINGS = 12  # all round
LANES = 0.25  # of the blade's width from one lane to the next
STARTS = 2  # cells from one start to the next
AROUND = 2  # cells that a profile goes on beyond what is to do
SLIGHT = 0.02  # m; less is as it should be


class Lanes(NamedTuple):
    """Parallel lanes and their profiles."""

    heading: float  # rad
    along: np.ndarray  # [n] m of the profiles' points in the direction of the heading
    across: np.ndarray  # [lanes] m of the lanes to the left of it
    high: np.ndarray  # [lanes, n] m too much, mean over the blade's width
    low: np.ndarray  # [lanes, n] m missing
    high_squared: np.ndarray  # [lanes, n] m2
    low_squared: np.ndarray  # [lanes, n] m2
    open: np.ndarray  # [lanes, n] bool; nothing solid, and inside the site


def choose_passes(site: Site, numbers: GradeParameters, failed: list[Point], most: int = 1) -> list[Push]:
    """The passes with the largest gain per second, best first; none where nothing is worth one."""
    found = [_best_of(site, numbers, _lanes(site, 2 * pi * k / HEADINGS)) for k in range(HEADINGS)]
    begin, end, gain = (np.concatenate([part[i] for part in found]) for i in range(3))
    way = end - begin
    length = np.maximum(np.hypot(*way.T), 1e-9)
    ahead = way / length[:, None]
    approach = begin - numbers.back_off * ahead
    good = (gain > numbers.enough) & has_room(site, approach)
    for place in failed:
        good &= np.hypot(*(begin - place).T) > 0.5 * site.blade.width
    if not good.any():
        return []
    begin, end, gain, length, ahead, approach = (part[good] for part in (begin, end, gain, length, ahead, approach))
    there = time_there(site, Candidates(begin, end, length, approach, ahead))
    rate = gain / (numbers.overhead + there + length / (site.machine.speed * numbers.grading_speed))
    return [_push(begin[i], end[i], approach[i]) for i in np.argsort(-rate, kind="stable")[:most]]


def _push(begin: np.ndarray, end: np.ndarray, approach: np.ndarray) -> Push:
    first, aim, at = (tuple(map(float, point)) for point in (begin, end, approach))
    return Push(first, at, float(np.arctan2(aim[1] - first[1], aim[0] - first[0])), [first, aim])


def _lanes(site: Site, heading: float) -> Lanes:
    """Lanes of a heading that cover everything that is to do."""
    cell, width = site.grid.cell, site.blade.width
    todo = np.maximum(site.excess, site.fill) > SLIGHT
    east, north = cos(heading), sin(heading)
    s, u = site.x[todo] * east + site.y[todo] * north, site.y[todo] * east - site.x[todo] * north
    if not s.size:
        s = u = np.zeros(1)
    along = np.arange(s.min() - AROUND * cell, s.max() + (AROUND + 1) * cell, cell)
    across = np.arange(u.min(), u.max() + LANES * width, LANES * width)
    wide = (np.arange(ceil(2 * width / cell)) + 0.5) / ceil(2 * width / cell) * width - 0.5 * width
    left = (across[:, None] + wide)[:, None, :]
    x, y = along[None, :, None] * east - left * north, along[None, :, None] * north + left * east
    rows, cols = site.excess.shape
    row, col = np.floor(y / cell).astype(int), np.floor(x / cell).astype(int)
    inside = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
    row, col = np.clip(row, 0, rows - 1), np.clip(col, 0, cols - 1)
    high, low = site.excess[row, col] * inside, site.fill[row, col] * inside
    free = (inside & ~site.solid[row, col]).all(axis=2)
    squares = (high**2).mean(axis=2), (low**2).mean(axis=2)
    return Lanes(heading, along, across, high.mean(axis=2), low.mean(axis=2), *squares, free)


def _best_of(site: Site, numbers: GradeParameters, lanes: Lanes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Begin and end [lanes, 2] m of each lane's pass with the most gain per second of driving, and its gain [m4]."""
    cell, width, n = site.grid.cell, site.blade.width, len(lanes.along)
    starts = np.arange(0, n, STARTS)
    most = numbers.layer * site.rated / width  # m2, what the blade carries in its lane
    shape = len(lanes.across), len(starts)
    load, gain, shut = np.zeros(shape), np.zeros(shape), np.zeros(shape, bool)
    best, rate, last = np.zeros(shape), np.zeros(shape), np.zeros(shape, int)
    pace = site.machine.speed * numbers.grading_speed
    for i in range(n):
        on = (starts <= i)[None, :]
        high, low = lanes.high[:, i, None], lanes.low[:, i, None]
        cut = np.minimum(high * cell, most - load) * on
        left = 1.0 - cut / np.maximum(high * cell, 1e-12)
        gain += lanes.high_squared[:, i, None] * (1.0 - left**2) * cell
        load += cut
        filled = np.minimum(load, low * cell) * on
        left = 1.0 - filled / np.maximum(low * cell, 1e-12)
        gain += lanes.low_squared[:, i, None] * (1.0 - left**2) * cell
        load -= filled
        shut |= on & ~lanes.open[:, i, None]
        pile = 2.0 / 3.0 * load * np.sqrt(2.0 * load * site.soil.slope)
        value = np.where(on & ~shut, (gain - pile) * width, 0.0)
        speed = value / (numbers.overhead + np.maximum(i - starts, 0) * cell / pace)
        better = speed > rate
        best, rate, last = np.where(better, value, best), np.where(better, speed, rate), np.where(better, i, last)
    start = rate.argmax(axis=1)
    lane = np.arange(shape[0])
    return (
        _points(lanes, lanes.along[starts[start]] - 0.5 * cell),
        _points(lanes, lanes.along[last[lane, start]] + 0.5 * cell),
        best[lane, start],
    )


def _points(lanes: Lanes, along: np.ndarray) -> np.ndarray:
    """Points x, y [lanes, 2] m of the lanes, `along` [lanes] m in their direction."""
    east, north = cos(lanes.heading), sin(lanes.heading)
    return np.stack([along * east - lanes.across * north, along * north + lanes.across * east], axis=1)
