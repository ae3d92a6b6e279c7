"""Written layouts that differ from episode to episode: shifted together and one by one, and mirrored."""

from dataclasses import dataclass, replace
from itertools import combinations
from math import pi
from typing import NamedTuple

import numpy as np

from dirt_env.scene import fixed
from dirt_env.scene import pose as poses
from dirt_env.scene.design import Design
from dirt_env.scene.fixed import Goal, Ground, Hollow, Start
from dirt_env.scene.ground import Ridge
from dirt_env.scene.layout import Layout, Setting
from dirt_env.scene.obstacles import Obstacle, solid_cells
from dirt_env.scene.regions import Region, rasterize
from dirt_env.scene.zone import zone_map

Span = tuple[float, float]
ATTEMPTS = 200


@dataclass(frozen=True)
class Vary:
    """How the episodes of a scene with written regions differ.

    `shift`: regions, obstacles and a ridge lie together up to so far from their places, either way in x and y, m.
    `mirror`: half of the layouts are mirrored from east to west, and half of them from north to south.
    """

    shift: Span = (0.0, 0.0)
    mirror: bool = True


class Parts(NamedTuple):
    """What a scene has written down. `pose`: x m, y m, heading in degrees, or "behind", or "random". `zones`: where
    other soils lie.
    """

    ground: Ground
    starts: tuple[Start, ...]
    goals: tuple[Goal, ...]
    design: Design | None
    obstacles: tuple[Obstacle, ...]
    hollows: tuple[Hollow, ...]
    pose: tuple[float, float, float] | str
    zones: tuple[Region, ...] = ()


def lay_out(parts: Parts, vary: Vary, setting: Setting, rng: np.random.Generator) -> Layout:
    """One episode's layout; raises ValueError if no places are found where nothing is in the way of anything."""
    for _ in range(ATTEMPTS):
        ways = [rng.uniform(-1.0, 1.0, 2) for _ in range(1 + len(parts.starts) + len(parts.goals))]
        moved = shifted(parts, vary, setting, ways)
        if _collide(moved, setting):
            continue
        layout = _lay_out(moved, setting, rng)
        if layout.solid is None or not poses.touches(setting, layout.pose, layout.solid):
            flips = rng.integers(0, 2, 2) if vary.mirror else (0, 0)
            return mirrored(layout, setting, bool(flips[0]), bool(flips[1]))
    raise ValueError(
        f"vary finds no place in {ATTEMPTS} attempts where the shifted starts and goals are clear of one another, "
        "of hollows and of obstacles, and the machine too; allowed: smaller shifts, or regions further apart"
    )


def shifted(parts: Parts, vary: Vary, setting: Setting, ways) -> Parts:
    """All parts moved by shares [-1, 1] of their shifts: ways[0] (x, y) for all, then one for each start and goal."""
    together = ways[0] * np.array(vary.shift)
    by = (float(together[0]), float(together[1]))
    own = [_moved_alone(part, together, way) for part, way in zip(parts.starts + parts.goals, ways[1:], strict=True)]
    ground, pose = parts.ground, parts.pose
    if isinstance(ground, Ridge):
        x, y = ground.center or (setting.size[0] / 2, setting.size[1] / 2)
        ground = replace(ground, center=(x + by[0], y + by[1]))
    if isinstance(pose, tuple):
        pose = pose[0] + by[0], pose[1] + by[1], pose[2]
    return Parts(
        ground,
        tuple(own[: len(parts.starts)]),
        tuple(own[len(parts.starts) :]),
        parts.design and replace(parts.design, region=parts.design.region.moved(by)),
        tuple(obstacle.moved(by) for obstacle in parts.obstacles),
        tuple(replace(hollow, region=hollow.region.moved(by)) for hollow in parts.hollows),
        pose,
        tuple(zone.moved(by) for zone in parts.zones),
    )


def check(parts: Parts, vary: Vary, setting: Setting) -> None:
    """Raises ValueError for what a largest shift would take out of the site."""
    count = 1 + len(parts.starts) + len(parts.goals)
    for ends in ((-1.0, -1.0), (1.0, 1.0)):
        moved = shifted(parts, vary, setting, np.tile(ends, (count, 1)))
        named = [(f"start[{i}]", start.region) for i, start in enumerate(moved.starts)]
        named += [(f"goal[{i}]", goal.region) for i, goal in enumerate(moved.goals)]
        named += [(f"hollow[{i}]", hollow.region) for i, hollow in enumerate(moved.hollows)]
        named += [("design", moved.design.region)] if moved.design else []
        named += [(f"zone[{i}]", zone) for i, zone in enumerate(moved.zones)]
        for key, region in named:
            rasterize(region, setting.grid, f"{key}.region, shifted as far as it may be,")
        solid_cells(moved.obstacles, setting.grid)


def mirrored(layout: Layout, setting: Setting, east_west: bool, north_south: bool) -> Layout:
    """The layout as seen in a mirror, along either axis."""
    steps = slice(None, None, -1 if north_south else 1), slice(None, None, -1 if east_west else 1)
    arrays = {
        name: np.ascontiguousarray(value[steps]) for name, value in layout._asdict().items() if np.ndim(value) == 2
    }
    (x, y, heading), (width, depth) = layout.pose, setting.size
    if east_west:
        x, heading = width - x, pi - heading
    if north_south:
        y, heading = depth - y, -heading
    return layout._replace(pose=(x, y, heading), **arrays)


def _moved_alone(part: Start | Goal, together: np.ndarray, way: np.ndarray) -> Start | Goal:
    x, y = together + way * np.array(part.shift)
    return replace(part, region=part.region.moved((float(x), float(y))))


def _collide(parts: Parts, setting: Setting) -> bool:
    """Whether starts, goals or heaps and hollows share cells, or what is shifted alone shares some with an obstacle."""
    grid = setting.grid
    starts, goals = ([part.region.mask(grid) for part in group] for group in (parts.starts, parts.goals))
    solid = solid_cells(parts.obstacles, grid, fixed.walled(parts.ground, grid))
    alone = [mask for part, mask in zip(parts.starts + parts.goals, starts + goals, strict=True) if any(part.shift)]
    pairs = [*combinations(starts, 2), *((start, goal) for start in starts for goal in goals)]
    pairs += [(start, hollow.region.mask(grid)) for start in starts for hollow in parts.hollows]
    pairs += [] if solid is None else [(mask, solid) for mask in alone]
    return any((one & other).any() for one, other in pairs)


def _lay_out(parts: Parts, setting: Setting, rng: np.random.Generator) -> Layout:
    plan = fixed.plan(
        setting, parts.ground, parts.starts, parts.goals, parts.design, parts.obstacles, parts.pose == "random",
        parts.hollows,
    )  # fmt: skip
    if parts.pose == "random" and not len(plan.free):
        raise ValueError(f'machine.pose is "random" and no cell has {setting.radius:.2f} m of free room about it')
    return fixed.lay_out(plan, parts.pose, rng)._replace(zone=zone_map(parts.zones, setting.grid))
