"""How one row is timed: chunks of steps, after everything is compiled, with CartPole in between."""

from collections.abc import Callable
from statistics import median
from time import perf_counter, process_time
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from dirt_env.bench.speed.bare import bytes_per_world, soil_per_step
from dirt_env.bench.speed.cases import CASES, Runner
from dirt_env.bench.speed.drives import config, tapes

CHUNKS = 5  # at least
LONGEST = 100  # steps of a chunk: five fit in an episode
PATIENCE = 8.0  # times the effort, resets included, after which no more chunks than needed are timed


class Item(NamedTuple):
    """One row: a case on size x size cells."""

    case: str
    size: int
    num_envs: int
    threads: int
    drive: str

    def named(self) -> dict[str, Any]:
        """The row's first columns."""
        named = {"case": self.case, "rows": self.size, "cols": self.size, "num_envs": self.num_envs}
        return {**named, "threads": self.threads, "drive": self.drive, "observation": self.case != "world"}


class Effort(NamedTuple):
    """Seconds of a chunk, of all chunks of a row, and of each CartPole chunk."""

    chunk: float = 0.15
    row: float = 0.6
    cartpole: float = 0.03


QUICK = Effort(0.03, 0.1, 0.01)


class CartPole:
    """Gymnasium's CartPole-v1 with random actions; every episode is reset when it ends."""

    def __init__(self) -> None:
        self._env = gymnasium.make("CartPole-v1")
        self._actions = np.random.default_rng(0).integers(0, 2, 4096).tolist()
        self._env.reset(seed=0)
        self.found: list[float] = []
        self.chunk(0.02)
        self.found.clear()

    def chunk(self, seconds: float) -> float:
        """Steps per second over about so many seconds; kept in `found`."""
        env, actions, count, begin = self._env, self._actions, 0, perf_counter()
        while perf_counter() - begin < seconds:
            for action in actions[:256]:
                _, _, terminated, truncated, _ = env.step(action)
                if terminated or truncated:
                    env.reset()
            count += 256
        self.found.append(count / (perf_counter() - begin))
        return self.found[-1]


def measure(item: Item, effort: Effort, cartpole: CartPole) -> dict[str, Any]:
    """The row of a case; ValueError where a scene cannot have so many cells."""
    tape = tapes(item.drive, item.size)
    runner = CASES[item.case](item.size, item.num_envs, item.threads)
    try:
        return _row(item, effort, cartpole, runner, tape)
    finally:
        runner.close()


def _row(item: Item, effort: Effort, cartpole: CartPole, runner: Runner, tape: Any) -> dict[str, Any]:
    worlds, episode = item.num_envs, 0
    resets: list[float] = []

    def begin() -> np.ndarray:
        nonlocal episode
        ids = range(episode * worlds, (episode + 1) * worlds)
        resets.append(seconds(lambda: runner.reset([tape.seed(world) for world in ids])))
        episode += 1
        return tape.rows(ids)

    actions = begin()
    runner.steps(actions[:1])  # compiles
    length = _length(seconds(lambda: runner.steps(actions[1:3])) / 2, len(actions), effort)
    episode, at = 0, len(actions)
    resets.clear()
    chunks, begun = [], perf_counter()
    while len(chunks) < CHUNKS or (
        sum(wall for wall, _, _ in chunks) < effort.row and perf_counter() - begun < PATIENCE * effort.row
    ):
        if at + length > len(actions):
            actions, at = begin(), 0
        steps = actions[at : at + length]
        chunks.append((*timed(lambda steps=steps: runner.steps(steps)), cartpole.chunk(effort.cartpole)))
        at += length
    chunk_s, cpu = median(wall for wall, _, _ in chunks), sum(cpu for _, cpu, _ in chunks)
    return _figures(item, length, len(chunks), chunk_s, cpu, median(pole for _, _, pole in chunks), resets, episode)


def _figures(
    item: Item,
    length: int,
    chunks: int,
    chunk_s: float,
    cpu: float,
    pole: float,
    resets: list[float],
    episodes: int,
) -> dict[str, Any]:
    """The row of so many chunks of `length` steps; median seconds of one, and processor seconds of all."""
    done = length * chunks * item.num_envs
    rate = length * item.num_envs / chunk_s
    per_episode = length * min(chunks, len(tapes(item.drive, item.size).actions) // length)
    soil = soil_per_step(item.size, item.drive, item.num_envs * episodes, per_episode)
    return {
        **item.named(),
        "steps_per_s": rate,
        "cartpole_ratio": rate / pole,
        "sim_s_per_cpu_s": config(item.size).task.period * done / cpu,
        "m3_per_cpu_s": soil * done / cpu,
        "us_per_step": 1e6 / rate,
        "cpu_us_per_step": 1e6 * cpu / done,
        "m3_per_step": soil,
        "reset_us_per_world": 1e6 * median(resets) / item.num_envs,
        "bytes_per_world": bytes_per_world(item.size),
        "cartpole_steps_per_s": pole,
        "chunks": chunks,
        "steps_per_chunk": length,
    }


def _length(step: float, most: int, effort: Effort) -> int:
    """Steps of a chunk, given the seconds of one."""
    return max(1, min(LONGEST, most // CHUNKS, int(effort.chunk / max(step, 1e-9))))


def seconds(work: Callable[[], object]) -> float:
    return timed(work)[0]


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Wall time and processor time of the work [s]."""
    wall, cpu = perf_counter(), process_time()
    work()
    return perf_counter() - wall, process_time() - cpu
