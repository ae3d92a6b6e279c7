"""A short memory: the last patches and poses of every world of a batch, stacked along their first axis."""

from collections.abc import Mapping, Sequence

import numpy as np

STACKED = ("patch", "pose")  # what the machine sees from where it stands; the overview shows the whole site as it is


def channel_places(name: str, channels: Sequence[str], frames: int) -> tuple[int, ...]:
    """Where a channel lies in patches of so many frames, the oldest first."""
    return tuple(frame * len(channels) + channels.index(name) for frame in range(frames))


class Frames:
    """The last `count` frames of each world, the oldest first: patches f4[n, count C, P, P], poses f4[n, count 15].

    Where an episode begins, its first frame stands in all places. Training and the trained policy both remember by
    this class. With a `count` of 1 nothing is kept, and observations are passed on as they are.
    """

    def __init__(self, count: int) -> None:
        """Remember nothing yet."""
        self.count = count
        self.kept: dict[str, np.ndarray] = {}

    def forget(self) -> None:
        """Let the next frame begin an episode in every world."""
        self.kept = {}

    def add(self, seen: Mapping[str, np.ndarray], begins: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """What is remembered, now that `seen` has come; `begins` bool[n] are the worlds whose first frame that is.

        Raises ValueError where frames of another number of worlds were seen before.
        """
        if self.count == 1:
            return dict(seen)
        if not self.kept:
            self.kept = {name: self._repeated(seen[name]) for name in STACKED}
        else:
            self.kept = {name: self._moved_on(name, seen[name]) for name in STACKED}
            if begins is not None and begins.any():
                for name in STACKED:
                    self.kept[name][begins] = self._repeated(seen[name][begins])
        return {**seen, **self.kept}

    def last(self, seen: Mapping[str, np.ndarray], world: int) -> dict[str, np.ndarray]:
        """What was remembered at the end of a world's episode, whose last frame `seen` is of that world alone.

        To be asked before `add` is told of the frame that begins the next one.
        """
        if self.count == 1:
            return dict(seen)
        ended = {name: self.kept[name][world] for name in STACKED}
        return {**seen, **{name: np.concatenate([kept[len(seen[name]) :], seen[name]]) for name, kept in ended.items()}}

    def _repeated(self, frames: np.ndarray) -> np.ndarray:
        return np.concatenate([frames] * self.count, axis=1)

    def _moved_on(self, name: str, frames: np.ndarray) -> np.ndarray:
        """The frames that are kept, without the oldest, and with these."""
        kept = self.kept[name]
        if len(kept) != len(frames):
            raise ValueError(f"{len(frames)} worlds are seen; allowed: {len(kept)}, as before, or `reset` first")
        return np.concatenate([kept[:, frames.shape[1] :], frames], axis=1)
