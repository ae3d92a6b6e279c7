"""GeoTIFF height maps through rasterio."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from math import ceil, floor

import numpy as np

from dirt_env.scene.raster import LARGEST, Raster, require


def read_geotiff(path: str, crop: tuple[float, float, float, float] | None, band: int | None, table: str) -> Raster:
    """The height map of a GeoTIFF, or the part that `crop` needs (x0, y0, x1, y1 m from the south-western corner).

    `table` of the scene is the one that errors name.
    """
    rasterio = require("rasterio", "rasterio")
    with _quiet(rasterio), rasterio.open(path) as source:
        cell = _cell(path, source)
        band = _band(path, source.count, band, table)
        size = (source.width * cell, source.height * cell)
        row0, row1 = _part(crop and crop[1::2], size[1], cell, source.height)
        col0, col1 = _part(crop and crop[0::2], size[0], cell, source.width)
        if (row1 - row0) * (col1 - col0) > LARGEST:
            raise ValueError(
                f"{path}: {row1 - row0} x {col1 - col0} cells to read; allowed: at most {LARGEST}; use ground.crop"
            )
        north_up = source.transform.e < 0
        first, last = (source.height - row1, source.height - row0) if north_up else (row0, row1)
        read = source.read(band, window=((first, last), (col0, col1)), masked=True)
        values = np.ma.filled(read.astype(np.float64), np.nan) * source.scales[band - 1] + source.offsets[band - 1]
        corner = (
            None if source.transform.is_identity else (source.bounds.left, min(source.bounds.bottom, source.bounds.top))
        )
    return Raster(values[::-1] if north_up else values, cell, size, (col0 * cell, row0 * cell), corner)


@contextmanager
def _quiet(rasterio) -> Iterator[None]:
    """Without rasterio's warning about files without georeference, which count as metres here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        yield


def _cell(path: str, source) -> float:
    """The cell's size, m; refused for degrees, for other units than metres, for turned and for oblong cells."""
    if source.crs is not None and source.crs.is_geographic:
        raise ValueError(
            f"{path} is in degrees ({source.crs.to_string()}); allowed: metres; project it first, for example into UTM "
            "(gdalwarp -t_srs EPSG:...)"
        )
    if source.crs is not None and source.crs.is_projected:
        unit, factor = source.crs.linear_units_factor
        if abs(factor - 1) > 1e-9:
            raise ValueError(
                f"{path} is in {unit} of {factor:g} m; allowed: metres; project it first (gdalwarp -t_srs)"
            )
    across, down = source.transform.a, source.transform.e
    if source.transform.b or source.transform.d or across <= 0:
        raise ValueError(
            f"{path} is turned against its map; allowed: columns to the east, rows to the south (gdalwarp)"
        )
    if abs(abs(down) / across - 1) > 1e-6:
        raise ValueError(
            f"{path} has cells of {across:g} m x {abs(down):g} m; allowed: squares; resample it first (gdalwarp -tr)"
        )
    return float(across)


def _band(path: str, count: int, band: int | None, table: str) -> int:
    if band is None and count > 1:
        raise ValueError(f"{path} has {count} bands; say which are the heights: {table}.band = 1 to {count}")
    if band is not None and band > count:
        raise ValueError(f"{table}.band is {band}; allowed: 1 to {count}")
    return band or 1


def _part(span: tuple[float, float] | None, length: float, cell: float, count: int) -> tuple[int, int]:
    """First and last + 1 of the cells that a span needs, with a rim for interpolation; all cells without a span."""
    if not span or not 0 <= span[0] < span[1] <= length + 1e-6:
        return 0, count
    return max(0, floor(span[0] / cell) - 1), min(count, ceil(span[1] / cell) + 1)
