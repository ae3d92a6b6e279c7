"""ESRI ASCII grids: six lines of header, then the rows from north to south."""

from math import inf
from pathlib import Path

import numpy as np

from dirt_env.scene.raster import Raster, check_size

LONGEST_HEADER = 4096  # characters
HEADER = {"ncols", "nrows", "cellsize", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "nodata_value", "dx", "dy"}


def read_asc(path: str) -> Raster:
    """The height map of an ESRI ASCII grid."""
    with Path(path).open(encoding="utf-8-sig", errors="replace") as file:
        text = file.read(LONGEST_HEADER)
        header, _ = _header(path, text.split()[:-1])  # the last word may be cut in two
        sizes = [header.get(name, 0.0) for name in ("nrows", "ncols")]
        if all(map(float.is_integer, sizes)):  # else the error is another one
            check_size(path, *sizes)
        words = (text + file.read()).split()
    header, start = _header(path, words)
    sizes = set() if {"dx", "dy"} <= header.keys() else {"cellsize"}
    missing = {"ncols", "nrows", *sizes} - header.keys()
    if missing:
        raise ValueError(f"{path} has no {max(missing)} in its header; needed: ncols, nrows, cellsize")
    rows, cols = (_count(path, name, header[name]) for name in ("nrows", "ncols"))
    if len(words) - start != rows * cols:
        raise ValueError(f"{path} has {len(words) - start} heights; its header says {rows} x {cols} = {rows * cols}")
    try:
        height = np.array(words[start:], dtype=np.float64).reshape(rows, cols)[::-1].copy()
    except ValueError as error:
        raise ValueError(f"{path} holds something that is no number: {error}") from None
    height[height == header.get("nodata_value", -9999.0)] = np.nan
    cell = _cell(path, header)
    return Raster(height, cell, corner=_corner(header, cell))


def _header(path: str, words: list[str]) -> tuple[dict[str, float], int]:
    """Name and value pairs at the beginning, and the place of the first height."""
    header: dict[str, float] = {}
    at = 0
    while at + 1 < len(words) and words[at].lower() in HEADER:
        try:
            header[words[at].lower()] = float(words[at + 1])
        except ValueError:
            raise ValueError(f"{path}: {words[at]} is {words[at + 1]!r}; allowed: a number") from None
        at += 2
    return header, at


def _corner(header: dict[str, float], cell: float) -> tuple[float, float] | None:
    """The south-western corner, m; None if the header does not say."""
    found = [header.get(f"{axis}llcorner", header.get(f"{axis}llcenter", inf) - 0.5 * cell) for axis in "xy"]
    return tuple(found) if max(found) < inf else None


def _count(path: str, name: str, value: float) -> int:
    if not (value.is_integer() and value >= 1):
        raise ValueError(f"{path} has {name} {value:g}; allowed: whole numbers >= 1")
    return int(value)


def _cell(path: str, header: dict[str, float]) -> float:
    """The cell's size, m; refused if the cells are no squares, or are given in degrees."""
    dx = header.get("dx", header.get("cellsize"))
    dy = header.get("dy", header.get("cellsize"))
    if dx != dy:
        raise ValueError(f"{path} has cells of {dx:g} m x {dy:g} m; allowed: squares; resample it (gdalwarp -tr) first")
    if not 0 < dx < inf:
        raise ValueError(f"{path} has cellsize {dx:g}; allowed: > 0 m")
    x = header.get("xllcorner", header.get("xllcenter", 0.0))
    y = header.get("yllcorner", header.get("yllcenter", 0.0))
    if dx < 0.01 and abs(x) <= 360 and abs(y) <= 90 and (x or y):
        raise ValueError(
            f"{path} has cellsize {dx:g} and its corner at ({x:g}, {y:g}): these are degrees; "
            "allowed: metres; project it first (gdalwarp -t_srs EPSG:...)"
        )
    return dx
