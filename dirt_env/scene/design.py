"""A design surface: the ground that a region is to have in the end."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dirt_env.scene.heaps import layer
from dirt_env.scene.layout import centres
from dirt_env.scene.regions import Region, rasterize
from dirt_env.scene.survey import HeightFile
from dirt_env.sim.params import Grid

UNSAID = (".npy", ".npz", ".png")  # files that do not say which of their rows is the northern one


@dataclass(frozen=True)
class Design:
    """The surface asked for inside `region`: a plane, or the heights of a file.

    `height` m over the datum at the region's middle, or "balance" (None): as much to cut as to fill, or "ground": in
    the plane's place the ground as it is without its hollows. `slope` (None: level): rise per metre to the east and to
    the north.
    `layer`: in the plane's place, so many metres over the ground, falling off at repose towards the region's rim.
    `path`: a file of heights over the ground's zero, over the whole site, in its place; `first_row`, `array`, `band`,
    `nodata_value`, `scale` and `offset` say how to read it, as in `HeightFile`.
    `tolerance`: root mean square grade error under which the job is done, m.
    """

    region: Region
    height: float | str | None = None
    slope: tuple[float, float] | None = None
    layer: float | None = None
    path: str | None = None
    first_row: str | None = None
    array: str | None = None
    band: int | None = None
    nodata_value: float | None = None
    scale: float | None = None
    offset: float = 0.0
    tolerance: float = 0.03

    def surface(
        self, ground: np.ndarray, whole: np.ndarray, grid: Grid, slope: float, datum: float, solid,
        survey: HeightFile | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """The target [rows, cols] m, equal to `ground` outside, and the cells it is asked for in, bool [rows, cols].

        `whole` is the ground without its hollows, `slope` the soil's at repose (a tangent), `datum` the elevation of
        the ground's zero [m], `survey` the file that the ground is from, if it is from one.
        """
        mask = rasterize(self.region, grid, "design.region")
        if solid is not None:
            mask = mask & ~solid
        if not mask.any():
            raise ValueError("design.region holds solid cells only; allowed: a region with open ground")
        if self.path:
            surface = self._from_file(grid, datum, survey)
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

    def _from_file(self, grid: Grid, datum: float, survey: HeightFile | None) -> np.ndarray:
        source = self._source(survey)
        raster = source.read()
        rows, cols = raster.height.shape
        pixel = raster.cell or grid.cell
        if abs(rows * pixel - grid.rows * grid.cell) > pixel or abs(cols * pixel - grid.cols * grid.cell) > pixel:
            raise ValueError(
                f"design.path {self.path} covers {cols * pixel:g} m x {rows * pixel:g} m; allowed: the site's "
                f"{grid.cols * grid.cell:g} m x {grid.rows * grid.cell:g} m"
            )
        corner = None if survey is None else survey.corner
        if corner and source.corner and max(abs(a - b) for a, b in zip(corner, source.corner, strict=True)) > pixel / 2:
            raise ValueError(
                f"design.path {self.path} has its corner at {_place(source.corner)}; allowed: the ground's "
                f"{_place(corner)}"
            )
        return source.elevation(grid) - datum

    def _source(self, survey: HeightFile | None) -> HeightFile:
        """The file; which row comes first, and what means no data, is as in the ground's file, unless it is said."""
        first_row, nothing = self.first_row, self.nodata_value
        if survey is not None:
            nothing = survey.nodata_value if nothing is None else nothing
            if first_row is None and Path(self.path).suffix.lower() in UNSAID:
                first_row = survey.first_row
        return HeightFile(
            self.path,
            nodata_value=nothing,
            scale=self.scale,
            offset=self.offset,
            first_row=first_row,
            array=self.array,
            band=self.band,
            table="design",
        )


def _place(corner: tuple[float, float]) -> str:
    return f"({corner[0]:.10g}, {corner[1]:.10g}) m"
