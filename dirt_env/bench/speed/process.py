"""What a whole process shows: how long it takes to the first step, and that its memory stays the same."""

import gc
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import gymnasium

from dirt_env.bench.speed.drives import STEPS, scene, tapes

FIRST_STEP = (
    "import gymnasium, dirt_env; env = gymnasium.make('DirtPush-v0'); env.reset(seed=0); env.step((0.0, 1.0, 0.0))"
)
WARM_UP = 2000  # steps before memory is looked at, with their resets


def start() -> list[dict[str, Any]]:
    """Seconds from the start of Python to the first step: with no kernel compiled, and with all of them on disk."""
    with TemporaryDirectory() as folder:
        environment = {**os.environ, "DIRT_ENV_CACHE_DIR": folder}
        rows = []
        for cache in ("cold", "warm"):
            begin = perf_counter()
            subprocess.run([sys.executable, "-c", FIRST_STEP], env=environment, check=True)
            rows.append({"cache": cache, "seconds": perf_counter() - begin})
        return rows


def memory(steps: int, resets: int, show: Callable[[float], None]) -> dict[str, Any]:
    """Resident memory [MB] of a single environment before and after so many steps, and then so many resets.

    `show` is told from time to time which share is done. ValueError where the system does not tell.
    """
    env = gymnasium.make("DirtPush-v0", **scene(64))
    actions = tapes("random", 64).actions[:, 0]

    def drive(count: int) -> None:
        for step in range(count):
            if step % STEPS == 0:
                env.reset(seed=step // STEPS)
                show(0.5 * step / count)
            env.step(actions[step % STEPS])

    drive(WARM_UP)
    before = resident()
    drive(steps)
    driven = resident()
    for seed in range(resets):
        env.reset(seed=seed)
        if seed % 50 == 0:
            show(0.5 + 0.5 * seed / resets)
    after = resident()
    env.close()
    return {"steps": steps, "resets": resets, "before_mb": before, "after_steps_mb": driven, "after_resets_mb": after}


def resident() -> float:
    """Resident memory of this process [MB]."""
    gc.collect()
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        raise ValueError("--memory is given; allowed: on Linux, where /proc tells a process's memory") from None
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
