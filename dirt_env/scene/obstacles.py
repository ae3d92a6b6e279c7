"""Obstacles: posts, walls, closed regions. They stop the machine, and hold the soil at any height."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from dirt_env.scene.layout import centres
from dirt_env.scene.regions import Circle, Point, Region, rasterize
from dirt_env.sim.params import Grid


@dataclass(frozen=True)
class Post:
    """A round post: `center` [x, y] m, `radius` m."""

    center: Point
    radius: float = 0.5
    kind: ClassVar[str] = "post"

    def solid(self, grid: Grid, key: str) -> np.ndarray:
        """Its cells, bool [rows, cols]; at least the one its centre is in."""
        mask = Circle(self.center, self.radius).mask(grid)
        _check_ends(key, grid, self.center)
        row, col = (int(np.ceil(at / grid.cell)) - 1 for at in reversed(self.center))
        mask[max(row, 0), max(col, 0)] = True
        return mask

    def moved(self, by: Point) -> "Post":
        """The same elsewhere, by (x, y) m."""
        return replace(self, center=(self.center[0] + by[0], self.center[1] + by[1]))


@dataclass(frozen=True)
class Wall:
    """A straight wall: `start` and `end` [x, y] m, `width` m, which is made up to at least a cell and a half."""

    start: Point
    end: Point
    width: float = 0.5
    kind: ClassVar[str] = "wall"

    def solid(self, grid: Grid, key: str) -> np.ndarray:
        """Its cells, bool [rows, cols], without a gap."""
        _check_ends(key, grid, self.start, self.end)
        x, y = centres(grid)
        along = np.subtract(self.end, self.start)
        share = ((x - self.start[0]) * along[0] + (y - self.start[1]) * along[1]) / max(along @ along, 1e-12)
        share = np.clip(share, 0.0, 1.0)
        away = np.hypot(x - self.start[0] - share * along[0], y - self.start[1] - share * along[1])
        return away <= max(self.width, 1.5 * grid.cell) / 2

    def moved(self, by: Point) -> "Wall":
        """The same elsewhere, by (x, y) m."""
        (x0, y0), (x1, y1), (x, y) = self.start, self.end, by
        return replace(self, start=(x0 + x, y0 + y), end=(x1 + x, y1 + y))


@dataclass(frozen=True)
class Block:
    """Everything inside a `region`: a building, a pond."""

    region: Region
    kind: ClassVar[str] = "region"

    def solid(self, grid: Grid, key: str) -> np.ndarray:
        """Its cells, bool [rows, cols]."""
        return rasterize(self.region, grid, f"{key}.region")

    def moved(self, by: Point) -> "Block":
        """The same elsewhere, by (x, y) m."""
        return replace(self, region=self.region.moved(by))


Obstacle = Post | Wall | Block


def solid_cells(obstacles: tuple[Obstacle, ...], grid: Grid, missing: np.ndarray | None = None) -> np.ndarray | None:
    """Cells of all obstacles and of walled-off ground, bool [rows, cols]; None if there are none."""
    solid = np.zeros((grid.rows, grid.cols), dtype=bool) if missing is None else missing.copy()
    for index, obstacle in enumerate(obstacles):
        solid |= obstacle.solid(grid, f"obstacle[{index}]")
    return solid if solid.any() else None


def _check_ends(key: str, grid: Grid, *points: Point) -> None:
    width, depth = grid.cols * grid.cell, grid.rows * grid.cell
    for x, y in points:
        if not (0 <= x <= width and 0 <= y <= depth):
            raise ValueError(
                f"{key} is at ({x:g}, {y:g}) m; allowed: x from 0 to {width:g} m and y from 0 to {depth:g} m"
            )
