"""The whole site for a policy: an overview in coarse squares around the machine, and the map cell by cell."""

from math import cos, sin

import numpy as np

from dirt_env.sim.jit import kernel
from dirt_env.task.kinds import GOAL, SOLID, least_todo, todo

OVERVIEW = 12  # squares along one side
MAP_LIMIT = 1000.0  # m
CHUNK = 16  # cells of a row that are skipped together where there is neither soil to move nor a goal


@kernel
def fill_overview(height, job, pose, cell, view, overview):
    """Soil to move (of all soil) and goal (of all goal cells) in squares around the machine, its heading up.

    What lies beyond the outermost squares counts to them, so that nothing is out of sight. A cell no more than
    `view.doubt` above its aim is left out, for errors of measurement would add up to soil where there is none.
    """
    if overview is None:
        return
    overview[:] = 0.0
    _add_cells(
        height, job.target, job.aim, job.kind, np.float32(view.doubt), pose.x / cell, pose.y / cell, pose.heading,
        cell / view.overview_cell, cell * cell / job.soil, overview,
    )  # fmt: skip
    goal = overview[1].sum()
    for i in range(overview.shape[1]):
        for j in range(overview.shape[2]):
            overview[0, i, j] = min(overview[0, i, j], 4.0)
            overview[1, i, j] /= max(goal, 1.0)


@kernel
def _add_cells(height, target, aim, kind, doubt, x, y, heading, step, volume, overview):
    """Add up soil to move, a cell's height of which is `volume`, and goal cells in squares of 1 / `step` cells."""
    rows, cols = height.shape
    east, north = cos(heading) * step, sin(heading) * step
    last = overview.shape[1] - 1
    for r in range(rows):
        for c0 in range(0, cols, CHUNK):
            c1 = min(c0 + CHUNK, cols)
            if not _has_any(height[r, c0:c1], aim[r, c0:c1], doubt):
                continue
            for c in range(c0, c1):
                if height[r, c] - aim[r, c] <= doubt:
                    continue
                dx, dy = c + 0.5 - x, r + 0.5 - y
                i = int(min(max(0.5 * (last + 1) - dx * east - dy * north, 0.0), float(last)))
                j = int(min(max(0.5 * (last + 1) + dx * north - dy * east, 0.0), float(last)))
                if kind[r, c] & GOAL:
                    overview[1, i, j] += np.float32(1.0)
                else:
                    overview[0, i, j] += (height[r, c] - target[r, c]) * volume


@kernel
def _has_any(height, aim, doubt):
    """Whether any of these cells is over the aim beyond doubt; those in a goal are."""
    count = 0
    for c in range(height.shape[0]):
        count += height[c] - aim[c] > doubt
    return count > 0


@kernel
def fill_map(height, job, site):
    """Height over the datum, what is to do, and walls if there is a third channel; row 0 in the south."""
    if site is None:
        return
    for r in range(height.shape[0]):
        _fill_height(height[r], site[0, r])
        _fill_todo(height[r], job.aim[r], job.kind[r], job.limit, job.goal_depth, site[1, r])
        if site.shape[0] > 2:
            _fill_walls(job.kind[r], site[2, r])


@kernel
def _fill_height(height, out):
    for c in range(out.shape[0]):
        out[c] = min(max(float(height[c]), -MAP_LIMIT), MAP_LIMIT)


@kernel
def _fill_todo(height, aim, kind, limit, goal_depth, out):
    for c in range(out.shape[0]):
        out[c] = todo(max(height[c] - aim[c], least_todo(kind[c], limit)), limit, goal_depth)


@kernel
def _fill_walls(kind, out):
    for c in range(out.shape[0]):
        out[c] = 1.0 if kind[c] & SOLID else 0.0
