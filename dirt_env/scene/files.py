"""Height maps and masks from files: .npy, .npz, .asc (ESRI grid), .tif (GeoTIFF), .png (16 bit)."""

import struct
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np

from dirt_env.scene.asc import read_asc
from dirt_env.scene.geotiff import read_geotiff
from dirt_env.scene.raster import Raster, check_size, require

SUFFIXES = (".npy", ".npz", ".asc", ".tif", ".tiff", ".png")


class Reading(NamedTuple):
    """What a file may leave open: see the keys of [ground] in docs/scenes.md."""

    crop: tuple[float, float, float, float] | None = None
    first_row: str | None = None
    array: str | None = None
    band: int | None = None
    nodata_value: float | None = None
    table: str = "ground"  # of the scene, which errors name


def read_raster(path: str, reading: Reading) -> Raster:
    """The height map in a file, by its suffix."""
    suffix = _suffix(path)
    try:
        raster = _read(path, suffix, reading)
    except (OSError, EOFError, BadZipFile) as error:
        raise ValueError(f"{path} cannot be read as {suffix}: {error}") from error
    height = np.array(raster.height, dtype=np.float64)
    height[~np.isfinite(height)] = np.nan
    if reading.nodata_value is not None:
        height[height == reading.nodata_value] = np.nan
    return raster._replace(height=height)


def read_mask(path: str) -> np.ndarray:
    """A mask, bool [rows, cols], row 0 at the south: true cells of a .npy, or pixels of a .png at least half as
    bright as its brightest one (what is transparent is dark)."""
    suffix = _suffix(path, (".npy", ".png"))
    if suffix == ".npy":
        return _read_numpy(path) != 0
    image = _open_png(path)
    brightness = np.asarray(image if image.mode.startswith("I") else _over_black(image))
    return brightness[::-1] >= max(int(brightness.max()), 1) / 2


def _read(path: str, suffix: str, reading: Reading) -> Raster:
    if suffix in (".asc", ".tif", ".tiff") and reading.first_row is not None:
        raise ValueError(
            f"{reading.table}.first_row is {reading.first_row!r}; {Path(path).name} says itself: leave the key out"
        )
    if suffix == ".asc":
        return read_asc(path)
    if suffix in (".tif", ".tiff"):
        return read_geotiff(path, reading.crop, reading.band, reading.table)
    values = _read_png(path) if suffix == ".png" else _read_numpy(path, reading.array, reading.table)
    north = (reading.first_row or ("north" if suffix == ".png" else "south")) == "north"
    return Raster(values[::-1] if north else values, None)


def _suffix(path: str, allowed: tuple[str, ...] = SUFFIXES) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in allowed:
        raise ValueError(f"{path} ends in {suffix!r}; allowed: {', '.join(allowed)}")
    if not Path(path).is_file():
        raise ValueError(f"{path} is no file; allowed: a path to one, relative to the scene file or absolute")
    return suffix


def _read_numpy(path: str, key: str | None = None, table: str = "") -> np.ndarray:
    """The two-dimensional array of a .npy, or that of the name `key` in a .npz; nothing is unpickled."""
    try:
        stored = np.load(path, "r", allow_pickle=False)  # mapped, so that its size is known before it is read
    except (OSError, EOFError, ValueError, BadZipFile) as error:
        raise ValueError(f"{path} cannot be read as {Path(path).suffix}: {error}") from error
    if isinstance(stored, np.ndarray):
        return _checked(stored, path)
    with stored:
        shapes = {name: _shape_in(stored, name) for name in stored.files}
        grids = [name for name, shape in shapes.items() if len(shape) == 2]
        if key is None and len(grids) != 1:
            raise ValueError(f"{path} has {len(grids)} two-dimensional arrays ({', '.join(grids)}); say {table}.array")
        if key is not None and key not in stored.files:
            raise ValueError(f"{table}.array is {key!r}; allowed: {', '.join(grids)}")
        if len(shapes[key or grids[0]]) == 2:
            check_size(path, *shapes[key or grids[0]])
        return _checked(stored[key or grids[0]], path)


def _shape_in(stored: Any, name: str) -> tuple[int, ...]:
    """Shape of an array in an open .npz, without reading the array."""
    with stored.zip.open(f"{name}.npy") as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        return read(file)[0]


def _checked(values: np.ndarray, path: str) -> np.ndarray:
    if values.ndim != 2 or values.dtype.kind not in "biuf":
        raise ValueError(f"{path} has shape {values.shape} of {values.dtype}; allowed: two dimensions of real numbers")
    if values.size == 0:
        raise ValueError(f"{path} has {values.shape[0]} x {values.shape[1]} cells; allowed: at least one")
    check_size(path, *values.shape)
    return np.array(values)


def _read_png(path: str) -> np.ndarray:
    """Grey values of a 16-bit (or 8-bit) PNG [rows, cols], first row north."""
    image = _open_png(path)
    if not image.mode.startswith("I") and image.mode != "L":
        raise ValueError(f"{path} is an image of mode {image.mode}; allowed: one grey channel of 16 bits")
    return np.asarray(image)


def _open_png(path: str) -> Any:
    """A pillow image whose pixels could all be read."""
    pillow = require("PIL.Image", "pillow")
    try:
        with pillow.open(path, formats=("PNG",)) as image:
            check_size(path, image.height, image.width)
            image.load()
    except (OSError, ValueError, SyntaxError, EOFError, struct.error, pillow.DecompressionBombError) as error:
        raise ValueError(f"{path} cannot be read as .png: {error}") from error
    return image


def _over_black(image: Any) -> Any:
    """The brightness of a pillow image laid over black, 8 bits."""
    pillow = require("PIL.Image", "pillow")
    return pillow.alpha_composite(pillow.new("RGBA", image.size, "black"), image.convert("RGBA")).convert("L")
