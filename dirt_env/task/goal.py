"""What is still to move: misplaced volume, and the potential whose fall is the work done."""

from math import sqrt
from typing import NamedTuple

import numpy as np

from dirt_env.sim.jit import entry, kernel
from dirt_env.task.job import Job

SUMS = 6


class Remaining(NamedTuple):
    """The state of a job.

    `potential` [m4] is misplaced volume times the way it has to go; `misplaced` [m3] lies above the target outside the
    goal; `moved` [m3] has come to where it belongs; `stray` [m3] is the part of `misplaced` that lies outside the start
    region too; `grade_error` [m] is the root mean square of height minus design, 0 in jobs without a design.
    """

    potential: float
    misplaced: float
    moved: float
    stray: float
    grade_error: float


class Gauge:
    """Measures a job; keeps partial sums per row, so that only the rows that changed are added up again."""

    def __init__(self, job: Job, cell: float) -> None:
        self._job = job
        self._cell = cell
        self._rows = np.zeros((job.target.shape[0], SUMS))
        self._result = np.zeros(len(Remaining._fields))

    def measure(self, height: np.ndarray, changed: np.ndarray | None = None) -> Remaining:
        """What is still to move of height[rows, cols].

        `changed` are the bounds r0, r1, c0, c1 of the cells that differ from those of the last call; None is all.
        """
        bounds = _everything(height) if changed is None else changed
        measure(height, self._job, self._cell, bounds, self._rows, self._result)
        return Remaining(*self._result.tolist())


def _everything(height: np.ndarray) -> np.ndarray:
    return np.array([0, height.shape[0], 0, height.shape[1]])


@entry
def measure(height, job, cell, changed, rows, result):
    """Add up the rows changed[0]:changed[1] of height[rows, cols], then all rows; fills result[5] (see Remaining)."""
    for r in range(changed[0], changed[1]):
        _add_row(height[r], job.target[r], job.haul[r], job.outside[r], job.stray[r], job.goal[r], rows[r])
    _add_design(height, job.target, job.design, changed, rows)
    haul = over = stray = gain = under = square = 0.0
    for r in range(height.shape[0]):
        haul += rows[r, 0]
        over += rows[r, 1]
        stray += rows[r, 2]
        gain += rows[r, 3]
        under += rows[r, 4]
        square += rows[r, 5]
    area = cell * cell
    result[0] = (haul + job.mean_haul * under) * area
    result[1] = over * area
    result[2] = max(0.0, min(gain * area + job.missing - under * area, job.soil - over * area))
    result[3] = stray * area
    result[4] = sqrt(square / job.design_cells)


@kernel
def _add_row(height, target, haul, outside, stray, goal, sums):
    """Sums over one row [cols]: soil above the target times its way, outside the goal, stray; gain in the goal."""
    way = over = astray = gain = 0.0
    for c in range(height.shape[0]):
        off = float(height[c]) - float(target[c])
        excess = max(off, 0.0)
        way += excess * haul[c]
        over += excess * outside[c]
        astray += excess * stray[c]
        gain += off * goal[c]
    sums[0] = way
    sums[1] = over
    sums[2] = astray
    sums[3] = gain


@kernel
def _add_design(height, target, design, changed, rows):
    """Sums over changed rows of the soil that the design lacks [m], and of the square of the error [m2]."""
    if design is None:
        return
    for r in range(changed[0], changed[1]):
        lack = square = 0.0
        for c in range(height.shape[1]):
            off = float(height[r, c]) - float(target[r, c])
            lack += max(-off, 0.0) * design[r, c]
            square += off * off * design[r, c]
        rows[r, 4] = lack
        rows[r, 5] = square
