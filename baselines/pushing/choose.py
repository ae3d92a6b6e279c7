"""SELECT: which soil to push next, from where, and whereto."""

from itertools import pairwise
from math import atan2, hypot
from typing import NamedTuple

import numpy as np

from dirt_env.task.haul import haul_distance

from .assign import assign
from .drive import wrap
from .parameters import Pushing
from .route import Point, is_clear, way
from .site import Site
from .worth import Candidates, Worth

MOST = 200  # cells looked at as the first of a push
SLANTS = (0.0, 0.3, -0.3, 0.6, -0.6, 0.9, -0.9, 1.2, -1.2, 1.5, -1.5)  # rad; off the straight line, where that is shut
ASIDE = (0.0, 0.16, -0.16, 0.32, -0.32, 0.48, -0.48)  # of the blade's width; how far its middle may pass the first soil
BEND = 0.3  # rad; more is a sharp bend
FADING = 0.25  # least share of `min_height` that is looked for when nothing higher is left


class Push(NamedTuple):
    """One push: its `first` soil, the pivot's `approach` and `heading` [rad], the blade's `way` to its aim."""

    first: Point
    approach: Point
    heading: float
    way: list[Point]

    @property
    def aim(self) -> Point:
        """Where the soil is to go."""
        return self.way[-1]


def choose(site: Site, numbers: Pushing, failed: list[Point], worth: Worth, most: int = 1) -> list[Push]:
    """The pushes that are worth most now, best first, at most `most`, away from where one has just `failed`.

    Only one of those that begin within half a blade's width of each other is in it; none are if all is done.
    """
    places = destinations(site, numbers)
    excess = np.where(site.solid, 0.0, site.excess)
    share = 1.0
    while share >= FADING and places:
        cells = np.nonzero(excess > share * numbers.min_height)
        found = candidates(site, numbers, places, cells, failed) if len(cells[0]) else None
        if found is not None:
            return [_push(site, numbers, found, i) for i in _apart(site, found, worth(site, numbers, found), most)]
        share *= 0.5
    return []


def _apart(site: Site, found: Candidates, worth: np.ndarray, most: int) -> list[int]:
    """The best candidates, at most `most`, whose first soils are apart."""
    chosen: list[int] = []
    left = worth.copy()
    while len(chosen) < most and (best := int(left.argmax())) not in chosen and np.isfinite(left[best]):
        chosen.append(best)
        left[np.hypot(*(found.first - found.first[best]).T) < 0.5 * site.blade.width] = -np.inf
    return chosen


def destinations(site: Site, numbers: Pushing) -> list[np.ndarray]:
    """Cells to aim at, bool [row, col], one mask for each goal; or the cells of a design where soil is missing."""
    places = [goal & (site.depth >= min(numbers.inset, 0.6 * site.depth[goal].max())) for goal in site.goals]
    if not places:
        lacking = site.fill > FADING * numbers.min_height
        places = [lacking] if lacking.any() else []
    return places


def candidates(site: Site, numbers: Pushing, places: list[np.ndarray], cells, failed: list[Point]) -> Candidates | None:
    """Every push that can be begun from one of the `cells` (rows, columns), or from some if there are many; or None."""
    shut = site.gap < 0.5 * site.blade.width + numbers.clearance
    walls = shut if site.solid.any() else None
    cost = np.stack([haul_distance(place, walls, site.grid.cell)[cells] for place in places], axis=1)
    goal = assign(cost, site.excess[cells] * site.grid.cell**2, site.room() if site.goals else np.ones(1))
    some = np.unique(np.linspace(0, len(goal) - 1, MOST).astype(int))
    rows, cols, goal = cells[0][some], cells[1][some], goal[some]
    first = np.stack([site.x[rows, cols], site.y[rows, cols]], axis=1)
    aim = _aims(site, numbers, places, first, goal)
    if site.solid.any() or site.walled:
        first = _beside_walls(site, numbers, first, aim)
    approach, ahead, good = _approaches(site, numbers, first, aim)
    for place in failed:
        good &= np.hypot(*(first - place).T) > site.blade.width / 2
    if not good.any():
        return None
    return Candidates(*(part[good] for part in (first, aim, cost[some, goal], approach, ahead)))


