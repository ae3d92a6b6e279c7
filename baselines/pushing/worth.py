"""What candidate pushes are worth, by two measures: farthest soil first, or soil times way in a second."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .parameters import Earning, Parameters
from .site import Site

SOIL = 0.01  # m; less above the target is nothing


class Candidates(NamedTuple):
    """Pushes to choose from, one in a row; x, y in m."""

    first: np.ndarray  # [n, 2]
    aim: np.ndarray  # [n, 2]
    haul: np.ndarray  # [n] m to the goal
    approach: np.ndarray  # [n, 2]
    ahead: np.ndarray  # [n, 2] unit vectors of the headings at the start


Worth = Callable[[Site, Any, Candidates], np.ndarray]


def farthest_first(site: Site, numbers: Parameters, found: Candidates) -> np.ndarray:
    """Worth [n] by the paper: a load, and more the farther from the goal it is, so that tails are gathered first."""
    volume, behind = swept(site, found)
    loads = volume / site.rated
    worth = np.minimum(loads, 1.0) - numbers.overload * np.maximum(loads - 1.0, 0.0)
    worth -= numbers.perch * behind / site.rated
    return worth + numbers.tail * found.haul - numbers.travel * time_there(site, found)


def gain_per_second(site: Site, numbers: Earning, found: Candidates) -> np.ndarray:
    """Worth [n] as volume times way that a push brings, in loads times m, by the seconds that it takes in all."""
    volume, behind = swept(site, found)
    length = np.hypot(*(found.aim - found.first).T)
    carried = np.minimum(volume / site.rated, numbers.carried)
    gain = carried * found.haul - numbers.perch * behind / site.rated
    seconds = numbers.overhead + time_there(site, found)
    seconds += length / (site.machine.speed * numbers.pace)
    return gain * (1.0 + numbers.far * found.haul) / seconds


def swept(site: Site, found: Candidates) -> tuple[np.ndarray, np.ndarray]:
    """Soil to move [m3] before the blade on its straight way to the aim, and behind it; [n] each."""
    r, c = np.nonzero(site.excess > SOIL)
    x, y, soil = site.x[r, c], site.y[r, c], site.excess[r, c] * site.grid.cell**2
    way = found.aim - found.first
    length = np.maximum(np.hypot(*way.T), 1e-9)
    east, north = (way / length[:, None]).T[:, :, None]
    dx, dy = x[None] - found.first[:, :1], y[None] - found.first[:, 1:]
    along, across = dx * east + dy * north, dy * east - dx * north
    behind = np.hypot(*(found.approach - found.first).T)[:, None] + 0.5 * site.machine.length
    lane = np.abs(across) <= 0.5 * site.blade.width
    before = lane & (along >= -site.grid.cell) & (along <= length[:, None])
    return before @ soil, (lane & (along < -site.grid.cell) & (along > -behind)) @ soil


def time_there(site: Site, found: Candidates) -> np.ndarray:
    """Seconds of turning and driving to each start, forward or in reverse, [n]."""
    pose, machine = site.pose, site.machine
    dx, dy = (found.approach - (pose["x"], pose["y"])).T
    far = np.hypot(dx, dy)
    course, end = np.arctan2(dy, dx), np.arctan2(found.ahead[:, 1], found.ahead[:, 0])
    turns = [
        np.abs(_wrap(course + reverse - pose["heading"])) + np.abs(_wrap(end - course - reverse))
        for reverse in (0.0, np.pi)
    ]
    return far / machine.speed + np.minimum(*turns) / machine.yaw_rate


def _wrap(angle: np.ndarray) -> np.ndarray:
    return (angle + np.pi) % (2 * np.pi) - np.pi
