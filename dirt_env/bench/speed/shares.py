"""Where the time of a native step goes: the same worlds and actions, phase by phase."""

from statistics import median

import numpy as np

from dirt_env.bench.speed.bare import BareWorlds, commands_of
from dirt_env.bench.speed.cases import native
from dirt_env.bench.speed.drives import config, tapes
from dirt_env.bench.speed.measure import seconds
from dirt_env.task.step import BOOK, FIGURES, SHOW

SIZE, WORLDS = 64, 256


def shares(steps: int) -> dict[str, float]:
    """Microseconds of a world's step that go to physics, gauge and reward, observation and Python, and all of them.

    Random driving, one thread. The phases are timed in turn on worlds that do the same as those of the environment:
    driving them; measuring, booking and showing them; showing them once more. Python is what is left of the whole step.
    """
    tape, scene = tapes("random", SIZE), config(SIZE)
    seeds = [tape.seed(world) for world in range(WORLDS)]
    actions = tape.rows(range(WORLDS))
    commands = commands_of(actions, scene.machine)
    whole, bare = native(SIZE, WORLDS, 1), BareWorlds(scene, WORLDS)
    whole.reset(seeds)
    bare.begin(seeds)
    _, sight = bare.worlds.observer.blanks(WORLDS)
    rest = sight, np.empty((len(FIGURES), WORLDS)), 0, WORLDS, 0
    times = []
    for step in range(steps + 1):
        phases = (
            lambda step=step: bare.drive(commands[step : step + 1]),
            lambda: bare.worlds.step_from(BOOK, *rest),
            lambda: bare.worlds.step_from(SHOW, *rest),
            lambda step=step: whole.steps(actions[step : step + 1]),
        )
        times.append([seconds(phase) for phase in phases])
    whole.close()
    physics, booked, shown, total = (1e6 * median(column) / WORLDS for column in zip(*times[1:], strict=True))
    parts = {"physics": physics, "gauge_and_reward": booked - shown, "observation": shown}
    return {**parts, "python": total - physics - booked, "whole_step": total}
