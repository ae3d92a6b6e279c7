"""Worlds without an environment around them: the physics alone, and what it moves."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from dirt_env.bench.speed.drives import config, tapes
from dirt_env.config import SceneConfig, layout
from dirt_env.episode import Episode
from dirt_env.sim.params import Machine
from dirt_env.task.drive import drive_worlds
from dirt_env.worlds import Worlds

COUNTED = 64  # worlds in which the soil that is cut is added up
STATE = ("height", "machine", "tally", "changed", "pending")  # of a batch, what driving alters


class BareWorlds:
    """Worlds of one scene that are driven by commands; `done` holds the soil cut [m3] and the sweeps since `begin`."""

    def __init__(self, scene: SceneConfig, count: int) -> None:
        self.worlds = Worlds([scene] * count)
        self.done = np.zeros(2)
        self._scene = scene

    def begin(self, seeds: Sequence[int]) -> None:
        """Start world i on the layout of seeds[i]."""
        for i, seed in enumerate(seeds):
            self.worlds.put(i, Episode.begin(self._scene, layout(self._scene, np.random.default_rng(seed))))
        self.done[:] = 0.0

    def drive(self, commands: np.ndarray) -> None:
        """Advance all worlds by commands f8[steps, worlds, 3]."""
        self.worlds.run(drive_worlds, self.worlds.scratch(0), commands, self.done)

    def keep(self) -> dict[str, np.ndarray]:
        """A copy of what driving alters, for `restore`."""
        return {name: getattr(self.worlds.batch, name).copy() for name in STATE}

    def restore(self, kept: dict[str, np.ndarray]) -> None:
        """Put everything back as it was."""
        for name, array in kept.items():
            getattr(self.worlds.batch, name)[...] = array
        self.done[:] = 0.0


def commands_of(actions: np.ndarray, machine: Machine) -> np.ndarray:
    """Speed, yaw rate, edge f8[..., 3] of actions [..., 3] in [-1, 1]; see `dirt_env.task.actions.command_of`."""
    steering, speed, blade = np.moveaxis(np.clip(actions, -1.0, 1.0).astype(float), -1, 0)
    edge = blade * np.where(blade > 0.0, machine.lift, machine.cut)
    return np.ascontiguousarray(np.stack([speed * machine.speed, steering * machine.yaw_rate, edge], axis=-1))


@cache
def soil_per_step(size: int, drive: str, worlds: int, steps: int) -> float:
    """Soil that the blade cuts in a control step of one world [m3], over so many steps of the first worlds of a drive.

    Nothing is timed here: the worlds are the timed ones, which do the same to the last bit in every case.
    """
    tape, count = tapes(drive, size), min(worlds, COUNTED)
    bare = BareWorlds(config(size), count)
    bare.begin([tape.seed(world) for world in range(count)])
    bare.drive(commands_of(tape.rows(range(count))[:steps], config(size).machine))
    return float(bare.done[0]) / (count * min(steps, len(tape.actions)))


@cache
def bytes_per_world(size: int) -> int:
    """Bytes of all arrays that a batch holds for one world; the work space, one for each thread, is not among them."""
    batch = Worlds([config(size)]).batch
    arrays = [batch.height, batch.machine, batch.tally, batch.changed, batch.pending, batch.episodes, batch.scenes]
    arrays += [*batch.sums, *batch.job, batch.solid, batch.outside]
    return sum(array.nbytes for array in arrays if array is not None)
