"""The job of one episode: where soil is welcome, what it weighs where it is not, and where the goals lie."""

from typing import NamedTuple

import numpy as np

from dirt_env.sim.jit import kernel
from dirt_env.task.haul import haul_distance

OUTSIDE, GOAL, STRAY, DESIGN, SOLID = 1, 2, 4, 8, 16
"""Bits of `Job.kind`: outside the goal; in it; outside goal, start and design; in the design region; wall."""

HUGE = float(np.float32(1e30))  # m; no ground is as high


class Job(NamedTuple):
    """Constants of one episode for the kernels.

    `target` f4[rows, cols] m: soil above it is misplaced outside the goal. `aim` f4[rows, cols] m: the same for the
    observation, but -HUGE in goals, where any soil is welcome, and HUGE in walls, where there is nothing to do. `haul`
    f4[rows, cols] m: way to the goal, 0 in it and in walls. `kind` u1[rows, cols]: bits as above; no cell is solid and
    anything else. `centers` f8[n, 2] m: x, y of the goals.

    `mean_haul` m: way that missing soil is taken to come. `missing` m3: what goal and design lack at the start. `soil`
    m3: soil to move. `design_cells`: their number, 0 if the job has no design. `goal_depth`, `limit` m: what the
    observation says is missing in a goal, and its bound elsewhere.
    """

    target: np.ndarray
    aim: np.ndarray
    haul: np.ndarray
    kind: np.ndarray
    centers: np.ndarray
    mean_haul: float
    missing: float
    soil: float
    design_cells: float
    goal_depth: float
    limit: float


@kernel
def least_todo(kind, limit):
    """Lower bound of what is to do in a cell of that kind [m]: only a design asks for soil (a goal: see `todo`)."""
    return np.float32(-limit) if kind & DESIGN else np.float32(0.0)


@kernel
def todo(over, limit, goal_depth):
    """What is to do in a cell [m], from its height over the aim, cut off below by `least_todo`: soil to take away."""
    return -goal_depth if over > 0.5 * HUGE else min(float(over), limit)


def make_job(ground: np.ndarray, layout, cell: float, goal_depth: float, limit: float) -> Job:
    """Job of a layout (see `dirt_env.scene.layout`) on ground[rows, cols], the settled start of the simulator [m].

    `goal_depth` [m] is what the observation says is missing in the goal, `limit` [m] its bound elsewhere.
    """
    solid = np.zeros(layout.goal.shape, bool) if layout.solid is None else layout.solid
    design = np.zeros_like(solid) if layout.design is None else layout.design & ~solid
    target = _settled_target(ground, layout, design)
    off = ground.astype(np.float64) - target
    lacking = design & (off < 0.0)
    goal = layout.goal & ~solid
    if not goal.any() and not lacking.any():  # a pit and no word of where its soil should go: anywhere else
        goal = ~design & ~solid
    outside = ~goal & ~solid
    haul = haul_distance(goal | lacking, layout.solid, cell)
    haul[design] = np.maximum(haul[design], cell)  # too much soil in a fill is not in place either
    haul *= outside
    excess = np.where(outside, np.maximum(off, 0.0), 0.0)
    kind = outside * OUTSIDE + goal * GOAL + solid * SOLID
    kind += (outside & ~layout.start & ~design) * STRAY + (design & outside) * DESIGN
    return Job(
        target=target.astype(np.float32),
        aim=np.where(goal, -HUGE, np.where(solid, HUGE, target)).astype(np.float32),
        haul=haul.astype(np.float32),
        kind=kind.astype(np.uint8),
        centers=_goal_centers(goal, lacking, design, cell),
        mean_haul=float((excess * haul).sum() / excess.sum()) if excess.any() else cell,
        missing=float(-off[goal | (lacking & outside)].sum() * cell * cell),
        soil=float(layout.soil),
        design_cells=0.0 if layout.design is None else float(max((design & outside).sum(), 1)),
        goal_depth=float(goal_depth),
        limit=float(limit),
    )


def _settled_target(ground: np.ndarray, layout, design: np.ndarray) -> np.ndarray:
    """Target [m], moved with the ground where that has settled, so that untouched ground is never misplaced soil."""
    follows = ground - (layout.height - layout.target)
    return np.where(design, layout.target, follows)


def _goal_centers(goal: np.ndarray, lacking: np.ndarray, design: np.ndarray, cell: float) -> np.ndarray:
    """Centres x, y [m] of the goal regions, else of the fill, else of the design; f8[n, 2]."""
    if goal.any():
        parts = list(_connected(goal))
    else:
        parts = [next((cells for cells in (lacking, design) if cells.any()), np.ones_like(goal))]
    return np.array([_center(part, cell) for part in parts])


def _center(region: np.ndarray, cell: float) -> tuple[float, float]:
    """Centroid x, y [m] of the region, or where that lies outside of it, the middle of the region's nearest cell."""
    row, col = np.nonzero(region)
    middle_row, middle_col = row.mean(), col.mean()
    if not region[int(middle_row + 0.5), int(middle_col + 0.5)]:
        i = np.argmin((row - middle_row) ** 2 + (col - middle_col) ** 2)
        middle_row, middle_col = row[i], col[i]
    return (middle_col + 0.5) * cell, (middle_row + 0.5) * cell


def _connected(region: np.ndarray):
    """Connected parts (over edges) of a mask, from south to north."""
    rest = region.copy()
    while rest.any():
        part = np.zeros_like(rest)
        part.flat[np.argmax(rest)] = True
        size = 0
        while size != (size := int(part.sum())):
            for axis in (0, 1):
                part |= _fill_along(part, rest, axis)
        yield part
        rest &= ~part


def _fill_along(part: np.ndarray, region: np.ndarray, axis: int) -> np.ndarray:
    """Part grown along an axis, both ways, as far as the region goes."""
    grown = part.copy()
    for view, mask in ((grown, region), (np.flip(grown, axis), np.flip(region, axis))):
        lines, cells = (np.moveaxis(array, axis, 0) for array in (view, mask))
        for i in range(1, len(lines)):
            lines[i] |= lines[i - 1] & cells[i]
    return grown
