"""The cutting edge: which height over the tracks holds it along the target, on the ground that will be there."""

from functools import lru_cache
from math import cos, sin
from typing import NamedTuple

import numpy as np

from .parameters import Pushing
from .site import Site

STATIONS = 5  # of the ground along the tracks; three across
LOOKS = 4  # places of a step's way at which the edge is foreseen
LEAST = 0.25  # m; how much of the way ahead is looked at in any case
TRIES = np.linspace(-1.0, 1.0, 17)  # heights that are tried, from as far down to as far up as the edge gets in a step


def blade_action(site: Site, edge: float) -> float:
    """The action `blade` that asks for an edge so high over the tracks [m], in either sense of `action.blade`."""
    machine, level = site.machine, _held_by_grade(site) if site.graded else 0.0
    if edge > level:
        return (edge - level) / max(machine.lift - level, 1e-9)
    return (edge - level) / max(machine.cut, 1e-9)


def _held_by_grade(site: Site) -> float:
    """Height over the tracks [m] at which grade control holds the edge on the target surface just now."""
    z, pitch, _ = _fit(site, site.height, np.zeros(1))[0]
    x, y = site.blade_at()
    return float(_bilinear(site, site.target, np.array([x]), np.array([y]))[0]) - z - pitch * site.blade.reach


class Strip(NamedTuple):
    """What the blade crosses next: cells (rows, cols), metres ahead and left of its middle."""

    rows: np.ndarray
    cols: np.ndarray
    ahead: np.ndarray
    left: np.ndarray


def strip_ahead(site: Site, way: float) -> Strip:
    """Cells that the blade crosses on its next `way` metres straight on."""
    blade, pose = site.blade, site.pose
    east, north = cos(pose["heading"]), sin(pose["heading"])
    x, y = site.blade_at()
    span = way + 0.5 * blade.width
    r0, c0 = site.cell_at(x - span, y - span)
    r1, c1 = site.cell_at(x + span, y + span)
    window = slice(r0, r1 + 1), slice(c0, c1 + 1)
    dx, dy = site.x[window] - x, site.y[window] - y
    ahead, left = dx * east + dy * north, dy * east - dx * north
    rows, cols = np.nonzero((ahead > 0.0) & (ahead <= way) & (np.abs(left) <= 0.5 * blade.width))
    return Strip(rows + r0, cols + c0, ahead[rows, cols], left[rows, cols])


def edge_for(site: Site, numbers: Pushing, way: float, rise: float, before: np.ndarray) -> tuple[float, float]:
    """Height over the tracks [m] to ask for in a step of `way` m, and how far from it the edge is then [m].

    The edge is to go along the target, `rise` m over it, but not over the soil to move that was there `before`
    (m, [row, col]).
    """
    way = max(way, LEAST)
    strip = strip_ahead(site, max(way, site.grid.cell))
    if not len(strip.rows):
        return site.pose["edge"], 0.0
    wanted = _levels(site, numbers, strip, way, rise, before)
    planes = _planes(site, strip, wanted, way)
    held = planes[:, 0] + planes[:, 1] * site.blade.reach + planes[:, 2] * float(strip.left.mean())
    edge, most = site.pose["edge"], site.machine.edge_rate * site.period
    asked = np.clip(edge + most * TRIES, -site.machine.cut, site.machine.lift)
    so_far = most * np.arange(1, LOOKS + 1) / LOOKS
    reached = edge + np.clip(asked[:, None] - edge, -so_far, so_far)
    off = held[None] + reached - wanted[None]
    best = int((off**2).sum(axis=1).argmin())
    return float(asked[best]), float(np.abs(wanted - held - edge).max())


