"""Threads share worlds: every world once, all done on return, failures raised."""

import copy
import threading

import pytest

from dirt_env.crew import Crew, threads_for


@pytest.mark.parametrize("threads", [1, 2, 3, 7])
@pytest.mark.parametrize("count", [1, 8, 9, 50, 257])
def test_every_world_is_worked_on_once(threads, count):
    crew, done = Crew(threads), []
    for _ in range(3):
        crew.run(lambda thread, first, last: done.extend((thread, world) for world in range(first, last)), count)
    assert sorted(world for _, world in done) == sorted(3 * list(range(count)))
    assert {thread for thread, _ in done} <= set(range(threads))
    crew.close()


def test_threads_take_part():
    """Two slices that wait for each other are done only by two threads."""
    crew, meeting = Crew(2), threading.Barrier(2, timeout=30)
    met = []

    def work(thread, first, last):
        if len(met) < 2:
            met.append(thread)
            meeting.wait()

    crew.run(work, 64)
    assert sorted(met) == [0, 1]
    crew.close()


def test_no_thread_is_started_for_a_few_worlds():
    before = threading.active_count()
    Crew(4).run(lambda thread, first, last: None, 8)
    assert threading.active_count() == before


@pytest.mark.parametrize("failing", [0, 40])
def test_what_a_slice_raises_is_raised_and_the_crew_works_on(failing):
    crew, done = Crew(3), []

    def work(thread, first, last):
        if first <= failing < last:
            raise ArithmeticError("out of soil")

    with pytest.raises(ArithmeticError, match="out of soil"):
        crew.run(work, 60)
    crew.run(lambda thread, first, last: done.extend(range(first, last)), 60)
    assert sorted(done) == list(range(60))
    crew.close()


def test_copies_and_closed_crews_have_threads_again_when_they_need_them():
    crew, done = Crew(2), []
    crew.run(lambda thread, first, last: None, 64)
    twin = copy.deepcopy(crew)
    crew.close()
    crew.close()
    for one in (twin, crew):
        one.run(lambda thread, first, last: done.extend(range(first, last)), 64)
        one.close()
    assert sorted(done) == sorted(2 * list(range(64)))


def test_small_batches_have_one_thread(monkeypatch):
    monkeypatch.setattr("os.sched_getaffinity", lambda _: set(range(6)), raising=False)
    assert [threads_for(worlds) for worlds in (1, 31, 63, 64, 100, 1024)] == [1, 1, 1, 2, 3, 6]
