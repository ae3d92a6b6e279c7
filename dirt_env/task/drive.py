"""Many worlds driven by rows of commands, and nothing else: no job measured, no reward, no observation."""

import numpy as np

from dirt_env.sim.advance import step
from dirt_env.sim.intrinsics import uncounted
from dirt_env.sim.jit import entry
from dirt_env.sim.params import Command
from dirt_env.task.batch import Batch, Scratch, at, bank_at, blade_of, grid_of, machine_of, pull_at, soil_of, zones_at


@entry
def drive_worlds(batch: Batch, scratch: Scratch, commands: np.ndarray, done: np.ndarray) -> None:
    """Advance every world by the control steps of commands f8[steps, worlds, 3]: speed, yaw rate, edge of `Command`.

    Adds to done f8[2] what all worlds have cut [m3] and their sweeps.
    """
    batch, scratch = uncounted(batch), uncounted(scratch)
    for t in range(commands.shape[0]):
        for w in range(commands.shape[1]):
            scene, command = batch.scenes[w], commands[t, w]
            step(
                batch.height[w], at(batch.solid, w), at(batch.outside, w), batch.machine[w], batch.tally[w],
                scratch.buffers, scratch.links, scratch.link_levels, batch.changed[w], batch.pending[w],
                batch.episodes[w].quantum, grid_of(batch, scene), soil_of(scene), blade_of(scene), machine_of(scene),
                Command(command[0], command[1], command[2]), scene.period, pull_at(batch.pulls, w), at(batch.grade, w),
                zones_at(batch.zone, batch.soils, batch.zone_pulls, w), bank_at(batch, w),
            )  # fmt: skip
            done[0] += batch.tally[w].cut
            done[1] += batch.tally[w].sweeps
