"""Lanes: compiled, they do what their plain twins do."""

import operator

import numpy as np
import pytest

from dirt_env.sim import lanes
from dirt_env.sim.jit import entry
from dirt_env.sim.lanes import (
    LANES,
    WIDE,
    among,
    choose,
    clamp,
    doubles,
    first_of,
    floors,
    gather,
    has,
    last_of,
    load,
    load_all,
    none,
    ramp,
    some,
    spread,
    store,
    store_all,
    total,
    whole,
    wide_ramp,
)

COUNTS = [-3, 0, 1, 5, LANES, LANES + 4]


@entry
def copy_some(source, place, count, target, to):
    store(target, to, load(source, place, count), count)


@entry
def copy_all(source, place, target, to):
    store_all(target, to, load_all(source, place))


@entry
def calculate(a, b, number, out):
    x, y = load_all(a, 0), load_all(b, 0)
    store_all(out[0], 0, x + y)
    store_all(out[1], 0, x - number)
    store_all(out[2], 0, number * y)
    total_ = spread(number)
    total_ += x
    total_ *= y
    total_ -= x
    store_all(out[3], 0, total_)
    store_all(out[4], 0, x / y)
    y /= number
    store_all(out[5], 0, y)


@entry
def compare(a, b, number, out):
    x, y = load_all(a, 0), load_all(b, 0)
    yes, no = spread(a.dtype.type(1)), spread(a.dtype.type(0))
    for k, truth in enumerate((x < y, x <= y, x > number, x >= number, x != y)):
        store_all(out[k], 0, choose(truth, yes, no))
    either = none()
    either |= x < y
    store_all(out[5], 0, choose(either | (x > number), yes, no))
    either &= x > number
    store_all(out[6], 0, choose(either & (x <= y), yes, no))


@entry
def reduce(a, count, bits, out):
    truth = has(load(a, 0, count), bits) & among(count)
    out[0] = some(truth)
    if some(truth):
        out[1], out[2] = first_of(truth), last_of(truth)
    out[3] = some(none())


@entry
def add_up(a, start, step, out):
    x = load_all(a, 0)
    out[0], out[1], out[2] = total(x), total(doubles(x)), total(ramp(start, step))


@entry
def look_up(cells, places, columns, out):
    across, up = whole(load_all(places, 0)), floors(load_all(places, 8))
    store_all(out[0], 0, gather(cells, up * columns + across))
    store_all(out[1], 0, gather(cells, choose(across + 1 < columns, across + 1, across)))


@entry
def cut(numbers, wholes, ramped):
    x = load_all(numbers, 0)
    store_all(wholes[0], 0, whole(x))
    store_all(wholes[1], 0, floors(x))
    store_all(ramped[0], 0, doubles(floors(x)))
    store_all(ramped[1], 0, doubles(ramp(numbers[0], numbers[1])))


@entry
def cut_off(numbers, low, high, out):
    x = load_all(numbers, 0)
    store_all(out[0], 0, clamp(x, low, high))
    store_all(out[1], 0, clamp(x, load_all(numbers, 8), high))


@entry
def as_doubles(numbers, out):
    store_all(out, 0, doubles(load_all(numbers, 0)))


@entry
def look_up_many(cells, kinds, start, step, most, count, out, found):
    n = wide_ramp(start, step)
    places = floors(clamp(n, start, most))
    here, marked = gather(cells, places), has(gather(kinds, places), 2)
    store_all(out[0], 0, n - here)
    store(out[1], 0, choose(marked, here / most, n), count)
    store_all(out[2], 0, choose(marked & (n > most), most, start))
    found[0], found[1], found[2] = some(n > here), first_of(marked), last_of(marked)
    found[3], found[4] = total(doubles(whole(n))), total(doubles(here))


@entry
def among_bools(a, count):
    return some(load(a, 0, count) < 1)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.uint8, np.int64])
@pytest.mark.parametrize("count", COUNTS)
def test_the_first_of_them_are_copied_and_nothing_else_is_touched(dtype, count):
    source, target = np.arange(1, 9).astype(dtype), np.full(20, 99, dtype)
    copy_some(source[8 - min(max(count, 0), 8) :], 0, count, target, 4)
    expected = np.full(20, 99, dtype)
    n = min(max(count, 0), LANES)
    expected[4 : 4 + n] = source[8 - n :]
    np.testing.assert_array_equal(target, expected)


