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
        self._end: weakref.finalize | None = None

    def run(self, work: Work, threads: int) -> None:
        """Call work(0) here and work(1) ... on other threads, so many `threads` in all, which share out what is to do.

        A call returns whether it knows that all is done: if work(0) does, nobody waits for the others to say so, which
        takes as long as waking a thread, nor hears what they raise then. Otherwise this returns when all calls have,
        after an interrupt too, and raises what one of them raised.
        """
        if threads == 1:
            work(0)
            return
        helpers, failures = self._helpers(threads - 1), []
        is_done = False
        try:
            for thread, post in enumerate(helpers, 1):
                if post.empty():  # or it has not yet come to what was posted before
                    post.put((work, thread, failures))
            is_done = work(0)
        finally:
            if not is_done:
                _wait_for(helpers)
        if not is_done and failures:
            raise failures[0]

    def close(self) -> None:
        """Let the threads go; they come back if there is more to do."""
        if self._process == os.getpid():
            _dismiss(self._posts)
        self._posts.clear()

    def _helpers(self, count: int) -> list[SimpleQueue]:
        """The posts of so many other threads, which are running."""
        if self._process != os.getpid():
            self._posts.clear()
            self._process = os.getpid()
        if self._end is None:
            self._end = weakref.finalize(self, _dismiss, self._posts)
            self._end.atexit = False  # as daemons they end with the process
        while len(self._posts) < count:
            post: SimpleQueue = SimpleQueue()
            threading.Thread(target=_serve, args=(post,), name="dirt-push", daemon=True).start()
            self._posts.append(post)
        return self._posts[:count]

    def __getstate__(self) -> dict[str, Any]:
        """What pickle and deepcopy take along: no threads."""
        return {**self.__dict__, "_posts": [], "_end": None}


def _dismiss(posts: list[SimpleQueue]) -> None:
    """Let the threads with these posts end, when they have done what was posted before."""
    for post in posts:
        post.put(None)


def _wait_for(posts: list[SimpleQueue]) -> None:
    """Wait until the threads with these posts have done what was posted so far; an interrupt is raised after that."""
    ends: SimpleQueue = SimpleQueue()
    try:
        for post in posts:
            post.put(ends)
        for _ in posts:
            ends.get()
    except BaseException:
        _wait_for(posts)
        raise


def _serve(post: SimpleQueue) -> None:
    """Do what is posted: work, or to say that all before is done, until it is None."""
    while (task := post.get()) is not None:
        if isinstance(task, SimpleQueue):
            task.put(None)
            continue
        work, thread, failures = task
        try:
            work(thread)
        except BaseException as error:
            failures.append(error)
        del task, work, failures  # which hold the arrays of a step


def threads_for(worlds: int) -> int:
    """How many threads a batch has if nobody says: the cores at hand, one in small batches."""
    return max(1, min(cores(), worlds // ENOUGH))


def cores() -> int:
    """How many cores this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1