def _aims(site: Site, numbers: Pushing, places: list[np.ndarray], first: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Where each push ends, [n, 2]: the nearest cell of its goal's place, moved on towards the middle."""
    aim = np.empty_like(first)
    for index, place in enumerate(places):
        mine = goal == index
        if mine.any():
            spots = np.stack([site.x[place], site.y[place]], axis=1)
            far = ((first[mine, None] - spots[None]) ** 2).sum(axis=2)
            aim[mine] = spots[far.argmin(axis=1)]
            if site.goals:
                aim[mine] += numbers.centre * (spots.mean(axis=0) - aim[mine])
            else:
                aim[mine] = _through(site, first[mine], spots, aim[mine])
    return aim


def _through(site: Site, first: np.ndarray, spots: np.ndarray, nearest: np.ndarray) -> np.ndarray:
    """Aims of pushes that level a design: the last of the `spots` [m, 2] that lack soil in the lane before each push,

    which runs from where there is too much to where there is too little; or the `nearest` if there is none. Soil then
    falls into the hollows on its way.
    """
    east, north = _balance(site)
    along, across = spots @ (east, north), spots @ (-north, east)
    ahead = along[None] - (first @ (east, north))[:, None]
    aside = np.abs(across[None] - (first @ (-north, east))[:, None])
    last = np.where((ahead > 0.0) & (aside <= 0.5 * site.blade.width), ahead, 0.0).max(axis=1)
    return np.where(last[:, None] > 0.0, first + last[:, None] * (east, north), nearest)


def _balance(site: Site) -> tuple[float, float]:
    """Unit vector from the middle of the soil that is too much to the middle of that which is missing."""
    middles = [
        (float((soil * site.x).sum() / soil.sum()), float((soil * site.y).sum() / soil.sum()))
        for soil in (site.excess, site.fill)
    ]
    (x0, y0), (x1, y1) = middles
    length = max(hypot(x1 - x0, y1 - y0), 1e-9)
    return (x1 - x0) / length, (y1 - y0) / length


def _beside_walls(site: Site, numbers: Pushing, first: np.ndarray, aim: np.ndarray) -> np.ndarray:
    """Where the blade's middle begins each push [n, 2]: on the first soil, or so far beside it that it passes walls."""
    begin, open_way = first.copy(), np.zeros(len(first), bool)
    for share in ASIDE:
        way = aim - first
        left = np.stack([-way[:, 1], way[:, 0]], axis=1) / np.maximum(np.hypot(*way.T), 1e-9)[:, None]
        at = first + share * site.blade.width * left
        fits = _is_open_lane(site, numbers, at, aim) & ~open_way
        begin[fits] = at[fits]
        open_way |= fits
    return begin


def _is_open_lane(site: Site, numbers: Pushing, begin: np.ndarray, aim: np.ndarray) -> np.ndarray:
    """Whether the blade passes walls and the site's border from `begin` to `aim`, bool [n]."""
    length = np.maximum(np.hypot(*(aim - begin).T), 1e-9)
    unit = (aim - begin) / length[:, None]
    half = 0.5 * site.blade.width + 0.25 * numbers.clearance
    fits = np.ones(len(begin), bool)
    if site.walled:
        ends = begin[:, 0] - half * np.abs(unit[:, 1]), begin[:, 1] - half * np.abs(unit[:, 0])
        east, north = site.extent
        fits &= (np.minimum(*ends) >= 0.0) & (begin[:, 0] + half * np.abs(unit[:, 1]) <= east)
        fits &= begin[:, 1] + half * np.abs(unit[:, 0]) <= north
    if site.solid.any():
        dx, dy = site.x[site.solid][None] - begin[:, :1], site.y[site.solid][None] - begin[:, 1:]
        along, across = dx * unit[:, :1] + dy * unit[:, 1:], dy * unit[:, :1] - dx * unit[:, 1:]
        met = (np.abs(across) < half + 0.5 * site.grid.cell) & (along > -numbers.back_off)
        fits &= ~(met & (along < length[:, None] + site.grid.cell)).any(axis=1)
    return fits


def _approaches(site: Site, numbers: Pushing, first: np.ndarray, aim: np.ndarray):
    """Start of each push: pivot [n, 2], heading [n, 2], whether it can turn there; straight behind if possible."""
    straight = np.arctan2(aim[:, 1] - first[:, 1], aim[:, 0] - first[:, 0])
    approach, ahead = np.zeros_like(first), np.zeros_like(first)
    good = np.zeros(len(first), bool)
    for slant in SLANTS:
        unit = np.stack([np.cos(straight + slant), np.sin(straight + slant)], axis=1)
        at = first - numbers.back_off * unit
        fits = has_room(site, at) & ~good
        approach[fits], ahead[fits] = at[fits], unit[fits]
        good |= fits
    return approach, ahead, good


def has_room(site: Site, at: np.ndarray) -> np.ndarray:
    """Whether the machine can turn on the spot at points [n, 2] m, bool [n]."""
    size, radius = np.array(site.extent), site.turning_radius
    row, col = (np.clip(at[:, k] // site.grid.cell, 0, site.gap.shape[1 - k] - 1).astype(int) for k in (1, 0))
    return ((at >= radius) & (at <= size - radius)).all(axis=1) & (site.gap[row, col] >= site.turning_room)


def _push(site: Site, numbers: Pushing, found: Candidates, i: int) -> Push:
    """The i-th candidate with its way."""
    first, approach, aim = (tuple(map(float, part[i])) for part in (found.first, found.approach, found.aim))
    shut = site.gap < 0.5 * site.blade.width + numbers.clearance
    points = (way(shut, site.grid.cell, first, aim) if site.solid.any() else None) or [aim]
    points = points[: _bend(first, points)]
    heading = atan2(found.ahead[i, 1], found.ahead[i, 0])
    if len(points) > 1 and is_clear(shut, site.grid.cell, approach, points[0]):
        heading = atan2(points[0][1] - approach[1], points[0][0] - approach[0])
    leg = _leg_along_border(site, numbers, first, points[0]) if site.walled else []
    return Push(first, approach, heading, [first, *leg, *points])


def _leg_along_border(site: Site, numbers: Pushing, begin: Point, aim: Point) -> list[Point]:
    """Where a push that begins beside the border leaves it: past the soil along it, which a straight one misses."""
    (x, y), (east, north), reach = begin, site.extent, site.blade.width
    borders = (x, site.x), (east - x, east - site.x), (y, site.y), (north - y, north - site.y)
    beside = min(borders, key=lambda border: border[0])
    if beside[0] > 0.5 * site.blade.width + site.grid.cell:
        return []
    parallel_x = beside[0] in (y, north - y)
    way, along = (aim[0] - x, site.x - x) if parallel_x else (aim[1] - y, site.y - y)
    along = along if way > 0.0 else -along
    there = (beside[1] < 0.5 * reach) & (along > 0.0) & (along < abs(way)) & (site.excess > numbers.min_height)
    far = float(along[there].max()) if there.any() else 0.0
    if far < 0.5 * reach:
        return []
    step = far if way > 0.0 else -far
    return [(x + step, y) if parallel_x else (x, y + step)]


def _bend(first: Point, points: list[Point]) -> int:
    """How many way points there are up to the first sharp bend: soil is pushed round that in two goes."""
    course = [atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise([first, *points])]
    turns = [abs(wrap(b - a)) > BEND for a, b in pairwise(course)]
    return turns.index(True) + 1 if True in turns else len(points)


def layer(site: Site, push: Push, most: float) -> float:
    """How far over the target the edge stays [m], so that a push takes at most `most` m3 off what is on its way."""
    x, y, length = push.first[0], push.first[1], distance(push.first, push.aim)
    east, north = (push.aim[0] - x) / max(length, 1e-9), (push.aim[1] - y) / max(length, 1e-9)
    along, across = (site.x - x) * east + (site.y - y) * north, (site.y - y) * east - (site.x - x) * north
    lane = (np.abs(across) <= 0.5 * site.blade.width) & (along >= -site.grid.cell) & (along <= length)
    soil = np.sort(site.excess[lane & (site.excess > 0.0)])[::-1] * site.grid.cell**2
    if not len(soil) or soil.sum() <= most:
        return 0.0
    # Above the level of the i-th highest cell lies sum(soil[:i]) - i * soil[i]; linear in between.
    above = np.cumsum(soil) - np.arange(1, len(soil) + 1) * soil
    i = int(np.searchsorted(above, most))
    return float((soil[:i].sum() - most) / max(i, 1)) / site.grid.cell**2


def distance(a: Point, b: Point) -> float:
    """Metres between two points."""
    return hypot(a[0] - b[0], a[1] - b[1])
