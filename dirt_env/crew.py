"""Threads that share the worlds of a batch among them."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

SHARES = 4  # slices for each thread: those who have the easy worlds take over some of the others'
LEAST = 8  # worlds in a slice, 100 us and more of work
ENOUGH = 32  # worlds for each thread, or it is not worth waking it

Work = Callable[[int, int, int], None]


class Crew:
    """Runs work(thread, first, last) over slices of worlds, on threads that it makes when it first needs them.

    Every world is worked on once, by whichever thread comes by, so the result is the same for any number of threads.
    Threads belong to a process: copies, pickles and forked children make their own.
    """

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._pool: ThreadPoolExecutor | None = None
        self._process = 0

    def run(self, work: Work, count: int) -> None:
        """Do the work on `count` worlds; returns when all is done, and raises what a slice raised."""
        if self.threads == 1 or count <= LEAST:
            work(0, 0, count)
            return
        size = max(LEAST, -(-count // (SHARES * self.threads)))
        slices = iter(range(0, count, size))  # the interpreter's lock lets one thread at a time take the next

        def take_turns(thread: int) -> None:
            for first in slices:
                work(thread, first, min(first + size, count))

        others = [self._threads().submit(take_turns, thread) for thread in range(1, self.threads)]
        try:
            take_turns(0)
        finally:
            failures = [other.exception() for other in others]  # waits; nobody works on when this returns
        for failure in failures:
            if failure is not None:
                raise failure

    def close(self) -> None:
        """Let the threads go; they come back if there is more to do."""
        if self._pool is not None and self._process == os.getpid():
            self._pool.shutdown()
        self._pool = None

    def _threads(self) -> ThreadPoolExecutor:
        if self._pool is None or self._process != os.getpid():
            self._pool = ThreadPoolExecutor(self.threads - 1, thread_name_prefix="dirt-push")
            self._process = os.getpid()
        return self._pool

    def __getstate__(self) -> dict[str, Any]:
        """What pickle and deepcopy take along: no threads."""
        return {**self.__dict__, "_pool": None}


def threads_for(worlds: int) -> int:
    """How many threads a batch has if nobody says: the cores at hand, one in small batches."""
    affinity = getattr(os, "sched_getaffinity", None)
    cores = len(affinity(0)) if affinity else os.cpu_count() or 1
    return max(1, min(cores, worlds // ENOUGH))
