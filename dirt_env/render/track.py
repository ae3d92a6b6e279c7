"""One recorded episode, compressed while it is recorded: heights in whole millimetres, frame by frame.

Stream of heights, deflated: the first frame as little-endian i4, then for each later frame the change since the one
before as i2, all low bytes first, then all high bytes. A change too large for i2 is caught up in the next frame.
"""

import base64
import zlib
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from dirt_env.render.cell_track import PER_FILL, Cells, CellTrack

UNIT = 0.001  # m
POSE_FIELDS = ("x", "y", "heading", "z", "pitch", "roll", "edge", "speed", "yaw_rate", "load")
START, GOAL, DESIGN, SOLID = 1, 2, 4, 8  # bits of the mask


class Frame(NamedTuple):
    """What was kept of one moment: height f4[rows, cols] m, pose f4[10] (POSE_FIELDS), time s, statistics by name."""

    height: np.ndarray
    pose: np.ndarray
    time_s: float
    stats: dict[str, float]


class Track:
    """Frames of one episode. Keeps some compressed bytes per frame, no arrays but the last one."""

    def __init__(self, label: str, cell: float, mask: np.ndarray, target: np.ndarray):
        self.label, self.cell, self.mask, self.target = label, cell, mask, quantised(target)
        self._last: np.ndarray | None = None
        self._cells: CellTrack | None = None
        self._packer = zlib.compressobj(6)
        self._packed = bytearray()
        self._poses: list[np.ndarray] = []
        self._times: list[float] = []
        self._stats: list[dict[str, float]] = []

    def __len__(self) -> int:
        return len(self._times)

    def add(
        self,
        height: np.ndarray,
        pose: np.ndarray,
        time_s: float,
        stats: Mapping[str, float],
        cells: Cells | None = None,
    ) -> None:
        """Append height f[rows, cols] m, pose f[10] in the order of POSE_FIELDS, statistics; cells always or never."""
        if height.shape != self.mask.shape:
            raise ValueError(
                f"height has shape {height.shape}; allowed: {self.mask.shape}, as the masks of its episode"
            )
        self._add_cells(cells)
        self._packed += self._packer.compress(self._change(quantised(height)))
        self._poses.append(np.asarray(pose, np.float32))
        self._times.append(float(time_s))
        self._stats.append({name: float(value) for name, value in stats.items()})

    def _add_cells(self, cells: Cells | None) -> None:
        if (cells is not None) != (self._cells is not None) and len(self):
            raise ValueError("cells are given at some moments only; allowed: at every moment of an episode, or at none")
        if self._cells is not None:
            self._cells.add(cells.fill)
        elif cells is not None:
            self._cells = CellTrack(cells)

    def _change(self, now: np.ndarray) -> bytes:
        if self._last is None:
            self._last = now
            return now.astype("<i4").tobytes()
        change = np.clip(now - self._last, -32768, 32767)
        self._last = self._last + change
        low_high = change.astype("<i2").ravel().view(np.uint8).reshape(-1, 2)
        return low_high.T.tobytes()

    def heights(self) -> bytes:
        """The deflated stream of all heights so far."""
        return bytes(self._packed) + self._packer.copy().flush()

    def frames(self) -> Iterator[Frame]:
        """Decode frame after frame."""
        cells = self.mask.size
        stream = zlib.decompressobj()
        rest, now = self.heights(), np.zeros(cells, np.int32)
        for index in range(len(self)):
            size = cells * (4 if index == 0 else 2)
            part, rest = _take(stream, rest, size)
            now = now + (np.frombuffer(part, "<i4") if index == 0 else _joined(part))
            height = (now * UNIT).astype(np.float32).reshape(self.mask.shape)
            yield Frame(height, self._poses[index], self._times[index], self._stats[index])

    def as_json(self) -> dict[str, object]:
        """Everything as JSON values; arrays as base64 of deflated little-endian numbers, one column after the other."""
        names = list(dict.fromkeys(name for stats in self._stats for name in stats))
        table = np.array([[stats.get(name, np.nan) for name in names] for stats in self._stats], "<f4")
        return {
            "label": self.label,
            "rows": self.mask.shape[0],
            "cols": self.mask.shape[1],
            "cell": self.cell,
            "frames": len(self),
            "unit": UNIT,
            "heights": _base64(self.heights()),
            "target": _base64(zlib.compress(self.target.astype("<i4").tobytes(), 9)),
            "mask": _base64(zlib.compress(self.mask.tobytes(), 9)),
            "poses": _columns(np.array(self._poses, "<f4").reshape(len(self), len(POSE_FIELDS))),
            "times": _columns(np.array(self._times, "<f4").reshape(len(self), 1)),
            "stat_names": names,
            "stats": _columns(table.reshape(len(self), len(names))),
            **({} if self._cells is None else {"cells": _described(self._cells)}),
        }


def _described(cells: CellTrack) -> dict[str, object]:
    return {
        "bottom": cells.bottom,
        "dy": cells.dy,
        "levels": cells.levels,
        "per_fill": PER_FILL,
        "fills": _base64(cells.fills()),
    }


def quantised(height: np.ndarray) -> np.ndarray:
    """Heights [m] as whole millimetres i4."""
    return np.rint(np.asarray(height, np.float64) / UNIT).astype(np.int32)


def _joined(planes: bytes) -> np.ndarray:
    """Low and high bytes back to i2."""
    return np.ascontiguousarray(np.frombuffer(planes, np.uint8).reshape(2, -1).T).view("<i2").ravel()


def _take(stream: "zlib._Decompress", rest: bytes, size: int) -> tuple[bytes, bytes]:
    """`size` inflated bytes, and the input that was not needed for them."""
    part = b""
    while len(part) < size:
        more = stream.decompress(rest, size - len(part))
        rest = stream.unconsumed_tail
        if not more and not rest:
            break
        part += more
    return part, rest


def _columns(table: np.ndarray) -> str:
    return _base64(zlib.compress(table.T.astype("<f4").tobytes(), 9))


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")
