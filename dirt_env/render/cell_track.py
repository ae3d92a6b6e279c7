"""The cells of one recorded episode, compressed while they are recorded: of every moment what has changed.

Stream of fills, deflated, cells in the order [row, column, level], each fill a byte in units of 1/200 (a cell that is
more than 1.275 full counts as that): all cells of the first moment; then for each later one how many cells changed, as
little-endian u4, their places as u4, each counted on from the one before (the lowest bytes of all first), and their
new fills.
"""

import zlib
from typing import NamedTuple

import numpy as np

PER_FILL = 200  # units in a full cell


class Cells(NamedTuple):
    """Cells of one moment: `fill` f8[rows, cols, levels], `bottom` m of the lowest level, `dy` m height of a level."""

    fill: np.ndarray
    bottom: float
    dy: float


class CellTrack:
    """Moments of one episode; keeps some compressed bytes for each, and the last one."""

    def __init__(self, first: Cells) -> None:
        self.bottom, self.dy, self.levels = float(first.bottom), float(first.dy), first.fill.shape[2]
        self._last = quantised_fill(first.fill)
        self._packer = zlib.compressobj(6)
        self._packed = bytearray(self._packer.compress(self._last.tobytes()))

    def add(self, fill: np.ndarray) -> None:
        """Append a later moment, fill f[rows, cols, levels]; ValueError for another shape."""
        now = quantised_fill(fill)
        if now.shape != self._last.shape:
            raise ValueError(f"fill has shape {now.shape}; allowed: {self._last.shape}, as at the start")
        places = np.flatnonzero(now != self._last)
        steps = np.diff(places, prepend=0).astype("<u4").view(np.uint8).reshape(-1, 4)
        self._packed += self._packer.compress(np.uint32(len(places)).astype("<u4").tobytes())
        self._packed += self._packer.compress(steps.T.tobytes() + now.ravel()[places].tobytes())
        self._last = now

    def fills(self) -> bytes:
        """The deflated stream of all fills so far."""
        return bytes(self._packed) + self._packer.copy().flush()


def quantised_fill(fill: np.ndarray) -> np.ndarray:
    """Fills as whole units u1, a new array."""
    return np.rint(np.minimum(fill, 255 / PER_FILL) * PER_FILL).astype(np.uint8)
