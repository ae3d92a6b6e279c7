"""A design surface: the ground that a region is to have in the end."""

from dataclasses import dataclass

import numpy as np

from dirt_env.scene.heaps import layer
from dirt_env.scene.layout import centres
from dirt_env.scene.regions import Region, rasterize
from dirt_env.scene.survey import HeightFile
from dirt_env.sim.params import Grid


@dataclass(frozen=True)
class Design:
    """The surface asked for inside `region`: a plane, or the heights of a file.

    `height` m over the datum at the region's middle, or "balance" (None): as much to cut as to fill, or "ground": in
    the plane's place the ground as it is without its hollows. `slope` (None: level): rise per metre to the east and to
    the north.
    `layer`: in the plane's place, so many metres over the ground, falling off at repose towards the region's rim.
    `path`: a file of heights over the ground's zero, over the whole site, in its place.
    `tolerance`: root mean square grade error under which the job is done, m.
    """

    region: Region
    height: float | str | None = None
    slope: tuple[float, float] | None = None
    layer: float | None = None
    path: str | None = None
    tolerance: float = 0.03

    def surface(
        self, ground: np.ndarray, whole: np.ndarray, grid: Grid, slope: float, datum: float, solid
    ) -> tuple[np.ndarray, np.ndarray]:
        """The target [rows, cols] m, equal to `ground` outside, and the cells it is asked for in, bool [rows, cols].

        `whole` is the ground without its hollows, `slope` the soil's at repose (a tangent), `datum` the elevation of
        the ground's zero [m].
        """
        mask = rasterize(self.region, grid, "design.region")
        if solid is not None:
            mask = mask & ~solid
        if not mask.any():
            raise ValueError("design.region holds solid cells only; allowed: a region with open ground")
        if self.path:
            surface = self._from_file(grid, datum)
        elif self.layer is not None:
            surface = ground + layer(mask, grid, self.layer, slope, solid)
        elif self.height == "ground":
            surface = whole
        else:
            surface = self._plane(ground, grid, mask)
        mask = mask & np.isfinite(surface)
        if not mask.any():
            raise ValueError(f"design.path {self.path} has no heights inside design.region; allowed: at least one cell")
        return np.where(mask, surface, ground), mask

    def _plane(self, ground: np.ndarray, grid: Grid, mask: np.ndarray) -> np.ndarray:
        x, y = (np.broadcast_to(axis, mask.shape) for axis in centres(grid))
        east, north = self.slope or (0.0, 0.0)
        plane = east * (x - x[mask].mean()) + north * (y - y[mask].mean())
        height = float((ground - plane)[mask].mean()) if self.height in (None, "balance") else self.height
        return plane + height

    def _from_file(self, grid: Grid, datum: float) -> np.ndarray:
        if self.path.lower().endswith(".png"):
            raise ValueError(f"design.path is {self.path}; allowed: .npy, .npz, .asc, .tif, which hold metres")
        source = HeightFile(self.path)
        raster = source.read()
        rows, cols = raster.height.shape
        pixel = raster.cell or grid.cell
        if abs(rows * pixel - grid.rows * grid.cell) > pixel or abs(cols * pixel - grid.cols * grid.cell) > pixel:
            raise ValueError(
                f"design.path {self.path} covers {cols * pixel:g} m x {rows * pixel:g} m; allowed: the site's "
                f"{grid.cols * grid.cell:g} m x {grid.rows * grid.cell:g} m"
            )
        return source.elevation(grid) - datum
