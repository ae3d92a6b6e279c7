"""Random layouts: heaps, goal, machine and obstacles that leave one another room. Six levels."""

from dataclasses import dataclass
from math import pi
from typing import NamedTuple

import numpy as np

from dirt_env.scene.fixed import Ground, make_ground
from dirt_env.scene.ground import Rough
from dirt_env.scene.heaps import cone_radius, heap
from dirt_env.scene.layout import Layout, Setting, centres, soil_above
from dirt_env.scene.obstacles import Post, solid_cells
from dirt_env.scene.pose import touches

Span = tuple[float, float]
ATTEMPTS = 200  # beginnings of a layout, each with a new goal
CANDIDATES = 64  # places tried for each thing in one of them


@dataclass(frozen=True)
class Sampler:
    """Ranges (least, most) of a random layout. Lengths in m, volumes in m3."""

    level: int = 1
    heaps: tuple[int, int] = (1, 1)  # number of heaps
    volume: Span = (8.0, 15.0)  # of each heap
    haul: Span = (6.0, 14.0)  # from a heap's middle to the goal's
    machine: str = "anywhere"  # or "behind" the first heap
    rough: Span = (0.0, 0.0)  # unevenness of the ground, valley to peak; added to [ground]
    rough_length: float = 5.0  # between its valleys and peaks
    obstacles: tuple[int, int] = (0, 0)  # number of posts
    obstacle_radius: Span = (0.5, 1.0)
    goal_radius: Span = (3.0, 3.5)  # at least; a goal grows until it has room
    room: float = 2.0  # what the goal holds at repose, over the soil there is
    back_off: float = 3.0  # from a heap's foot to the machine's pivot when it comes to push
    lane: float = 2.5  # free of obstacles on either side of the line from a heap to the goal


LEVELS = (
    Sampler(level=0, volume=(6.0, 10.0), haul=(6.0, 7.0), goal_radius=(2.5, 3.0), machine="behind"),
    Sampler(level=1),
    Sampler(level=2, heaps=(2, 3), volume=(6.0, 10.0)),
    Sampler(level=3, heaps=(2, 3), volume=(6.0, 10.0), rough=(0.2, 0.4)),
    Sampler(level=4, heaps=(4, 6), volume=(4.0, 7.0), rough=(0.2, 0.4)),
    Sampler(level=5, heaps=(2, 3), volume=(6.0, 10.0), rough=(0.2, 0.4), obstacles=(2, 4)),
)


class Draft(NamedTuple):
    """Where things are in one random layout; places are x, y in m."""

    goal: np.ndarray  # [2]
    goal_radius: float
    heaps: np.ndarray  # [n, 2]
    radii: np.ndarray  # [n] feet of the heaps
    volumes: np.ndarray  # [n] m3
    pose: tuple[float, float, float]
    posts: tuple[Post, ...]


def sample(sampler: Sampler, setting: Setting, ground: Ground, rng: np.random.Generator) -> Layout:
    """A random layout; an error if nothing suits after many attempts."""
    for _ in range(ATTEMPTS):
        draft = _draft(sampler, setting, rng)
        if draft is None:
            continue
        layout = _build(draft, sampler, setting, ground, rng)
        if layout.solid is None or not touches(setting, layout.pose, layout.solid):  # a post's cells are wider than it
            return layout
    width, depth = setting.size
    raise ValueError(
        f"layout finds no place in {ATTEMPTS} attempts on a site of {width:g} m x {depth:g} m for "
        f"{sampler.heaps[1]} heaps of up to {sampler.volume[1]:g} m3 (radius "
        f"{cone_radius(sampler.volume[1], setting.slope):.1f} m), with haul {list(sampler.haul)} m and "
        f"{sampler.obstacles[1]} obstacles; allowed: a larger site, less soil, a longer haul, or a smaller back_off "
        f"than {sampler.back_off:g} m"
    )


def _draft(sampler: Sampler, setting: Setting, rng: np.random.Generator) -> Draft | None:
    """One attempt: goal, heaps, machine, obstacles, in this order."""
    count = rng.integers(sampler.heaps[0], sampler.heaps[1] + 1)
    volumes = rng.uniform(*sampler.volume, count)
    radii = cone_radius(volumes, setting.slope) + 2 * sampler.rough[1]
    needed = cone_radius(sampler.room * volumes.sum(), setting.slope)
    goal_radius = max(float(rng.uniform(*sampler.goal_radius)), needed)
    size = np.array(setting.size)
    if (2 * goal_radius + 2 * setting.grid.cell > size).any():
        return None
    margin = goal_radius + setting.grid.cell
    goal = rng.uniform(margin, size - margin)
    heaps = _heaps(sampler, setting, goal, goal_radius, radii, rng)
    if heaps is None:
        return None
    pose = _machine(sampler, setting, goal, goal_radius, heaps, radii, rng)
    if pose is None:
        return None
    posts = _posts(sampler, setting, goal, goal_radius, heaps, radii, pose, rng)
    return None if posts is None else Draft(goal, goal_radius, heaps, radii, volumes, pose, posts)


