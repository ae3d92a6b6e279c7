"""Runs cases in a process of their own, so that one that hangs or dies is named and the rest go on."""

from multiprocessing import get_context
from textwrap import shorten
from time import process_time
from typing import NamedTuple
from warnings import simplefilter

from dirt_env.bench.stability.registry import Case

START = 120.0  # s that a new process may take until it is ready
MOST_LETTERS = 600  # of what was measured; it goes on one line


class Row(NamedTuple):
    """What came of a case; `limit_s` is the wall-clock time it was given, `cpu_s` what it took of the processor."""

    case: str
    theme: str
    expected: str
    measured: str
    ok: bool
    cpu_s: float
    limit_s: float


class Watchdog:
    """A worker process with a time limit for each case; use as a context manager."""

    def __init__(self) -> None:
        self._process = self._pipe = None

    def __enter__(self) -> "Watchdog":
        return self

    def __exit__(self, *_) -> None:
        self._stop()

    def run(self, case: Case, quick: bool = False) -> Row:
        """The case's row; one that is not done in its time, or ends its process, has failed."""
        measured, ok, cpu = self._ask(case, quick)
        return Row(case.name, case.theme, case.expected, measured, ok, round(cpu, 3), case.limit)

    def _ask(self, case: Case, quick: bool) -> tuple[str, bool, float]:
        if self._process is None:
            self._start()
        self._pipe.send((case, quick))
        try:
            if self._pipe.poll(case.limit):
                return self._pipe.recv()
        except EOFError:
            self._process.join(5.0)
            code = self._process.exitcode
            self._stop()
            return f"its process died (exit status {code})", False, 0.0
        self._stop()
        return f"hung: no end within {case.limit:g} s", False, case.limit

    def _start(self) -> None:
        context = get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()
        if not self._pipe.poll(START):
            self._stop()
            raise TimeoutError(f"the process that measures did not start within {START:g} s")
        self._pipe.recv()

    def _stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._pipe.close()
            self._process = self._pipe = None


def serve(pipe) -> None:
    """Measure the cases that come through the pipe, until it is closed."""
    simplefilter("ignore")  # what a scene warns of is meant here
    pipe.send("ready")
    while True:
        try:
            case, quick = pipe.recv()
        except (EOFError, KeyboardInterrupt):
            return
        begin = process_time()
        try:
            measured, ok = case.run(quick)
        except Exception as error:  # whatever it is, the case has failed
            measured, ok = f"{type(error).__name__}: {error}", False
        measured = shorten(measured, MOST_LETTERS, placeholder=" ...")
        pipe.send((measured, ok, process_time() - begin))
