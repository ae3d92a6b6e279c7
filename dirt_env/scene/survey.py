"""Ground from a file: cropped, resampled to the site's cells, with a decision about cells without data."""

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, NamedTuple

import numpy as np

from dirt_env.scene.files import Raster, Reading, read_raster
from dirt_env.sim.params import Grid


class Survey(NamedTuple):
    """Ground of a site from a file: heights over the lowest surveyed cell, whose elevation is `datum`."""

    height: np.ndarray  # f8 [rows, cols], m
    missing: np.ndarray  # bool [rows, cols] cells without data in the file
    datum: float  # m


@dataclass(frozen=True)
class HeightFile:
    """A height map of the ground, or of another `table` of the scene; see docs/scenes.md for the keys."""

    path: str
    crop: tuple[float, float, float, float] | None = None
    nodata: str | None = None
    nodata_value: float | None = None
    scale: float | None = None
    offset: float = 0.0
    first_row: str | None = None
    pixel: float | None = None
    array: str | None = None
    band: int | None = None
    table: str = "ground"
    kind: ClassVar[str] = "file"

    def read(self) -> Raster:
        """The file's heights in metres; read once."""
        return _read(self)

    def extent(self, cell: float | None) -> tuple[float, float, float, float, float]:
        """Part of the file that is the site, x0, y0, x1, y1 m from its south-western corner, and the file's cell, m."""
        raster = self.read()
        pixel = raster.cell or self.pixel or cell
        if raster.cell and self.pixel and abs(self.pixel / raster.cell - 1) > 1e-6:
            raise ValueError(f"ground.pixel is {self.pixel:g} m; {self.path} says {raster.cell:g} m: leave the key out")
        if pixel is None:
            raise ValueError(f"{self.path} does not say how large a cell is; say ground.pixel in metres")
        rows, cols = raster.height.shape
        width, depth = raster.size or (cols * pixel, rows * pixel)
        x0, y0, x1, y1 = self.crop or (0.0, 0.0, width, depth)
        if not (0 <= x0 < x1 <= width * (1 + 1e-9) and 0 <= y0 < y1 <= depth * (1 + 1e-9)):
            raise ValueError(
                f"ground.crop is {list(self.crop)}; allowed: [x0, y0, x1, y1] with x0 < x1 from 0 to {width:g} m "
                f"and y0 < y1 from 0 to {depth:g} m, counted from the file's south-western corner"
            )
        return x0, y0, x1, y1, pixel

    @property
    def corner(self) -> tuple[float, float] | None:
        """South-western corner of the crop on the file's map, m; None if the file does not say."""
        found = self.read().corner
        x0, y0 = self.crop[:2] if self.crop else (0.0, 0.0)
        return None if found is None else (found[0] + x0, found[1] + y0)

    def elevation(self, grid: Grid) -> np.ndarray:
        """Elevations of a site whose south-western corner is that of the crop, m [rows, cols]; NaN without data."""
        x0, y0, _, _, pixel = self.extent(grid.cell)
        raster = self.read()
        return resample(raster.height, pixel, x0 - raster.origin[0], y0 - raster.origin[1], grid)

    def survey(self, grid: Grid) -> Survey:
        """The ground of a site whose south-western corner is that of the crop; computed once."""
        return _survey(self, grid)


def forget() -> None:
    """Forget the files read so far, so that one that changed on disk is read again."""
    _read.cache_clear()
    _survey.cache_clear()


@lru_cache(maxsize=8)
def _read(source: HeightFile) -> Raster:
    if source.scale is None and source.path.lower().endswith(".png"):
        raise ValueError(f"{source.table}.scale is missing for {source.path}; needed: metres per grey level")
    reading = Reading(source.crop, source.first_row, source.array, source.band, source.nodata_value, source.table)
    raster = read_raster(source.path, reading)
    return raster._replace(height=raster.height * (1.0 if source.scale is None else source.scale) + source.offset)


