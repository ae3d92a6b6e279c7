"""Threads that work on a batch together."""

import os
import threading
import weakref
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

ENOUGH = 32  # worlds for each thread, or it is not worth waking it

Work = Callable[[int], bool]


class Crew:
    """Does work on several threads at once: the caller's, and others that it makes when it first needs them.

    Threads belong to a process: copies, pickles and forked children make their own.
    """

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._posts: list[SimpleQueue] = []  # one for each of the other threads
        self._process = os.getpid()

    def run(self, work: Work, threads: int) -> None:
        """Call work(0) here and work(1) ... on other threads, so many `threads` in all, which share out what is to do.

        A call returns whether it knows that all is done: if work(0) does, nobody waits for the others to say so, which
        takes as long as waking a thread. Otherwise this returns when all calls have, and raises what one of them
        raised.
        """
        if threads == 1:
            work(0)
            return
        ends: SimpleQueue = SimpleQueue()
        called = [(thread, post) for thread, post in enumerate(self._helpers(threads - 1), 1) if post.empty()]
        for thread, post in called:  # the others have not yet come to what was posted before
            post.put((work, thread, ends))
        is_done = False
        try:
            is_done = work(0)
        finally:
            failures = [] if is_done else [ends.get() for _ in called]
        for failure in failures:
            if failure is not None:
                raise failure

    def close(self) -> None:
        """Let the threads go; they come back if there is more to do."""
        if self._process == os.getpid():
            for post in self._posts:
                post.put(None)
        self._posts = []

    def _helpers(self, count: int) -> list[SimpleQueue]:
        """The posts of so many other threads, which are running."""
        if self._process != os.getpid():
            self._posts, self._process = [], os.getpid()
        while len(self._posts) < count:
            post: SimpleQueue = SimpleQueue()
            threading.Thread(target=_serve, args=(post,), name="dirt-push", daemon=True).start()
            weakref.finalize(self, post.put, None)
            self._posts.append(post)
        return self._posts[:count]

    def __getstate__(self) -> dict[str, Any]:
        """What pickle and deepcopy take along: no threads."""
        return {**self.__dict__, "_posts": []}


def _serve(post: SimpleQueue) -> None:
    """Do what is posted, until that is None."""
    while (task := post.get()) is not None:
        work, thread, ends = task
        try:
            work(thread)
            ends.put(None)
        except BaseException as error:
            ends.put(error)
        del task, work, ends  # which hold the arrays of a step


def threads_for(worlds: int) -> int:
    """How many threads a batch has if nobody says: the cores at hand, one in small batches."""
    affinity = getattr(os, "sched_getaffinity", None)
    cores = len(affinity(0)) if affinity else os.cpu_count() or 1
    return max(1, min(cores, worlds // ENOUGH))
