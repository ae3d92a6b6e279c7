"""Threads work together: every call made or made unnecessary, all done on return, failures raised."""

import copy
import gc
import subprocess
import sys
import threading
import time
import weakref

import pytest

from dirt_env.crew import Crew, threads_for


def helpers():
    return sum(thread.name == "dirt-push" for thread in threading.enumerate())


def comes_true(condition):
    deadline = time.monotonic() + 30.0
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)
    return condition()


@pytest.mark.parametrize("threads", [1, 2, 3, 7])
def test_every_thread_is_called_once_and_has_returned(threads):
    crew, done = Crew(threads), []
    for _ in range(3):
        crew.run(lambda thread: done.append((thread, threading.get_ident())), threads)
    assert sorted(thread for thread, _ in done) == sorted(3 * list(range(threads)))
    assert len(set(done)) == threads  # each on the same one every time
    assert (0, threading.get_ident()) in done
    crew.close()


def test_threads_work_at_the_same_time():
    """Calls that wait for each other return only on two threads."""
    crew, meeting = Crew(2), threading.Barrier(2, timeout=30)
    crew.run(lambda thread: meeting.wait() < 0, 2)
    crew.close()


def test_nobody_waits_for_a_thread_when_all_is_known_to_be_done():
    crew, begun, gate, done = Crew(2), threading.Event(), threading.Event(), []

    def work(thread):
        if thread == 1:
            begun.set()
            gate.wait(30)
        done.append(thread)
        return thread == 0

    crew.run(work, 2)
    assert begun.wait(30)
    for _ in range(4):
        crew.run(work, 2)
    assert done == [0] * 5
    gate.set()
    assert comes_true(lambda: done.count(1) == 2)  # who has not come to the last call is not given more
    crew.run(lambda thread: done.append(thread), 2)
    assert done.count(1) == 3
    crew.close()


def test_no_thread_is_started_for_one():
    before = helpers()
    Crew(4).run(lambda thread: None, 1)
    assert helpers() == before


@pytest.mark.parametrize("failing", [0, 1])
def test_what_a_call_raises_is_raised_when_all_have_returned_and_the_crew_works_on(failing):
    crew, done = Crew(3), []

    def work(thread):
        if thread == failing:
            raise ArithmeticError("out of soil")
        time.sleep(0.05)
        done.append(thread)

    with pytest.raises(ArithmeticError, match="out of soil"):
        crew.run(work, 3)
    assert sorted(done) == sorted({0, 1, 2} - {failing})
    crew.run(lambda thread: done.append(thread), 3)
    assert len(done) == 5
    crew.close()


INTERRUPTED = """
import signal, threading, time
from dirt_env.crew import Crew

crew, begun, gate, done = Crew(2), threading.Event(), threading.Event(), []
signal.signal(signal.SIGINT, signal.default_int_handler)  # which jobs in the background have not

def work(thread):
    if thread == 1:
        begun.set()
        gate.wait(30)
        done.append(thread)
    else:
        begun.wait(30)
        if WHERE == "in the call":
            time.sleep(30)
    return False

def interrupt():
    begun.wait(30)
    time.sleep(0.2)
    signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
    time.sleep(0.2)
    gate.set()

threading.Thread(target=interrupt).start()
try:
    crew.run(work, 2)
except KeyboardInterrupt:
    print("interrupted", done)
crew.run(lambda thread: done.append(thread), 2)
print(sorted(done))
"""


@pytest.mark.parametrize("where", ["in the call", "in the wait"])
def test_an_interrupt_is_raised_when_nobody_works_any_more(where):
    code = f"WHERE = {where!r}" + INTERRUPTED
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=100)
    assert (out.stdout, out.stderr) == ("interrupted [1]\n[0, 1, 1]\n", "")


def test_crews_that_are_closed_again_and_again_leave_nothing_behind():
    crew = Crew(3)
    for _ in range(5):
        crew.run(lambda thread: None, 3)
        crew.close()
    ends = [end for end in list(weakref.finalize._registry) if (end.peek() or (None,))[0] is crew]
    assert len(ends) == 1
    assert comes_true(lambda: helpers() == 0)


def test_copies_and_closed_crews_have_threads_again_when_they_need_them():
    crew, done = Crew(2), []
    crew.run(lambda thread: None, 2)
    twin = copy.deepcopy(crew)
    crew.close()
    crew.close()
    for one in (twin, crew):
        one.run(lambda thread: done.append(thread), 2)
        one.close()
    assert sorted(done) == [0, 0, 1, 1]


def test_threads_end_with_their_crew():
    assert comes_true(lambda: helpers() == 0)  # those of other tests
    crew = Crew(3)
    crew.run(lambda thread: None, 3)
    assert helpers() == 2
    del crew
    gc.collect()
    assert comes_true(lambda: helpers() == 0)


def test_small_batches_have_one_thread(monkeypatch):
    monkeypatch.setattr("os.sched_getaffinity", lambda _: set(range(6)), raising=False)
    assert [threads_for(worlds) for worlds in (1, 31, 63, 64, 100, 1024)] == [1, 1, 1, 2, 3, 6]