@lru_cache(maxsize=8)
def _survey(source: HeightFile, grid: Grid) -> Survey:
    elevation = source.elevation(grid)
    missing = np.isnan(elevation)
    count = int(missing.sum())
    if count == elevation.size:
        raise ValueError(f"{source.path} has no data in any of the site's {count} cells; allowed: a crop with heights")
    if count and source.nodata is None:
        raise ValueError(
            f"{source.path} has no data in {count} of the site's {elevation.size} cells ({count / elevation.size:.1%}) "
            'and ground.nodata is not given; allowed: "wall" (no machine and no soil gets there) or "fill" (smooth '
            "ground from the cells around)"
        )
    datum = float(np.nanmin(elevation))
    height = fill(elevation - datum)
    height.setflags(write=False)
    missing.setflags(write=False)
    return Survey(height, missing, datum)


def resample(height: np.ndarray, pixel: float, x0: float, y0: float, grid: Grid) -> np.ndarray:
    """Bilinear heights at the centres of a grid's cells [rows, cols]; its corner is at (x0, y0) m of the raster.

    A site's cell larger than the raster's is the mean of enough such points. A point has no data where the pixel it
    lies in has none; else pixels without data are left out of its mean.
    """
    parts = max(1, int(np.ceil(grid.cell / pixel - 1e-9)))
    fine = grid.cell / parts
    row = (y0 + (np.arange(grid.rows * parts) + 0.5) * fine) / pixel - 0.5
    col = (x0 + (np.arange(grid.cols * parts) + 0.5) * fine) / pixel - 0.5
    points = _bilinear(height, row, col)
    if parts == 1:
        return points
    blocks = points.reshape(grid.rows, parts, grid.cols, parts)
    known = np.isfinite(blocks).sum(axis=(1, 3))
    total = np.nansum(blocks, axis=(1, 3))
    return np.where(2 * known >= parts**2, total / np.maximum(known, 1), np.nan)


def _bilinear(height: np.ndarray, row: np.ndarray, col: np.ndarray) -> np.ndarray:
    """Heights [len(row), len(col)] at fractional pixel centres; beyond the outermost centres the outermost counts."""
    rows, cols = height.shape
    row, col = np.clip(row, 0, rows - 1), np.clip(col, 0, cols - 1)
    known = np.isfinite(height)
    weight = _between(_between(known.astype(float), row).T, col).T
    total = _between(_between(np.where(known, height, 0.0), row).T, col).T
    inside = known[np.floor(row + 0.5).astype(int)[:, None], np.floor(col + 0.5).astype(int)[None, :]]
    return np.where(inside, total / np.where(inside, weight, 1.0), np.nan)


def _between(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Linear interpolation along axis 0 at fractional indices."""
    low = np.floor(at).astype(int)
    share = (at - low)[:, None]
    return values[low] * (1 - share) + values[np.minimum(low + 1, len(values) - 1)] * share


def fill(height: np.ndarray) -> np.ndarray:
    """Heights with the NaN cells filled in smoothly from those around; the others stay, and no new extreme comes up.

    Holes take their heights from a picture of half the resolution, itself filled the same way, and are then smoothed.
    """
    hole = np.isnan(height)
    if not hole.any():
        return height.copy()
    rows, cols = height.shape
    result = np.where(hole, _doubled(fill(_halved(height)))[:rows, :cols], height)
    for _ in range(8):
        padded = np.pad(result, 1, mode="edge")
        mean = (padded[:-2, 1:-1] + padded[2:, 1:-1] + padded[1:-1, :-2] + padded[1:-1, 2:]) / 4
        result = np.where(hole, mean, height)
    return result


def _halved(height: np.ndarray) -> np.ndarray:
    """Means of blocks of 2 x 2 cells, without the NaN ones."""
    rows, cols = height.shape
    blocks = np.pad(height, ((0, rows % 2), (0, cols % 2)), constant_values=np.nan)
    blocks = blocks.reshape((rows + 1) // 2, 2, (cols + 1) // 2, 2)
    known = np.isfinite(blocks).sum(axis=(1, 3))
    return np.where(known, np.nansum(blocks, axis=(1, 3)) / np.maximum(known, 1), np.nan)


def _doubled(height: np.ndarray) -> np.ndarray:
    """Each cell as 2 x 2 cells."""
    return np.repeat(np.repeat(height, 2, axis=0), 2, axis=1)
