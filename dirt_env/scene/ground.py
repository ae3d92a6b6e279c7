"""Ground made by a rule: flat, mounds, a ridge, rough ground. Heights in metres, the lowest at 0 or above."""

from dataclasses import dataclass
from functools import lru_cache
from math import cos, pi, radians, sin
from typing import ClassVar

import numpy as np

from dirt_env.scene.layout import centres
from dirt_env.sim.params import Grid

Span = tuple[float, float]
GENTLE = 0.9  # rough ground is at most this share as steep as the soil can stand


@dataclass(frozen=True)
class Flat:
    """Level ground at height 0."""

    kind: ClassVar[str] = "flat"

    def make(self, grid: Grid, slope: float, rng: np.random.Generator) -> np.ndarray:
        """Height [rows, cols] m."""
        return np.zeros((grid.rows, grid.cols))

    def steepest(self) -> float:
        """Bound of the slope, a tangent."""
        return 0.0


@dataclass(frozen=True)
class Mounds:
    """Round mounds H cos^2(pi d / 2 R) at random places; where they meet, the higher one counts.

    `count` (least, most), `height` and `radius` (least, most) m; `seed`: the same mounds in every episode.
    """

    count: tuple[int, int] = (6, 6)
    height: Span = (0.2, 0.5)
    radius: Span = (2.0, 4.0)
    seed: int | None = None
    kind: ClassVar[str] = "mounds"

    def make(self, grid: Grid, slope: float, rng: np.random.Generator) -> np.ndarray:
        """Height [rows, cols] m."""
        x, y = centres(grid)
        result = np.zeros((grid.rows, grid.cols))
        for _ in range(rng.integers(self.count[0], self.count[1] + 1)):
            at = rng.uniform((0, 0), (grid.cols * grid.cell, grid.rows * grid.cell))
            top, radius = rng.uniform(*self.height), rng.uniform(*self.radius)
            share = np.minimum(np.hypot(x - at[0], y - at[1]) / radius, 1.0)
            np.maximum(result, top * np.cos(pi / 2 * share) ** 2, out=result)
        return result

    def steepest(self) -> float:
        """Bound of the slope, a tangent: pi H / (2 R)."""
        return pi / 2 * self.height[1] / self.radius[0]


@dataclass(frozen=True)
class Ridge:
    """A straight ridge H cos^2(pi d / width) across the site; d is the distance to its line.

    The line goes through `center` [x, y] m (default: the site's), `angle` degrees counter-clockwise from east.
    """

    height: Span = (0.5, 0.5)
    width: float = 8.0
    center: tuple[float, float] | None = None
    angle: float = 90.0
    seed: int | None = None
    kind: ClassVar[str] = "ridge"

    def make(self, grid: Grid, slope: float, rng: np.random.Generator) -> np.ndarray:
        """Height [rows, cols] m."""
        x, y = centres(grid)
        at = self.center or (grid.cols * grid.cell / 2, grid.rows * grid.cell / 2)
        across = (y - at[1]) * cos(radians(self.angle)) - (x - at[0]) * sin(radians(self.angle))
        return rng.uniform(*self.height) * np.cos(pi * np.minimum(np.abs(across) / self.width, 0.5)) ** 2

    def steepest(self) -> float:
        """Bound of the slope, a tangent: pi H / width."""
        return pi * self.height[1] / self.width


@dataclass(frozen=True)
class Rough:
    """A smooth random field: cubic B-splines over random numbers `length` m apart, `height` m from valley to peak.

    It is made lower where it would be steeper than 0.9 of what the soil can stand.
    """

    height: Span = (0.3, 0.3)
    length: float = 4.0
    seed: int | None = None
    kind: ClassVar[str] = "rough"

    def make(self, grid: Grid, slope: float, rng: np.random.Generator) -> np.ndarray:
        """Height [rows, cols] m."""
        rows, cols = _splines(grid.rows, grid.cell / self.length), _splines(grid.cols, grid.cell / self.length)
        field = rows @ rng.standard_normal((rows.shape[1], cols.shape[1])) @ cols.T
        field -= field.min()
        if not field.any():
            return field
        field *= rng.uniform(*self.height) / field.max()
        if _bound(field, grid.cell) <= GENTLE * slope:
            return field
        return field * min(1.0, GENTLE * slope / steepest(field, grid.cell))

    def steepest(self) -> float:
        """Bound of the slope, a tangent: the field is made to keep to the soil's own."""
        return 0.0


def steepest(height: np.ndarray, cell: float) -> float:
    """Largest slope over a face between two cells, a tangent."""
    return float(face_slopes(height, cell).max(initial=0.0))


def _bound(height: np.ndarray, cell: float) -> float:
    """A quick upper bound of `steepest`."""
    return float(np.hypot(*(np.abs(np.diff(height, axis=axis)).max(initial=0.0) for axis in (0, 1))) / cell)


def face_slopes(height: np.ndarray, cell: float) -> np.ndarray:
    """Slopes over all faces between cells, tangents [faces]: sqrt(dn^2 + dt^2) / cell; faces of NaN cells are left out.

    `dn` is the difference over the face, `dt` the mean of the four differences along it around the face.
    """
    found = []
    for field in (height, height.T):
        padded = np.pad(field, ((1, 1), (0, 0)), mode="edge")
        along = np.nan_to_num((padded[2:] - padded[:-2]) / 4)
        found.append(np.hypot(np.diff(field, axis=1), along[:, :-1] + along[:, 1:]).ravel() / cell)
    slopes = np.concatenate(found)
    return slopes[np.isfinite(slopes)]


@lru_cache(maxsize=32)
def _splines(count: int, spacing: float) -> np.ndarray:
    """Cubic B-spline weights of `count` cell centres, `spacing` knots apart, over their knots [count, knots]."""
    at = (np.arange(count) + 0.5) * spacing
    knots = np.arange(int(at[-1]) + 4) - 1
    t = np.abs(at[:, None] - knots[None, :])
    near = 2 / 3 - t**2 + t**3 / 2
    far = np.maximum(2 - t, 0.0) ** 3 / 6
    return np.where(t < 1, near, far)