def test_all_of_them_are_copied():
    target = np.zeros(20, np.float32)
    copy_all(np.arange(20, dtype=np.float32), 3, target, 7)
    np.testing.assert_array_equal(target[7:15], np.arange(3, 11))
    assert not target[:7].any()
    assert not target[15:].any()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_they_are_calculated_with_like_arrays(dtype):
    rng = np.random.default_rng(0)
    a, b, number, out = *rng.normal(size=(2, LANES)).astype(dtype), dtype(0.3), np.zeros((6, LANES), dtype)
    calculate(a, b, number, out)
    expected = [a + b, a - number, number * b, (number + a) * b - a, a / b, b / number]
    np.testing.assert_array_equal(out, expected)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_they_are_compared_like_arrays(dtype):
    a, b = np.array([1, 2, 3, 4, 5, np.nan, 7, 8], dtype), np.array([1, 3, 2, 4, 9, 1, np.nan, 0], dtype)
    out, four = np.zeros((7, LANES), dtype), dtype(4)
    compare(a, b, four, out)
    either = (a < b) | (a > four)
    expected = [a < b, a <= b, a > four, a >= four, a != b, either, (a < b) & (a > four) & (a <= b)]
    np.testing.assert_array_equal(out.astype(bool), expected)


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("bits", [1, 4, 128, 64])
def test_bits_are_found_and_the_first_and_the_last_lane_that_have_them(count, bits):
    kinds, out = np.array([0, 1, 4, 129, 5, 0, 128, 3], np.uint8), np.full(4, -1)
    reduce(kinds, count, bits, out)
    found = np.flatnonzero(kinds[: max(count, 0)] & bits)
    assert out.tolist() == [len(found) > 0, *((found[0], found[-1]) if len(found) else (-1, -1)), 0]


def test_sums_are_made_in_pairs():
    a, out = np.array([1e8, 1.0, -1e8, 1.0, 3.0, 0.5, 0.25, 2.0], np.float32), np.zeros(3)
    add_up(a, 2.0, 0.5, out)
    halves = (a[:4] + a[4:])[:2] + (a[:4] + a[4:])[2:]
    assert out[0] == halves[0] + halves[1]
    assert out[1] == a.astype(float).sum()
    assert out[2] == 8 * 2.0 + 0.5 * 28


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.uint8])
@pytest.mark.parametrize("real", [np.float32, np.float64])
def test_what_lies_at_places_is_looked_up(dtype, real):
    cells, out = np.arange(12).astype(dtype) * 3, np.zeros((2, LANES), dtype)
    across, up = np.array([0, 1.9, 2, 3, 0, 3.5, 1, 2.2]), np.array([0, 0.1, 0.99, 1, 2, 2.5, 1.5, 0])
    look_up(cells, np.concatenate([across, up]).astype(real), 4, out)
    across, up = across.astype(int), up.astype(int)
    np.testing.assert_array_equal(out, [cells[up * 4 + across], cells[np.minimum(across + 1, 3)]])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_numbers_are_cut_and_rounded_down(dtype):
    numbers = np.array([-2.5, -0.25, 0.0, 0.75, 3.0, 1e6 + 0.5, -1e6 - 0.5, -1.0], dtype)
    wholes, ramped = np.zeros((2, LANES), np.int32), np.zeros((2, LANES))
    cut(numbers, wholes, ramped)
    np.testing.assert_array_equal(wholes, [np.trunc(numbers), np.floor(numbers)])
    np.testing.assert_array_equal(ramped, [np.floor(numbers), -2.5 - 0.25 * np.arange(LANES)])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_numbers_are_kept_between_others(dtype):
    numbers = np.array([-2.0, -0.5, 0.0, 0.5, 1.0, 2.0, np.nan, np.inf, 0, 1, -1, 0, 1, 0, 0.25, 0], dtype)
    out = np.zeros((2, LANES), dtype)
    cut_off(numbers, dtype(-0.5), dtype(1.0), out)
    assert out.tolist() == [[-0.5, -0.5, 0, 0.5, 1, 1, -0.5, 1], [0, 1, 0, 0.5, 1, 1, 0.25, 1]]


