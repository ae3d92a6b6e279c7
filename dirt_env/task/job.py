"""The job of one episode: where soil is welcome, what it weighs where it is not, and where the goals lie."""

from typing import NamedTuple

import numpy as np

from dirt_env.task.haul import haul_distance
from dirt_env.task.kinds import set_targets, weigh_cells
from dirt_env.task.region_centres import middle_of, region_centres


class Job(NamedTuple):
    """Constants of one episode for the kernels.

    `target` f4[rows, cols] m: soil above it is misplaced outside the goal. `aim` f4[rows, cols] m: the same for the
    observation, but -HUGE in goals, where any soil is welcome, and HUGE in walls, where there is nothing to do. `haul`
    f4[rows, cols] m: way to the goal, 0 in it and in walls. `kind` u1[rows, cols]: bits of `dirt_env.task.kinds`.
    `centers` f8[n, 2] m: x, y of the goals.

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


def make_job(ground: np.ndarray, layout, cell: float, goal_depth: float, limit: float, swell: float = 0.0) -> Job:
    """Job of a layout (see `dirt_env.scene.layout`) on ground[rows, cols], the settled start of the simulator [m].

    `goal_depth` [m] is what the observation says is missing in the goal, `limit` [m] its bound elsewhere. Where the
    soil has a `swell`, `missing` and `soil` are m3 of bank soil.
    """
    shape = ground.shape
    none = np.zeros(shape, bool)
    solid, design = (none if mask is None else mask for mask in (layout.solid, layout.design))
    target, wanted, welcome = np.empty(shape), np.empty(shape, bool), np.empty(shape, bool)
    counts = set_targets(ground, layout.height, layout.target, design, layout.goal, solid, target, wanted, welcome)
    haul = haul_distance(welcome, layout.solid, cell)
    kind, aim, sums = np.empty(shape, np.uint8), np.empty(shape, np.float32), np.empty(4)
    weigh_cells(ground, target, wanted, layout.start, design, solid, cell, haul, kind, aim, sums)
    way, excess, missing, design_cells = sums.tolist()
    return Job(
        target=target.astype(np.float32),
        aim=aim,
        haul=haul.astype(np.float32),
        kind=kind,
        centers=_centers(counts, wanted, welcome, design, cell),
        mean_haul=way / excess if excess > 0.0 else cell,
        missing=missing * cell * cell / (1.0 + swell),
        soil=_bank_soil(layout, cell, swell) if swell > 0.0 else float(layout.soil),
        design_cells=0.0 if layout.design is None else max(design_cells, 1.0),
        goal_depth=float(goal_depth),
        limit=float(limit),
    )


def _bank_soil(layout, cell: float, swell: float) -> float:
    """The layout's soil to move as bank soil [m3]: heaps and layers are loose, what is to be dug is not."""
    over = np.where(layout.goal, 0.0, np.maximum(layout.height - layout.target, 0.0))
    undisturbed = np.clip(layout.ground - layout.target, 0.0, over)
    return float((undisturbed + (over - undisturbed) / (1.0 + swell)).sum() * cell**2)


def _centers(counts: tuple[int, int], wanted: np.ndarray, welcome: np.ndarray, design: np.ndarray, cell: float):
    """Centres x, y [m] of the goal's regions, else of the fill, else of the design; f8[n, 2]."""
    goals, lacks = counts
    if goals:
        return region_centres(wanted, cell)
    return middle_of(welcome if lacks else design if design.any() else np.ones_like(design), cell)
