"""Layouts written down in the scene: fixed regions, with heaps, layers and digging in them."""

import warnings
from dataclasses import dataclass
from functools import lru_cache
from math import radians
from typing import NamedTuple

import numpy as np

from dirt_env.scene import pose as poses
from dirt_env.scene.design import Design
from dirt_env.scene.distance import distance_inside
from dirt_env.scene.ground import Flat, Mounds, Ridge, Rough, face_slopes
from dirt_env.scene.heaps import capacity, cone_radius, heap, heap_limit, layer
from dirt_env.scene.layout import Layout, Setting, soil_above
from dirt_env.scene.obstacles import Obstacle, solid_cells
from dirt_env.scene.regions import Region, rasterize
from dirt_env.scene.survey import HeightFile
from dirt_env.sim.params import Grid

Ground = Flat | Mounds | Ridge | Rough | HeightFile
Span = tuple[float, float]


@dataclass(frozen=True)
class Start:
    """A region the soil is taken from, and how much, by exactly one of three; each a least and a largest value.

    `volume`: a heap of so many m3 at repose. `depth`: a layer of loose soil, m. `dig`: down from the ground, m.
    `shift`: how far it may lie from its place in an episode of a scene that varies, either way in x and y, m.
    """

    region: Region
    volume: Span | None = None
    depth: Span | None = None
    dig: Span | None = None
    shift: Span = (0.0, 0.0)

    @property
    def amount(self) -> Span:
        """The one of the three that is given."""
        return next(span for span in (self.volume, self.depth, self.dig) if span is not None)


@dataclass(frozen=True)
class Goal:
    """A region the soil is to be brought to; `shift` as that of a `Start`."""

    region: Region
    shift: Span = (0.0, 0.0)


@dataclass(frozen=True)
class Hollow:
    """A hole in the ground from the start: `depth` (least, most) m deep over a region, its sides at repose."""

    region: Region
    depth: Span


class Plan(NamedTuple):
    """What does not change from one episode to the next. Masks are bool [rows, cols]."""

    setting: Setting
    ground: Ground
    starts: tuple[Start, ...]
    design: Design | None
    regions: tuple[np.ndarray, ...]  # one of each start
    sources: tuple[tuple[float, float], ...]  # where each start's heap is poured out, x, y m
    start: np.ndarray
    goal: np.ndarray
    solid: np.ndarray | None
    free: np.ndarray | None  # [n, 2] m; where a machine placed at random may stand
    hollows: tuple[tuple[Span, np.ndarray], ...]  # depth m and region of each


def plan(
    setting: Setting,
    ground: Ground,
    starts: tuple[Start, ...],
    goals: tuple[Goal, ...],
    design: Design | None,
    obstacles: tuple[Obstacle, ...],
    anywhere: bool = False,
    hollows: tuple[Hollow, ...] = (),
) -> Plan:
    """Rasterised regions and obstacles, checked against one another; `anywhere`: the machine begins at random."""
    grid = setting.grid
    solid = solid_cells(obstacles, grid, walled(ground, grid))
    regions = tuple(_open(start.region, setting, solid, f"start[{i}].region") for i, start in enumerate(starts))
    none = np.zeros((grid.rows, grid.cols), dtype=bool)
    goal_regions = [_open(goal.region, setting, solid, f"goal[{i}].region") for i, goal in enumerate(goals)]
    design_region = () if design is None else (rasterize(design.region, grid, "design.region"),)
    holes = [_open(hollow.region, setting, solid, f"hollow[{i}].region") for i, hollow in enumerate(hollows)]
    _check_apart(starts, regions, goal_regions, design_region, holes, grid.cell)
    start, goal = (np.any([none, *masks], axis=0) for masks in (regions, goal_regions))
    sources = tuple(middle(mask, grid.cell) for mask in regions)
    taken = start | goal if solid is None else start | goal | solid
    free = poses.free_cells(setting, taken) if anywhere else None
    depths = (hollow.depth for hollow in hollows)
    pits = tuple(zip(depths, holes, strict=True))
    return Plan(setting, ground, starts, design, regions, sources, start, goal, solid, free, pits)