def edge_behind(site: Site, numbers: Pushing, way: float) -> float:
    """Height over the tracks [m] at which the edge lies on the target after `way` m backwards."""
    pose, blade = site.pose, site.blade
    east, north = cos(pose["heading"]), sin(pose["heading"])
    ahead, left = blade.reach - way, blade.width * np.linspace(-0.5, 0.5, STATIONS)
    x, y = pose["x"] + ahead * east - left * north, pose["y"] + ahead * north + left * east
    z, pitch, _ = _fit(site, site.height, np.array([-way]))[0]
    return float(_bilinear(site, site.target, x, y).mean() + numbers.grade - z - pitch * blade.reach)


def _levels(site: Site, numbers: Pushing, strip: Strip, way: float, rise: float, before: np.ndarray) -> np.ndarray:
    """Height of the edge over the datum that is wanted at each look [LOOKS] m: between the targets' mean and lowest."""
    target = site.target[strip.rows, strip.cols]
    look = np.minimum((strip.ahead / way * LOOKS).astype(int), LOOKS - 1)
    count = np.bincount(look, minlength=LOOKS)
    mean = np.bincount(look, target, LOOKS) / np.maximum(count, 1)
    lowest = np.full(LOOKS, np.inf)
    np.minimum.at(lowest, look, target)
    bare = count == 0
    mean[bare], lowest[bare] = target.mean(), target.min()
    shave = numbers.rim if site.rim[strip.rows, strip.cols].any() else numbers.shave
    rise = min(rise, float(before[strip.rows, strip.cols].max()))
    return mean - shave * (mean - lowest) + numbers.grade + rise


def _planes(site: Site, strip: Strip, wanted: np.ndarray, way: float) -> np.ndarray:
    """(z, pitch, roll) of the ground under the tracks at each look [LOOKS, 3] if the blade cuts as `wanted`."""
    share = np.concatenate([[0.0], np.arange(1, LOOKS + 1) / LOOKS])
    if site.plane is None:
        site.plane = _fit(site, site.height, np.zeros(1))[0]
    now = site.plane
    edge = now[0] + now[1] * site.blade.reach + site.pose["edge"]
    cut = np.interp(strip.ahead / way, share, np.concatenate([[edge], wanted]))
    ground = site.height.copy()
    ground[strip.rows, strip.cols] = np.minimum(ground[strip.rows, strip.cols], cut)
    return _fit(site, ground, way * share[1:])


def _fit(site: Site, ground: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """(z, pitch, roll) of the plane through `ground` [row, col] under the tracks when they are `ways` [n] m on, [n, 3].

    What lies ahead of the blade does not bear them: the foremost stations look a little further back.
    """
    pose, machine = site.pose, site.machine
    east, north = cos(pose["heading"]), sin(pose["heading"])
    s, u, seen, s_squared, u_squared = _stations(machine.length, machine.width, site.blade.reach - site.grid.cell)
    along = seen[None] + ways[:, None]
    h = _bilinear(site, ground, pose["x"] + along * east - u * north, pose["y"] + along * north + u * east)
    return np.stack([h.mean(axis=1), h @ s / s_squared, h @ u / u_squared], axis=1)


@lru_cache(maxsize=16)
def _stations(length: float, width: float, foremost: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
    """Points under the tracks: m ahead [n], left [n], ahead where they look [n]; sums of squares of the first two."""
    s = np.repeat(length * np.linspace(-0.5, 0.5, STATIONS), 3)
    u = np.tile(width * np.linspace(-0.5, 0.5, 3), STATIONS)
    return s, u, np.minimum(s, foremost), (s**2).sum(), (u**2).sum()


def _bilinear(site: Site, ground: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Heights of `ground` [row, col] at points [m], between cell centres."""
    rows, cols = ground.shape
    column = np.minimum(np.maximum(x / site.grid.cell - 0.5, 0.0), cols - 1.001)
    row = np.minimum(np.maximum(y / site.grid.cell - 0.5, 0.0), rows - 1.001)
    c, r = column.astype(int), row.astype(int)
    fx, fy = column - c, row - r
    south = (1 - fx) * ground[r, c] + fx * ground[r, c + 1]
    north = (1 - fx) * ground[r + 1, c] + fx * ground[r + 1, c + 1]
    return (1 - fy) * south + fy * north
