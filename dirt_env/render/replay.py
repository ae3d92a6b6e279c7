"""Records episodes and writes them as a 3-D replay for a browser, or as an animated picture."""

from collections.abc import Mapping
from math import ceil
from os import PathLike
from pathlib import Path

import numpy as np

from dirt_env.render.atomic import write_atomically
from dirt_env.render.cell_track import Cells
from dirt_env.render.film import gif
from dirt_env.render.page import build_page
from dirt_env.render.track import DESIGN, GOAL, POSE_FIELDS, SOLID, START, Track
from dirt_env.sim.params import Blade, Machine

_SIDE = 256  # cells: larger sites are recorded coarser


class Recorder:
    """Collects what happens on a site. `begin` an episode, `add` its moments, `write_*` when done (or in between).

    Of the moments every `every`-th is kept, and always the first and the last of an episode.
    """

    def __init__(self, title: str, description: str, cell: float, blade: Blade, machine: Machine, every: int = 1):
        if every < 1:
            raise ValueError(f"every is {every}; allowed: >= 1")
        self.title, self.description, self.cell = title, description, cell
        self.blade, self.machine, self.every = blade, machine, every
        self.tracks: list[Track] = []
        self._count = 0
        self._late: tuple | None = None

    def begin(
        self,
        label: str,
        *,
        start: np.ndarray,
        goal: np.ndarray,
        target: np.ndarray,
        design: np.ndarray | None = None,
        solid: np.ndarray | None = None,
    ) -> None:
        """Start an episode: regions bool[rows, cols], target ground f8[rows, cols] m."""
        self._keep_late()
        self._coarser = ceil(max(target.shape) / _SIDE)
        mask = np.zeros(_blocks(target, self._coarser).shape[::2], np.uint8)
        for region, bit in ((start, START), (goal, GOAL), (design, DESIGN), (solid, SOLID)):
            if region is not None:
                share = _mean(region.astype(np.float32), self._coarser)
                mask |= np.where(share > 0 if bit == SOLID else share >= 0.5, bit, 0).astype(np.uint8)
        self.tracks.append(Track(label, self.cell * self._coarser, mask, _mean(target, self._coarser)))
        self._count = 0

    def add(
        self,
        height: np.ndarray,
        pose: np.void,
        time_s: float,
        stats: Mapping[str, float],
        cells: Cells | None = None,
    ) -> None:
        """One moment: height f4[rows, cols] m, the machine's record, time since the start, statistics by name.

        Names may carry their unit (`volume_moved_m3`, `work_kj`); `share_in_goal` is drawn as a curve.
        Where `cells` are given, at every moment of an episode, the replay shows them at a switch.
        """
        if not self.tracks:
            raise RuntimeError("nothing is being recorded: call begin first")
        values = np.array([pose[name] for name in POSE_FIELDS], np.float32)
        if cells is not None:
            cells = cells._replace(fill=_mean(cells.fill, self._coarser))
        moment = (_mean(height, self._coarser), values, time_s, dict(stats), cells)
        self._late = None
        if self._count % self.every == 0:
            self.tracks[-1].add(*moment)
        else:
            self._late = moment
        self._count += 1

    def keep(self, episodes: int) -> None:
        """Forget what was recorded after the first `episodes` episodes."""
        if len(self.tracks) > episodes:
            del self.tracks[episodes:]
            self._late = None

    def write_html(self, path: str | PathLike[str]) -> None:
        """Write the 3-D replay, one file that needs nothing else."""
        write_atomically(Path(path), build_page(self.as_json()).encode("utf-8", "replace"))

    def as_json(self) -> dict[str, object]:
        """What a page is built from, as JSON values; RuntimeError if nothing was recorded."""
        return {
            "title": self.title,
            "description": self.description,
            "blade": self.blade._asdict(),
            "machine": self.machine._asdict(),
            "episodes": [track.as_json() for track in self._recorded()],
        }

    def write_gif(
        self, path: str | PathLike[str], seconds: float = 12.0, fps: float = 12.5, width_px: int = 440, episode: int = 0
    ) -> None:
        """Write an animated picture of one episode that lasts about `seconds`. Needs pillow."""
        track = self._recorded()[episode]
        write_atomically(Path(path), gif(track, self.blade, self.machine, seconds, fps, width_px))

    def _recorded(self) -> list[Track]:
        self._keep_late()
        tracks = [track for track in self.tracks if len(track)]
        if not tracks:
            raise RuntimeError("nothing was recorded: call begin and add first")
        return tracks

    def _keep_late(self) -> None:
        """Keep the last moment that was left out so far."""
        if self._late is not None:
            self.tracks[-1].add(*self._late)
            self._late = None


def _blocks(values: np.ndarray, cells: int) -> np.ndarray:
    """Views of `cells` x `cells` blocks [rows, cells, cols, cells, ...]; the northern and eastern edge are held."""
    pad = [(0, -side % cells) for side in values.shape[:2]] + [(0, 0)] * (values.ndim - 2)
    padded = np.pad(values, pad, mode="edge")
    return padded.reshape(padded.shape[0] // cells, cells, padded.shape[1] // cells, cells, *values.shape[2:])


def _mean(values: np.ndarray, cells: int) -> np.ndarray:
    """Means over `cells` x `cells` blocks; the array itself where that is one."""
    return values if cells == 1 else _blocks(values, cells).mean(axis=(1, 3))