def lay_out(plan: Plan, pose: tuple[float, float, float] | str, rng: np.random.Generator) -> Layout:
    """One episode's layout; `pose` is x m, y m, heading in degrees, or "behind", or "random"."""
    setting, grid = plan.setting, plan.setting.grid
    ground, datum = make_ground(plan.ground, setting, rng)
    whole = ground
    for depth, hole in plan.hollows:
        ground = ground - layer(hole, grid, float(rng.uniform(*depth)), setting.slope, plan.solid)
    height, target, design = ground.copy(), ground.copy(), None
    if plan.design:
        survey = plan.ground if isinstance(plan.ground, HeightFile) else None
        target, design = plan.design.surface(ground, whole, grid, setting.slope, datum, plan.solid, survey)
    for start, region, source in zip(plan.starts, plan.regions, plan.sources, strict=True):
        amount = float(rng.uniform(*start.amount))
        if start.volume:
            height = heap(height, grid, source, amount, setting.slope, plan.solid)
        elif start.depth:
            height += layer(region, grid, amount, setting.slope, plan.solid)
        else:
            target -= layer(region, grid, amount, setting.slope, plan.solid)
    soil = soil_above(height, target, plan.goal, grid.cell)
    at = _pose(plan, pose, height, target, rng)
    solid = None if plan.solid is None else plan.solid.copy()
    return Layout(height, target, plan.start.copy(), plan.goal.copy(), design, solid, at, datum, soil, ground.copy())


def check(plan: Plan, pose: tuple[float, float, float] | str) -> None:
    """Errors for a heap that leaves its region or a machine without room; a warning for a goal that is too small, or a
    design that asks for more soil than there is.
    """
    setting, grid = plan.setting, plan.setting.grid
    for index, (start, region, source) in enumerate(zip(plan.starts, plan.regions, plan.sources, strict=True)):
        if start.volume:
            ground, _ = make_ground(plan.ground, setting, np.random.default_rng(0))
            most = heap_limit(ground, grid, source, setting.slope, region, plan.solid)
            if start.volume[1] > most * (1 + 1e-9):
                raise ValueError(
                    f"start[{index}].volume is {start.volume[1]:g} m3, a heap that at repose reaches "
                    f"{cone_radius(start.volume[1], setting.slope):.2f} m from ({source[0]:.2f}, {source[1]:.2f}); "
                    f"allowed: at most {most:.2f} m3 in its region{_steepness(ground, setting)}"
                )
    if isinstance(pose, tuple):
        poses.check(setting, (pose[0], pose[1], radians(pose[2])), plan.solid, "machine.pose")
    elif pose == "random" and not len(plan.free):
        raise ValueError(
            f'machine.pose is "random" and no cell has {setting.radius:.2f} m of free room about it; '
            "allowed: a larger site, or a given pose"
        )
    layout = lay_out(plan, pose, np.random.default_rng(0))
    if not layout.soil > 0:
        raise ValueError("the scene has 0 m3 of soil to move; allowed: > 0 m3 above the target outside the goal")
    if pose == "behind":
        poses.check(setting, layout.pose, plan.solid, 'machine.pose "behind"')
    if plan.goal.any():
        _warn_if_full(plan, layout)
    if layout.design is not None:
        _warn_if_short(plan, layout)


def _steepness(ground: np.ndarray, setting: Setting) -> str:
    """Words about ground[rows, cols] m on which no soil stays; none where it is not steeper than repose."""
    steepest = float(face_slopes(ground, setting.grid.cell).max(initial=0.0))
    if steepest <= setting.slope:
        return ""
    return f"; the ground has slopes of up to {steepest:.3g}, repose is {setting.slope:.3g}: are its heights in metres?"