@pytest.mark.parametrize("dtype", [np.uint8, np.int8, np.int32, np.float32, np.float64])
def test_numbers_of_every_type_become_doubles(dtype):
    numbers, out = np.array([0, 1, 100, 127, -1, -128, 5, 200]).astype(dtype), np.zeros(LANES)
    as_doubles(numbers, out)
    np.testing.assert_array_equal(out, numbers)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("count", [-1, 0, 7, WIDE, WIDE + 3])
def test_sixteen_of_them_do_what_eight_do(dtype, count):
    cells, kinds = np.array([3.0, -1.0, 7.5, 0.25, 9.0]).astype(dtype), np.array([2, 0, 3, 5, 6], np.uint8)
    out, found = np.full((3, WIDE + 1), 99, dtype), np.zeros(5)
    look_up_many(cells, kinds, dtype(0.5), dtype(0.75), dtype(4.0), count, out, found)
    n = dtype(0.5) + np.arange(WIDE, dtype=dtype) * dtype(0.75)
    places = np.floor(np.clip(n, 0.5, 4.0)).astype(int)
    here, marked, written = cells[places], (kinds[places] & 2) != 0, min(max(count, 0), WIDE)
    np.testing.assert_array_equal(out[0, :WIDE], n - here)
    np.testing.assert_array_equal(out[1, :written], np.where(marked, here / dtype(4.0), n)[:written])
    np.testing.assert_array_equal(out[2, :WIDE], np.where(marked & (n > 4), dtype(4.0), dtype(0.5)))
    assert (out[1, written:] == 99).all()
    assert (out[[0, 2], WIDE] == 99).all()
    chosen = np.flatnonzero(marked)
    assert found.tolist() == [1.0, chosen[0], chosen[-1], np.trunc(n).sum(), here.astype(float).sum()]


def test_truth_values_of_an_array_are_bytes():
    assert not among_bools(np.ones(8, bool), 8)
    assert among_bools(np.array([True, True, False, True]), 4)


def test_the_plain_twins_do_the_same():
    a = np.arange(8.0)
    np.testing.assert_array_equal(lanes._load(a, 5, 3), [5, 6, 7, 0, 0, 0, 0, 0])
    np.testing.assert_array_equal(lanes._load_all(a, 0), a)
    lanes._store(a, 6, lanes._spread(-1.0), 2)
    assert a.tolist() == [0, 1, 2, 3, 4, 5, -1, -1]
    lanes._store_all(a, 0, lanes._ramp(1.0, 2.0))
    assert a.tolist() == [1, 3, 5, 7, 9, 11, 13, 15]
    truth = operator.and_(lanes._among(6), a > 4.0)
    assert (lanes._first_of(truth), lanes._last_of(truth), lanes._some(truth), lanes._some(lanes._none())) == (
        *(2, 5, True, False),
    )
    assert lanes._total(lanes._choose(truth, a, 0.0)) == 5 + 7 + 9 + 11
    assert lanes._doubles(a.astype(np.float32)).dtype == np.float64
    assert lanes._has(np.arange(8), 4).tolist() == [False] * 4 + [True] * 4
    half = np.array([-1.5, 2.5, 0.0, 1.0, -0.5, 3.0, 4.0, 7.0], np.float32)
    assert lanes._clamp(half, 0.0, 3.5).tolist() == [0, 2.5, 0, 1, 0, 3, 3.5, 3.5]
    assert lanes._whole(half).tolist() == [-1, 2, 0, 1, 0, 3, 4, 7]
    assert lanes._floors(half).tolist() == [-2, 2, 0, 1, -1, 3, 4, 7]
    assert lanes._gather(a, np.array([3, 3, 0, 1, 2, 7, 6, 5], np.int32)).tolist() == [7, 7, 1, 3, 5, 15, 13, 11]
    assert lanes._ramp(np.float32(0.0), np.float32(1.0)).dtype == np.float32
    assert lanes._wide_ramp(1.0, 0.5).tolist() == [1.0 + 0.5 * k for k in range(16)]
    wide = np.zeros(20)
    lanes._store(wide, 1, lanes._wide_ramp(1.0, 1.0), 11)
    assert wide.tolist() == [0, *range(1, 12), *[0] * 8]
    lanes._store_all(wide, 3, lanes._wide_ramp(1.0, 1.0))
    assert wide[3:].tolist() == [*range(1, 17), 0]
    assert lanes._last_of(lanes._wide_ramp(0.0, 1.0) < 12.5) == 12
