"""What only shows after very many steps."""

import tracemalloc

import numpy as np

from dirt_env.bench.stability.driving import sound, started
from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import total
from dirt_env.env import DirtPushEnv

HOUR = 3600.0


def _drive(env, count, seed=1):
    """So many control steps of random driving with digging, a new direction every eight."""
    rng = np.random.default_rng(seed)
    for _ in range(count // 8):
        action = [rng.uniform(-1, 1), rng.choice([-1, 1, 1]), rng.uniform(-1, 0.3)]
        for _ in range(8):
            env.step(action)


@case(
    "random driving with digging, 1e6 float32 steps: the sum of heights equal to the last bit",
    limit=HOUR,
    counts=(1_000_000, 100_000),
)
def a_million_steps(count):
    env = started(1, level=4)
    world = env.episode.world
    before, start = total(world), world.height.copy()
    _drive(env, count)
    moved = float(np.abs(world.height - start).sum()) * env.config.grid.cell**2
    off = total(world) - before
    return (
        f"off by {off:g} m after {env.episode.totals.steps} steps, {moved:.1f} m3 changed",
        off == 0.0 and moved > 1.0,
    )


@case(
    "the same over an open border, 2e5 steps: ground and ledger equal the start", limit=600.0, counts=(200_000, 20_000)
)
def a_long_drive_on_an_open_site(count):
    env = started(1, level=4, site={"border": "open"})
    world, cell = env.episode.world, env.config.grid.cell
    before = total(world)
    _drive(env, count)
    off = total(world) + env.episode.totals.lost / cell**2 - before
    return f"{env.episode.totals.lost:.3f} m3 left, books off by {off:g} m", off == 0.0 and env.episode.totals.lost > 0


@case(
    "the work of a step does not grow: sweeps in the last tenth of 1e5 steps at most twice those in the second",
    limit=600.0,
    counts=(100_000, 10_000),
)
def the_work_does_not_grow(count):
    env = started(2, level=4)
    sweeps, rng = np.zeros(10), np.random.default_rng(2)
    for k in range(10):
        for _ in range(count // 80):
            action = [rng.uniform(-1, 1), rng.choice([-1, 1, 1]), rng.uniform(-1, 0.3)]
            for _ in range(8):
                env.step(action)
                sweeps[k] += env.episode.world.tally[0].sweeps
    per_step = sweeps / (count / 10)
    return f"{per_step[1]:.0f} and {per_step[9]:.0f} sweeps a step", per_step[9] <= 2 * per_step[1]


@case(
    "memory is flat: 20,000 steps with observations and 100 resets keep under 1 MB more",
    limit=600.0,
    counts=(20_000, 4000),
)
def memory_is_flat(count):
    env = started(0, level=2)
    action = np.array([0.2, 1.0, -0.3])

    def lap(steps):
        for k in range(steps):
            env.step(action)
            if k % (steps // 50) == 0:
                env.reset(seed=k)

    lap(500)
    tracemalloc.start()
    lap(count // 2)
    first = tracemalloc.get_traced_memory()[0]
    lap(count // 2)
    grown = tracemalloc.get_traced_memory()[0] - first
    tracemalloc.stop()
    return f"{grown / 1e3:.0f} kB more in the second half", grown < 1e6


@case("200 resets of random levels, 10 steps each: potential and observations sound, volume equal", counts=(200, 40))
def many_resets(count):
    good = True
    envs = [DirtPushEnv(level=level) for level in range(6)]
    for seed in range(count):
        env = envs[seed % 6]
        env.reset(seed=seed)
        before = total(env.episode.world)
        for _ in range(10):
            seen, reward, _, _, info = env.step([0.1, 1.0, -0.5])
            good &= sound(env, seen, reward, info)
        good &= total(env.episode.world) == before
    return f"{count} resets, all sound: {good}", good
