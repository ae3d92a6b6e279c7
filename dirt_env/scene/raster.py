"""A height map as it comes out of a file, and the packages that reading may need."""

from importlib import import_module
from typing import NamedTuple

import numpy as np

LARGEST = 2**26  # cells read at once


class Raster(NamedTuple):
    """A height map as read: row 0 at the south, NaN where the file has no data."""

    height: np.ndarray  # f8 [rows, cols], m
    cell: float | None  # m; None: the file does not say
    size: tuple[float, float] | None = None  # extent of the whole file, m; None: the array is all of it
    origin: tuple[float, float] = (0.0, 0.0)  # south-western corner of the array from that of the file, m
    corner: tuple[float, float] | None = None  # the file's south-western corner on its map, m; None: it does not say


def check_size(path: str, rows: float, cols: float) -> None:
    """An error for more cells than can be read at once."""
    if rows * cols > LARGEST:
        raise ValueError(f"{path} has {rows:g} x {cols:g} = {rows * cols:g} cells; allowed: at most {LARGEST} at once")


def require(module: str, package: str):
    """An optional package, or an error that says how to get it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise ImportError(
            f"{package} is needed to read this file and is not installed; "
            f'install it with: pip install ".[files]" in the checkout (or: pip install {package})'
        ) from error
