"""Trials in processes of their own: each worker is given one at a time over a pipe, and ends when the pipe does."""

import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from dirt_env.bench.evaluate.episode import LostWorkerError, Trial, answer, record_of, run_trial

Records = Iterator[dict[str, Any]]


def run_here(trials: Sequence[Trial]) -> Records:
    """Records of the trials one after the other, in this process."""
    return map(run_trial, trials)


def run_in_processes(trials: Sequence[Trial], workers: int) -> Records:
    """Records of the trials as they are finished, from `workers` processes.

    Raises PolicyFailureError as `run_trial` does, ValueError or ImportError for a policy that cannot be made, and
    LostWorkerError for a worker that was killed. Closing the iterator ends the workers.
    """
    todo = list(reversed(trials))
    with _workers(min(workers, len(trials)), _serve) as crew:
        at_work: dict[Connection, Trial] = {}
        for pipe in crew:
            _give(pipe, todo, at_work)
        while at_work:
            for pipe in wait(list(at_work)):
                trial = at_work.pop(pipe)
                yield _record(pipe, crew[pipe], trial)
                _give(pipe, todo, at_work)


def _give(pipe: Connection, todo: list[Trial], at_work: dict[Connection, Trial]) -> None:
    """Give a worker the next trial, if there is one."""
    if todo:
        at_work[pipe] = trial = todo.pop()
        with suppress(OSError):  # of a dead worker, which is said when its answer is read
            pipe.send(trial)


def _record(pipe: Connection, worker: BaseProcess, trial: Trial) -> dict[str, Any]:
    """What a worker answers."""
    try:
        found = pipe.recv()
    except (EOFError, OSError):
        worker.join(5.0)
        where = f"{trial.policy} in {trial.task.name}, layout {trial.layout}"
        raise LostWorkerError(
            f"a worker ended (status {worker.exitcode}) in the episode of {where}; out of memory?"
        ) from None
    return record_of(found)


@contextmanager
def _workers(count: int, serve: Callable[[Connection], None]) -> Iterator[dict[Connection, BaseProcess]]:
    """Started processes by their pipes; ended on leaving."""
    context, crew = get_context("spawn"), {}
    try:
        for _ in range(count):
            ours, theirs = context.Pipe()
            worker = context.Process(target=serve, args=(theirs,), daemon=True)
            worker.start()
            theirs.close()
            crew[ours] = worker
        yield crew
    finally:
        for pipe, worker in crew.items():
            pipe.close()
            worker.terminate()
        for worker in crew.values():
            worker.join()


def _serve(pipe: Connection) -> None:
    """Run trials until the pipe is closed, as it is too when the process at its other end is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one that gave the work
    while True:
        try:
            trial = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            pipe.send(answer(trial))
        except OSError:
            return
