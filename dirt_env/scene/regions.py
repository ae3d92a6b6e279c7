"""Regions of the site: circle, rectangle, polygon, mask image. A cell belongs to a region if its centre does."""

from dataclasses import dataclass, replace
from math import cos, radians, sin
from typing import ClassVar

import numpy as np

from dirt_env.scene.files import read_mask
from dirt_env.scene.layout import centres
from dirt_env.sim.params import Grid

Point = tuple[float, float]


@dataclass(frozen=True)
class Circle:
    """A disc: `center` [x, y] m and `radius` m."""

    center: Point
    radius: float
    kind: ClassVar[str] = "circle"

    def bounds(self) -> tuple[float, float, float, float]:
        """Least x, least y, largest x, largest y, m."""
        (x, y), r = self.center, self.radius
        return x - r, y - r, x + r, y + r

    def mask(self, grid: Grid) -> np.ndarray:
        """Cells of the disc, bool [rows, cols]."""
        x, y = centres(grid)
        return (x - self.center[0]) ** 2 + (y - self.center[1]) ** 2 <= self.radius**2

    def moved(self, by: Point) -> "Circle":
        """The same elsewhere, by (x, y) m."""
        return replace(self, center=_sum(self.center, by))


@dataclass(frozen=True)
class Rectangle:
    """A rectangle: `center` [x, y] m, `size` [along, across] m, turned counter-clockwise by `angle` degrees."""

    center: Point
    size: Point
    angle: float = 0.0
    kind: ClassVar[str] = "rectangle"

    def bounds(self) -> tuple[float, float, float, float]:
        """Least x, least y, largest x, largest y, m."""
        c, s = abs(cos(radians(self.angle))), abs(sin(radians(self.angle)))
        half_x = (self.size[0] * c + self.size[1] * s) / 2
        half_y = (self.size[0] * s + self.size[1] * c) / 2
        x, y = self.center
        return x - half_x, y - half_y, x + half_x, y + half_y

    def mask(self, grid: Grid) -> np.ndarray:
        """Cells of the rectangle, bool [rows, cols]."""
        x, y = centres(grid)
        dx, dy = x - self.center[0], y - self.center[1]
        c, s = cos(radians(self.angle)), sin(radians(self.angle))
        return (abs(dx * c + dy * s) <= self.size[0] / 2) & (abs(dy * c - dx * s) <= self.size[1] / 2)

    def moved(self, by: Point) -> "Rectangle":
        """The same elsewhere, by (x, y) m."""
        return replace(self, center=_sum(self.center, by))


@dataclass(frozen=True)
class Polygon:
    """A polygon through `points` [[x, y], ...] m, closed by itself; inside by the even-odd rule."""

    points: tuple[Point, ...]
    kind: ClassVar[str] = "polygon"

    def bounds(self) -> tuple[float, float, float, float]:
        """Least x, least y, largest x, largest y, m."""
        xs, ys = zip(*self.points, strict=True)
        return min(xs), min(ys), max(xs), max(ys)

    def mask(self, grid: Grid) -> np.ndarray:
        """Cells of the polygon, bool [rows, cols]: a ray to the east crosses it an odd number of times."""
        x, y = centres(grid)
        inside = np.zeros((grid.rows, grid.cols), dtype=bool)
        for (x0, y0), (x1, y1) in zip(self.points, self.points[1:] + self.points[:1], strict=True):
            if y0 != y1:
                crossing = x0 + (y - y0) * ((x1 - x0) / (y1 - y0))
                inside ^= ((y0 <= y) != (y1 <= y)) & (x < crossing)
        return inside

    def moved(self, by: Point) -> "Polygon":
        """The same elsewhere, by (x, y) m."""
        return replace(self, points=tuple(_sum(point, by) for point in self.points))


@dataclass(frozen=True)
class Mask:
    """The bright cells of a .png (first row north), or the true ones of a .npy (row 0 south), laid over the site."""

    path: str
    kind: ClassVar[str] = "mask"

    def bounds(self) -> None:
        """None: it always has the site's extent."""

    def mask(self, grid: Grid) -> np.ndarray:
        """Cells of the mask, bool [rows, cols]; a finer or coarser image of the same proportions is sampled."""
        image = read_mask(self.path)
        rows, cols = image.shape
        if rows * grid.cols != cols * grid.rows:
            raise ValueError(
                f"{self.path} has {rows} x {cols} pixels; allowed: the site's {grid.rows} x {grid.cols} "
                "(rows x columns), or the same proportions"
            )
        row = ((np.arange(grid.rows) + 0.5) * rows / grid.rows).astype(int)
        col = ((np.arange(grid.cols) + 0.5) * cols / grid.cols).astype(int)
        return image[row[:, None], col[None, :]]

    def moved(self, by: Point) -> "Mask":
        """Itself; raises ValueError for a shift, for it is as large as the site and has no place to go."""
        if any(by):
            raise ValueError(f"a region is shifted and is the mask {self.path}; allowed: another kind, or no shift")
        return self


Region = Circle | Rectangle | Polygon | Mask


def rasterize(region: Region, grid: Grid, key: str) -> np.ndarray:
    """Cells of a region, bool [rows, cols]; an error naming `key` if it leaves the site or holds no cell centre."""
    width, depth = grid.cols * grid.cell, grid.rows * grid.cell
    bounds = region.bounds()
    if bounds:
        x0, y0, x1, y1 = bounds
        slack = 1e-9 * max(width, depth)
        if x0 < -slack or x1 > width + slack or y0 < -slack or y1 > depth + slack:
            raise ValueError(
                f"{key} reaches from x = {x0:g} to {x1:g} m and from y = {y0:g} to {y1:g} m; "
                f"allowed: inside the site, x from 0 to {width:g} m and y from 0 to {depth:g} m"
            )
    mask = region.mask(grid)
    if not mask.any():
        raise ValueError(f"{key} holds no cell centre; allowed: a region larger than one cell of {grid.cell:g} m")
    return mask


def _sum(point: Point, by: Point) -> Point:
    return point[0] + by[0], point[1] + by[1]
