"""What kernels do with arrays by themselves: flat views, no counting, asking in good time, counts of threads."""

import json
import os
import subprocess
import sys
import threading

import numpy as np
import pytest

from dirt_env.sim import jit
from dirt_env.sim.intrinsics import add_shared, flat, prefetch, read_shared, uncounted
from dirt_env.sim.jit import entry, kernel


@entry
def number(field, start):
    line = flat(field)
    for k in range(line.shape[0]):
        line[k] = start + k


@entry
def last_of(field, wanted):
    chosen = field if wanted else None
    return flat(chosen)[-1] if chosen is not None else -1.0


@entry
def first_uncounted(pair):
    pair = uncounted(pair)
    return flat(pair[0])[0] + pair[1]


@entry
def ask(field):
    prefetch(field, 3)
    return field[3]


@entry
def count_up(counts, times):
    for _ in range(times):
        add_shared(counts, 1, 2)
    return add_shared(counts, 1, 0)


@entry
def wait_for(counts, wanted, patience):
    looks = 0
    while read_shared(counts, 0) < wanted and looks < patience:
        looks += 1
    return read_shared(counts, 0)


needs_compilation = pytest.mark.skipif(not hasattr(ask, "signatures"), reason="NUMBA_DISABLE_JIT=1")


@pytest.mark.parametrize("shape", [(7,), (3, 5), (2, 3, 4)])
def test_a_flat_view_is_the_array_itself(shape):
    field = np.zeros(shape, np.float32)
    number(field, 2.0)
    np.testing.assert_array_equal(field.ravel(), 2.0 + np.arange(field.size))


@needs_compilation
def test_a_field_in_another_order_is_refused_instead_of_copied():
    with pytest.raises(jit.numba.TypingError, match="flat"):
        number(np.zeros((4, 6))[:, ::2], 0.0)


def test_what_may_be_none_is_flattened_where_it_is_not():
    field = np.arange(6.0).reshape(2, 3)
    assert last_of(field, True) == 5.0
    assert last_of(field, False) == -1.0


def test_fields_are_kept_whoever_counts():
    field = np.full((2, 2), 3.0)
    before = sys.getrefcount(field)
    assert [first_uncounted((field, 1.0)) for _ in range(100)] == [4.0] * 100
    assert sys.getrefcount(field) == before


@needs_compilation
def test_what_is_asked_for_in_good_time_is_asked_for_by_the_machine_code():
    compiled = kernel(ask.py_func)  # an entry from the cache cannot be looked at
    assert compiled(np.arange(4.0)) == 3.0
    assert "llvm.prefetch" in compiled.inspect_llvm(compiled.signatures[0])


def test_counts_that_threads_share_lose_nothing():
    counts, times = np.zeros(3, np.int64), 200_000
    count_up(np.zeros(3, np.int64), 0)  # compiled before they run
    threads = [threading.Thread(target=count_up, args=(counts, times)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert counts.tolist() == [0, 4 * 2 * times, 0]


def test_what_was_there_before_is_returned():
    counts = np.array([5, 7])
    assert count_up(counts, 3) == 13
    assert counts.tolist() == [5, 13]


def test_a_thread_sees_what_another_one_counts():
    counts = np.zeros(1, np.int64)
    wait_for(counts, 0, 0)
    timer = threading.Timer(0.05, counts.__setitem__, (0, 4))
    timer.start()
    assert wait_for(counts, 4, 10**10) == 4
    timer.join()


def test_the_plain_twins_do_the_same():
    code = """
import json, threading, numpy as np
from dirt_env.sim.intrinsics import add_shared, flat, prefetch, read_shared, uncounted
field, counts = np.zeros((2, 3)), np.zeros(2, np.int64)
flat(field)[4] = 1.0
before = add_shared(counts, 1, 3)
prefetch(field, 3)
print(json.dumps([field.tolist(), before, read_shared(counts, 1), uncounted(counts) is counts]))
"""
    variables = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    found = json.loads(subprocess.check_output([sys.executable, "-c", code], env=variables, text=True))
    assert found == [[[0, 0, 0], [0, 1, 0]], 0, 3, True]


def test_a_step_counts_hardly_any_references_and_asks_for_what_it_reads(tmp_path):
    code = """
import gymnasium, json, dirt_env.worlds
from dirt_env.task.step import step_worlds
dirt_env.worlds.cores = lambda: 1  # code that another process has made cannot be looked at
gymnasium.make("DirtPush-v0").reset(seed=0)
code = step_worlds.inspect_llvm(step_worlds.signatures[0])
counted = [code.count(name) for name in ("call void @NRT_incref", "numba_attempt_nocopy_reshape")]
print(json.dumps([*counted, code.count("@llvm.prefetch")]))
"""
    variables = os.environ | {"DIRT_ENV_CACHE_DIR": str(tmp_path), "NUMBA_DISABLE_JIT": "0"}
    found = json.loads(subprocess.check_output([sys.executable, "-c", code], env=variables, text=True))
    references, calls, asks = found
    assert references < 10  # those of the arguments; 200 if nothing is done about it
    assert calls == 0
    assert asks >= 5  # ground, aim, target, way and kind
