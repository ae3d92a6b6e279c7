"""What a scene may leave out: the time of a step with it and without it.

`tests/bench/test_lean.py` proves for each that the lean step gives the full one's result, to the last bit, where the
feature is there but neutral; for traction and noise `tests/sim/test_traction.py` and `tests/test_soil_and_noise.py` do,
for other soils by region and swell `tests/sim/test_zones.py` and `tests/sim/test_bank.py`.
"""

from collections.abc import Callable, Sequence
from statistics import median
from time import perf_counter, process_time
from typing import NamedTuple

import numpy as np

from dirt_env.env import DirtPushEnv
from dirt_env.sim.advance import advance, settle
from dirt_env.sim.params import Command
from dirt_env.sim.voxel_advance import advance_voxels
from dirt_env.sim.zones import SOILS, Zones
from dirt_env.task.goal import Gauge
from dirt_env.task.job import Job, make_job
from dirt_env.vector import DirtPushVectorEnv

ACTIONS = [(steering, 1.0, blade) for steering in (-0.3, 0.2, 0.4) for blade in (-0.6, 0.0, 0.5)]
WORLDS = 16  # of the batch that is asked for infos
Step = Callable[[], object]


class Feature(NamedTuple):
    """Something a scene may leave out; `make(True)` is a step with it, `make(False)` one without, of the same work."""

    name: str
    neutral: str
    make: Callable[[bool], Step]


class Row(NamedTuple):
    """Processor time of a step in microseconds, and how many times longer the full one takes."""

    feature: str
    neutral: str
    full_us: float
    lean_us: float
    ratio: float


def started(**options) -> DirtPushEnv:
    """An environment at the start of an episode, always the same."""
    env = DirtPushEnv(**{"level": 1, **options})
    env.reset(seed=1)
    return env


def env_step(env: DirtPushEnv) -> Step:
    """Steps of an environment; it begins anew every 50 so that all go over the same ground."""
    state, count = env.get_state(), 0

    def step():
        nonlocal count
        env.step(ACTIONS[count % len(ACTIONS)])
        count += 1
        if count % 50 == 0:
            env.set_state(state)

    return step


def world_step(env: DirtPushEnv, command: Command, zones: Zones | None = None, **fields) -> Step:
    """Steps of the physics alone, with some fields of the world replaced, back and forth on the same ground."""
    world, move = env.episode.world._replace(**fields), physics(env, zones)
    back = command._replace(speed=-command.speed)
    forward = True

    def step():
        nonlocal forward
        move(world, command if forward else back)
        forward = not forward

    return step


def physics(env: DirtPushEnv, zones: Zones | None = None) -> Callable[..., None]:
    """A function of a world of the environment's scene and a command: one control step of its terrain.

    `zones` are of a height field.
    """
    config = env.config
    fixed, period = (config.grid, config.soil, config.blade, config.machine), config.task.period
    if config.terrain.kind == "heightfield":
        return lambda world, command: advance(world, *fixed, command, period, None, zones)
    rules, pace = config.terrain.rules_for(config.grid, config.soil), float(config.terrain.updates_per_second)
    return lambda world, command: advance_voxels(world, *fixed, rules, pace, command, period)


def _terrain(full: bool) -> Step:
    return env_step(started(terrain="voxel" if full else "heightfield"))


def _constraints(full: bool) -> Step:
    env = started(terrain={"kind": "voxel", "life": 100 if full else 0})
    return world_step(env, Command(1.0, 0.0, 0.0))


def _barrier(full: bool) -> Step:
    return world_step(started(), Command(1.0, 0.0, -0.02 if full else 0.75))


def _slump(full: bool) -> Step:
    env = started()
    world, config = env.episode.world, env.config

    def sweep():
        if full:
            settle(world, config.grid, config.soil)
        else:
            move(world, still)

    move, still = physics(env), Command(0.0, 0.0, 0.75)
    return sweep


def _solid(full: bool) -> Step:
    env = started()
    solid = np.zeros(env.episode.world.height.shape, bool) if full else None
    return world_step(env, Command(1.0, 0.0, -0.02), solid=solid)


def _open_border(full: bool) -> Step:
    env = started()
    return world_step(env, Command(1.0, 0.0, -0.02), outside=env.episode.world.height.copy() if full else None)


def empty_design(env: DirtPushEnv) -> Job:
    """The job of the environment's episode with a design surface whose region is empty."""
    world, layout, config = env.episode.world, env.episode.layout, env.config
    limit = config.observation.height_limit
    layout = layout._replace(design=np.zeros(world.height.shape, bool))
    return make_job(world.height, layout, config.grid.cell, min(config.blade.height, limit), limit)