def make_ground(ground: Ground, setting: Setting, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Height of the ground [rows, cols] m and its datum m; one that has a seed is the same in every episode."""
    if isinstance(ground, HeightFile):
        survey = ground.survey(setting.grid)
        return survey.height, survey.datum
    if getattr(ground, "seed", None) is not None:
        return _make_seeded(ground, setting.grid, setting.slope), 0.0
    return ground.make(setting.grid, setting.slope, rng), 0.0


@lru_cache(maxsize=8)
def _make_seeded(ground: Ground, grid: Grid, slope: float) -> np.ndarray:
    """Ground that is the same in every episode; not to be written to."""
    height = ground.make(grid, slope, np.random.default_rng(ground.seed))
    height.setflags(write=False)
    return height


def walled(ground: Ground, grid) -> np.ndarray | None:
    """Cells without data that count as walls, bool [rows, cols], or None."""
    return ground.survey(grid).missing if isinstance(ground, HeightFile) and ground.nodata == "wall" else None


def middle(mask: np.ndarray, cell: float) -> tuple[float, float]:
    """The centroid of a region, x, y m, or the cell deepest inside it if its centroid is not."""
    row, col = np.nonzero(mask)
    y, x = float(row.mean() + 0.5), float(col.mean() + 0.5)
    if not mask[min(int(y), mask.shape[0] - 1), min(int(x), mask.shape[1] - 1)]:
        y, x = np.add(np.unravel_index(distance_inside(mask, cell).argmax(), mask.shape), 0.5)
    return float(x) * cell, float(y) * cell


def _open(region: Region, setting: Setting, solid: np.ndarray | None, key: str) -> np.ndarray:
    """Cells of a region that are not solid; an error if none is left."""
    mask = rasterize(region, setting.grid, key)
    if solid is None:
        return mask
    if not (mask & ~solid).any():
        raise ValueError(f"{key} has {int(mask.sum())} cells, all of them solid; allowed: at least one open cell")
    return mask & ~solid


def _check_apart(starts: tuple[Start, ...], regions, goals, design, hollows, cell: float) -> None:
    """An error if regions share cells but ask for two things; goals may overlap, heaps may lie in a design."""
    named = [(f"start[{i}].region", mask) for i, mask in enumerate(regions)]
    goal_named = [(f"goal[{i}].region", mask) for i, mask in enumerate(goals)]
    design_named = [("design.region", mask) for mask in design]
    pairs = [(one, other) for i, one in enumerate(named) for other in named[:i] + goal_named]
    pairs += [(one, (f"hollow[{i}].region", mask)) for one in named for i, mask in enumerate(hollows)]
    pairs += [(one, other) for start, one in zip(starts, named, strict=True) if start.dig for other in design_named]
    pairs += [(one, other) for one in design_named for other in goal_named]
    for (key, mask), (other, other_mask) in pairs:
        shared = int((mask & other_mask).sum())
        if shared:
            raise ValueError(f"{key} and {other} share {shared} cells ({shared * cell**2:g} m2); allowed: none")


def _pose(plan: Plan, pose, height, target, rng: np.random.Generator) -> tuple[float, float, float]:
    if isinstance(pose, tuple):
        return pose[0], pose[1], radians(pose[2])
    if pose == "random":
        x, y = plan.free[rng.integers(len(plan.free))]
        return float(x), float(y), float(rng.uniform(-np.pi, np.pi))
    source = plan.regions[0] if plan.regions else height > target + 1e-6
    sink = plan.goal if plan.goal.any() else height < target - 1e-6
    if not sink.any() or not source.any():
        sink, source = ~plan.start, (source if source.any() else ~sink)
    return poses.behind(plan.setting, source, sink)


def _warn_if_full(plan: Plan, layout: Layout) -> None:
    """Warns if the soil does not fit into the goals and the design's hollows."""
    fill = _fill(plan, layout)
    room = capacity(plan.goal, plan.setting.grid, plan.setting.slope, plan.solid)
    if layout.soil > room + fill:
        warnings.warn(
            f"the goal holds {room + fill:.1f} m3 at repose, but there are {layout.soil:.1f} m3 to move; "
            "make the goal larger or the soil less",
            stacklevel=6,
        )


def _warn_if_short(plan: Plan, layout: Layout) -> None:
    """Warns if a design takes more than twice the soil there is to move: it may be too high, or in other units."""
    fill = _fill(plan, layout)
    if fill > 2.0 * layout.soil:
        warnings.warn(
            f"the design takes {fill:.1f} m3 of fill, but there are {layout.soil:.1f} m3 to move: the rest has to be "
            "dug out beside it, or the design is too high",
            stacklevel=6,
        )


def _fill(plan: Plan, layout: Layout) -> float:
    """What the ground takes up to its target outside the goals, m3: what the target has above the ground."""
    return soil_above(layout.target, layout.height, plan.goal, plan.setting.grid.cell)