def _heaps(sampler, setting, goal, goal_radius, radii, rng) -> np.ndarray | None:
    """Places of the heaps [n, 2]: clear of one another, with room for the machine behind each; or None."""
    size, gap = np.array(setting.size), setting.grid.cell
    places, backs = np.empty((0, 2)), np.empty((0, 2))
    for index, radius in enumerate(radii):
        least = max(sampler.haul[0], goal_radius + radius + gap)
        if least > sampler.haul[1]:
            return None
        haul, angle = rng.uniform(least, sampler.haul[1], CANDIDATES), rng.uniform(-pi, pi, CANDIDATES)
        away = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        at = goal + haul[:, None] * away
        back = at + (radius + sampler.back_off) * away
        good = _inside(at, radius, size) & _inside(back, setting.tracks_radius, size)
        good &= (_apart(at, places) >= radius + radii[:index] + gap).all(axis=1)
        good &= (_apart(back, places) >= setting.tracks_radius + radii[:index]).all(axis=1)
        good &= (_apart(at, backs) >= setting.tracks_radius + radius).all(axis=1)
        if not good.any():
            return None
        first = good.argmax()
        places, backs = np.vstack([places, at[first]]), np.vstack([backs, back[first]])
    return places


def _machine(sampler, setting, goal, goal_radius, heaps, radii, rng) -> tuple[float, float, float] | None:
    """Pose behind the first heap, or anywhere clear of the heaps and the goal; or None."""
    if sampler.machine == "behind":
        x, y = _behind(sampler, goal, heaps, radii)[0]
        return float(x), float(y), float(np.arctan2(goal[1] - y, goal[0] - x))
    size = np.array(setting.size)
    if (size < 2 * setting.radius).any():
        return None
    at = rng.uniform(setting.radius, size - setting.radius, (CANDIDATES, 2))
    good = (_apart(at, heaps) >= setting.radius + radii).all(axis=1)
    good &= np.hypot(*(at - goal).T) >= setting.radius + goal_radius
    heading = float(rng.uniform(-pi, pi))
    return (*map(float, at[good.argmax()]), heading) if good.any() else None


def _posts(sampler, setting, goal, goal_radius, heaps, radii, pose, rng) -> tuple[Post, ...] | None:
    """Posts that the machine can pass on every side, clear of heaps, goal, machine and the straight ways; or None."""
    size, around = np.array(setting.size), 2 * setting.radius
    backs = _behind(sampler, goal, heaps, radii)
    posts: list[Post] = []
    for _ in range(rng.integers(sampler.obstacles[0], sampler.obstacles[1] + 1)):
        radius = float(rng.uniform(*sampler.obstacle_radius))
        if (size < 2 * (radius + around)).any():
            return None
        at = rng.uniform(radius + around, size - radius - around, (CANDIDATES, 2))
        good = np.hypot(*(at - goal).T) >= radius + goal_radius + setting.grid.cell
        good &= np.hypot(at[:, 0] - pose[0], at[:, 1] - pose[1]) >= radius + setting.radius
        good &= (_apart(at, heaps) >= radius + radii + setting.grid.cell).all(axis=1)
        good &= (_apart(at, backs) >= radius + setting.radius).all(axis=1)
        good &= (_from_ways(at, backs, goal) >= radius + sampler.lane).all(axis=1)
        for post in posts:
            good &= np.hypot(*(at - post.center).T) >= radius + post.radius + around
        if not good.any():
            return None
        x, y = at[good.argmax()]
        posts.append(Post((float(x), float(y)), radius))
    return tuple(posts)


def _build(draft: Draft, sampler: Sampler, setting: Setting, ground: Ground, rng: np.random.Generator) -> Layout:
    """Arrays of a drafted layout."""
    grid = setting.grid
    target, datum = make_ground(ground, setting, rng)
    if sampler.rough[1] > 0:
        target = target + Rough(sampler.rough, sampler.rough_length).make(grid, setting.slope, rng)
    height = target
    x, y = centres(grid)
    start = np.zeros((grid.rows, grid.cols), dtype=bool)
    for at, radius, volume in zip(draft.heaps, draft.radii, draft.volumes, strict=True):
        height = heap(height, grid, (float(at[0]), float(at[1])), float(volume), setting.slope)
        start |= (x - at[0]) ** 2 + (y - at[1]) ** 2 <= radius**2
    goal = (x - draft.goal[0]) ** 2 + (y - draft.goal[1]) ** 2 <= draft.goal_radius**2
    start |= (height > target) & ~goal
    solid = solid_cells(draft.posts, grid)
    soil = soil_above(height, target, goal, grid.cell)
    return Layout(height, target.copy(), start, goal, None, solid, draft.pose, datum, soil, target.copy())


def _behind(sampler: Sampler, goal: np.ndarray, heaps: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Pivot's place behind each heap as seen from the goal [n, 2]."""
    away = heaps - goal
    away = away / np.hypot(*away.T)[:, None]
    return heaps + (radii + sampler.back_off)[:, None] * away


def _inside(at: np.ndarray, margin: float, size: np.ndarray) -> np.ndarray:
    return ((at >= margin) & (at <= size - margin)).all(axis=1)


def _apart(at: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Distances [len(at), len(others)]."""
    return np.hypot(at[:, None, 0] - others[None, :, 0], at[:, None, 1] - others[None, :, 1])


def _from_ways(at: np.ndarray, backs: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Distances [len(at), len(backs)] to the straight ways from behind each heap to the goal's middle."""
    way = goal - backs
    share = np.einsum("ijk,jk->ij", at[:, None] - backs[None], way) / (way**2).sum(axis=1)
    nearest = backs[None] + np.clip(share, 0, 1)[..., None] * way[None]
    return np.hypot(*np.moveaxis(at[:, None] - nearest, -1, 0))
