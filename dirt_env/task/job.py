"""The job of one episode: where soil is welcome, what it weighs where it is not, and where the goals lie."""

from typing import NamedTuple

import numpy as np

from dirt_env.task.haul import haul_distance


class Job(NamedTuple):
    """Constants of one episode for the kernels; arrays are f4[rows, cols] unless a shape is given.

    `target` [m]: soil above it is misplaced outside the goal. `haul` [m]: way to the goal, 0 in it and in walls.
    `outside`, `goal`, `stray`, `design`: 1 where a cell is outside the goal; in it; outside goal, start and design; in
    the design region (None if there is none). `low`, `high` [m]: bounds of what is to do in a cell (see observation).
    `solid`: bool, walls (None if there are none). `centers` f8[n, 2] x, y of the goals [m]. `mean_haul` [m]: way that
    missing soil is taken to come. `missing` [m3]: what goal and design lack at the start. `soil` [m3]: soil to move.
    """

    target: np.ndarray
    haul: np.ndarray
    outside: np.ndarray
    goal: np.ndarray
    stray: np.ndarray
    design: np.ndarray | None
    low: np.ndarray
    high: np.ndarray
    solid: np.ndarray | None
    centers: np.ndarray
    mean_haul: float
    missing: float
    soil: float
    design_cells: float


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
    f4 = np.float32
    return Job(
        target=target.astype(f4),
        haul=haul.astype(f4),
        outside=outside.astype(f4),
        goal=goal.astype(f4),
        stray=(outside & ~layout.start & ~design).astype(f4),
        design=None if layout.design is None else (design & outside).astype(f4),
        low=np.where(goal, -goal_depth, np.where(design, -limit, 0.0)).astype(f4),
        high=np.where(goal, -goal_depth, np.where(solid, 0.0, limit)).astype(f4),
        solid=layout.solid,
        centers=_goal_centers(goal, lacking, design, cell),
        mean_haul=float((excess * haul).sum() / excess.sum()) if excess.any() else cell,
        missing=float(-off[goal | (lacking & outside)].sum() * cell * cell),
        soil=float(layout.soil),
        design_cells=float(max((design & outside).sum(), 1)),
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