def _design(full: bool) -> Step:
    env = started()
    gauge = Gauge(empty_design(env) if full else env.episode.job, env.config.grid.cell)
    height = env.episode.world.height
    return lambda: gauge.measure(height)


def _traction(full: bool) -> Step:
    return env_step(started(traction={}) if full else started())


def _zones(full: bool) -> Step:
    env = started()
    soils = np.array([tuple(env.config.soil)] * 2, SOILS)
    index = (np.indices(env.episode.world.height.shape).sum(axis=0) % 2).astype(np.int8)
    zones = Zones(index, soils, None, np.zeros(2), np.zeros(2)) if full else None
    return world_step(env, Command(1.0, 0.0, -0.02), zones)


def _swell(full: bool) -> Step:
    env = started()
    maps = {name: env.episode.world.height.copy() for name in ("bank", "natural")} if full else {}
    return world_step(env, Command(1.0, 0.0, -0.02), **maps)


def _noise(full: bool) -> Step:
    return env_step(started(observation={"noise": {"height": 0.01}}) if full else started())


def _observation(name: str) -> Callable[[bool], Step]:
    return lambda full: env_step(started(observation={name: full}))


def _info(full: bool) -> Step:
    env = DirtPushVectorEnv(WORLDS, info="all" if full else "none", threads=1, level=1)
    env.reset(seed=1)
    actions, count = np.tile(np.array(ACTIONS)[:, None], (1, WORLDS, 1)), 0

    def step():
        nonlocal count
        env.step(actions[count % len(actions)])
        count += 1
        if count % 50 == 0:
            env.reset(seed=1)

    return step


def _render(full: bool) -> Step:
    env = started(render_mode="rgb_array" if full else None)
    step = env_step(env)

    def drawn():
        step()
        if full:
            env.render()

    return drawn


FEATURES = (
    Feature("third dimension", "one height for each column (terrain heightfield)", _terrain),
    Feature("ageing constraints", "cells whose constraints live 0 updates", _constraints),
    Feature("blade in the soil", "a lifted blade", _barrier),
    Feature("slumping", "nothing is pending", _slump),
    Feature("obstacles", "no cell is solid", _solid),
    Feature("open border", "no soil near it", _open_border),
    Feature("design surface", "its region is empty", _design),
    Feature("draft and traction", "no table traction", _traction),
    Feature("soil by region", "all soils the same", _zones),
    Feature("bank and loose soil", "a swell of 0", _swell),
    Feature("noise of heights", "no table observation.noise", _noise),
    Feature("overview", "observation.overview false", _observation("overview")),
    Feature("map", "observation.map false", _observation("map")),
    Feature(f"info of a batch of {WORLDS}", 'info="none"', _info),
    Feature("rendering", "render_mode None", _render),
)


def batch(step: Step, seconds: float) -> float:
    """Mean processor time of a step [us] over about so many seconds."""
    begin, cpu, count = perf_counter(), process_time(), 0
    while not count or perf_counter() - begin < seconds:
        for _ in range(10):
            step()
        count += 10
    return 1e6 * (process_time() - cpu) / count


def measure(feature: Feature, batches: int = 7, seconds: float = 0.1) -> Row:
    """The row of a feature: medians of batches that take turns, so that a busy machine slows both alike."""
    steps = [feature.make(True), feature.make(False)]
    for step in steps:
        batch(step, 0.02)  # compiles, fills caches
    times = [[batch(step, seconds) for step in steps] for _ in range(batches)]
    full, lean = (median(column) for column in zip(*times, strict=True))
    ratio = median(pair[0] / max(pair[1], 1e-3) for pair in times)
    return Row(feature.name, feature.neutral, round(full, 3), round(lean, 3), round(ratio, 2))


def rows(features: Sequence[Feature] = FEATURES, **effort) -> list[Row]:
    """The table's rows: time of a step with each feature and without it."""
    return [measure(feature, **effort) for feature in features]


def table(found: Sequence[Row]) -> str:
    """The rows as Markdown."""
    lines = ["| feature | with, us | without, us | ratio | without means |", "|---|---|---|---|---|"]
    lines += [
        f"| {row.feature} | {row.full_us:.1f} | {row.lean_us:.1f} | {row.ratio:.2f} | {row.neutral} |" for row in found
    ]
    return "\n".join(lines)
