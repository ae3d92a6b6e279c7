"""Trials on the machines of a Ray cluster. A trial whose machine is lost is played again elsewhere.

Ray is imported here only, when it is asked for: it pins an old gymnasium, so it has a virtual environment of its own.
"""

import logging
import os
import platform
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

from dirt_env.bench.evaluate.episode import Answer, LostWorkerError, Trial, answer, record_of
from dirt_env.bench.evaluate.origin import code_digest, origin
from dirt_env.bench.evaluate.pool import Records

RETRIES = 20  # of one trial; a policy that kills its process would otherwise go on for ever
NEEDED = 'needs ray: pip install ".[ray]" into a virtual environment of its own, since ray pins gymnasium 1.2.2'


def check_ray() -> None:
    """Raise ImportError without ray."""
    if find_spec("ray") is None:
        raise ImportError(f"--ray {NEEDED}")


def run_on_ray(trials: Sequence[Trial], address: str) -> Records:
    """Records of the trials as they are finished, from the cluster at that address ("auto", "local", host:port).

    Each trial takes one CPU. Raises as `dirt_env.bench.evaluate.pool.run_in_processes` does, ValueError for a machine
    whose code or libraries are others, and ImportError without ray.
    """
    check_ray()
    import ray

    try:
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
    except (ConnectionError, ValueError) as error:
        raise ValueError(f"--ray is {address!r}: {' '.join(str(error).split())}") from None
    try:
        remote = ray.remote(num_cpus=1, max_retries=RETRIES)(play_there)
        expected = fingerprint([trial.policy for trial in trials])
        at_work = {remote.remote(trial, os.getcwd(), expected): trial for trial in trials}
        while at_work:
            done, _ = ray.wait(list(at_work))
            for result in done:
                trial = at_work.pop(result)
                try:
                    found = ray.get(result)
                except ray.exceptions.RayError as error:
                    where = f"{trial.policy} in {trial.task.name}, layout {trial.layout}"
                    raise LostWorkerError(f"Ray gave up the episode of {where}: {error}".splitlines()[0]) from None
                yield record_of(found)
    finally:
        ray.shutdown()


def play_there(trial: Trial, folder: str, expected: dict[str, Any]) -> Answer:
    """Answer of a trial on another machine; `folder` is where modules of somebody's own are looked up too."""
    if folder not in sys.path:
        sys.path.append(folder)
    try:
        found = fingerprint(expected["policies"])
    except (ValueError, ImportError) as error:
        return Answer(error=(type(error).__name__, f"on {platform.node()}: {error}"))
    differ = [name for name in expected if found[name] != expected[name]]
    if differ:
        first = differ[0]
        words = f"{platform.node()} has {first} {found[first]}; allowed: {expected[first]}, as where it was begun"
        return Answer(error=("ValueError", words))
    return answer(trial)


def fingerprint(policies: Sequence[str]) -> dict[str, Any]:
    """What has to be the same on all machines."""
    names = sorted(set(policies))
    return {"policies": names, "code": code_digest(names), "versions": origin()["versions"]}
