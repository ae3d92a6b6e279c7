"""Whether the machine's outline is clear of everything solid, and what it does where its wish would touch it."""

from math import cos, sin

import numpy as np

from .drive import wrap
from .site import Site

LOOKS = 3  # poses looked at within a step
MARGINS = (0.1, 0.05, 0.0)  # m; how much wider and longer than it is the machine is taken to be, if it can

ROOM = 1.0  # m; more of it is not better
TURNS = (0.0, 0.5, -0.5, 1.0, -1.0)
WAYS_OUT = [(steering, speed) for speed in (-0.5, 0.5, -1.0, 1.0, 0.0) for steering in TURNS if steering or speed]


class Body:
    """The outline of blade and tracks as points ahead and left of the pivot, two in every cell."""

    def __init__(self, site: Site) -> None:
        self._site = site
        self._outlines = [_outline(site, margin) for margin in MARGINS]

    def _fits(self, outline: np.ndarray, x: float, y: float, heading: float) -> bool:
        """Whether an outline [2, n] lies inside the site and clear of solid cells, its pivot at (x, y)."""
        site, (ahead, left) = self._site, outline
        east, north = cos(heading), sin(heading)
        c = np.floor((x + ahead * east - left * north) / site.grid.cell).astype(int)
        r = np.floor((y + ahead * north + left * east) / site.grid.cell).astype(int)
        if c.min() < 0 or r.min() < 0 or c.max() >= site.grid.cols or r.max() >= site.grid.rows:
            return False
        return not site.solid[r, c].any()

    def _is_free(self, outline: np.ndarray, steering: float, speed: float) -> bool:
        """Whether the next step with these shares of yaw rate and speed touches nothing."""
        pose, machine, period = self._site.pose, self._site.machine, self._site.period
        for share in np.arange(1, LOOKS + 1) / LOOKS:
            turn = steering * machine.yaw_rate * period * share
            go, middle = speed * machine.speed * period * share, pose["heading"] + 0.5 * turn
            x, y = pose["x"] + go * cos(middle), pose["y"] + go * sin(middle)
            if not self._fits(outline, x, y, wrap(pose["heading"] + turn)):
                return False
        return True

    def near_wall(self) -> bool:
        """Whether something solid is so near that a step may touch it."""
        site, (x, y) = self._site, (self._site.pose["x"], self._site.pose["y"])
        reach = site.turning_radius + site.machine.speed * site.period + site.grid.cell
        east, north = site.extent
        return min(x, y, east - x, north - y) < reach or site.gap[site.cell_at(x, y)] < reach

    def allowed(self, steering: float, speed: float) -> tuple[float, float]:
        """(steering, speed) as wished if free; else half of it or straight on; else what leads away from walls."""
        if not self.near_wall():
            return steering, speed
        pose = self._site.pose
        here = pose["x"], pose["y"], pose["heading"]
        outline = next((outline for outline in self._outlines if self._fits(outline, *here)), self._outlines[-1])
        for way in ((steering, speed), (0.5 * steering, 0.5 * speed), (0.0, speed), (0.0, 0.4 * speed)):
            if way != (0.0, 0.0) and self._is_free(outline, *way):
                return way
        free = [way for way in WAYS_OUT if self._is_free(outline, *way)]
        return max(free, key=lambda way: self._room(outline, *way)) if free else (steering, speed)

    def _room(self, outline: np.ndarray, steering: float, speed: float) -> float:
        """Least distance [m] of the outline from anything solid after a step, up to `ROOM`."""
        site, machine, pose = self._site, self._site.machine, self._site.pose
        turn = steering * machine.yaw_rate * site.period
        go, middle = speed * machine.speed * site.period, pose["heading"] + 0.5 * turn
        east, north = cos(pose["heading"] + turn), sin(pose["heading"] + turn)
        ahead, left = outline
        x = pose["x"] + go * cos(middle) + ahead * east - left * north
        y = pose["y"] + go * sin(middle) + ahead * north + left * east
        border = np.minimum(np.minimum(x, site.extent[0] - x), np.minimum(y, site.extent[1] - y))
        gap = site.gap[(y // site.grid.cell).astype(int), (x // site.grid.cell).astype(int)]
        return float(min(border.min(), gap.min(), ROOM))


def _outline(site: Site, margin: float) -> np.ndarray:
    """Points ahead and left of the pivot [2, n] of the blade, both tracks and the tail, `margin` m out from them."""
    blade, machine, step = site.blade, site.machine, 0.5 * site.grid.cell
    wide, long, half = 0.5 * machine.width + margin, 0.5 * machine.length + margin, 0.5 * blade.width + margin
    parts = [_line(blade.reach + margin, -half, blade.reach + margin, half, step)]
    parts += [_line(-long, side * wide, long, side * wide, step) for side in (-1.0, 0.0, 1.0)]
    parts.append(_line(-long, -wide, -long, wide, step))
    return np.concatenate(parts).T


def _line(s0: float, u0: float, s1: float, u1: float, step: float) -> np.ndarray:
    """Points [n, 2] of a segment, at most `step` m apart."""
    pieces = int(np.ceil(np.hypot(s1 - s0, u1 - u0) / step)) + 1
    return np.stack([np.linspace(s0, s1, pieces), np.linspace(u0, u1, pieces)], axis=1)
