"""Stages of a super-step (see `super_steps`): sweeps with momentum over a wide window, links closed or not."""

from dirt_env.sim.jit import kernel
from dirt_env.sim.laws import RATE, quantise
from dirt_env.sim.sheet import (
    FLOW_X,
    FLOW_Y,
    GROUND,
    OPEN_X,
    OPEN_Y,
    RATE_X,
    RATE_Y,
    REST_X,
    REST_Y,
    SENT_X,
    SENT_Y,
    hold_ring,
)

BLOCK = 4096  # cells that are swept at a time: what they need stays in the nearest cache


@kernel
def brisk_flux(drop, steep, threshold2):
    """F = drop (1 - T**2 / g**2), and 0 up to T, from the squares `steep` of g and `threshold2` of T."""
    share = (steep - threshold2) / steep
    return drop * share if steep > threshold2 else threshold2 - threshold2


@kernel
def lean_flows(low, here, high, flow_x, flow_y, n, momentum, gain, threshold2):
    """flow = momentum * flow + gain * F on the right and upper links of n cells, where all links around are open.

    `low`, `here`, `high` begin one cell to the left of them.
    """
    quarter = here.dtype.type(0.25)
    for p in range(n):
        drop = here[p + 2] - here[p + 1]
        across = quarter * ((high[p + 1] - low[p + 1]) + (high[p + 2] - low[p + 2]))
        steep = drop * drop + across * across
        flow_x[p] = momentum * flow_x[p] + gain * brisk_flux(drop, steep, threshold2)
        drop = high[p + 1] - here[p + 1]
        across = quarter * ((here[p + 2] - here[p]) + (high[p + 2] - high[p]))
        steep = drop * drop + across * across
        flow_y[p] = momentum * flow_y[p] + gain * brisk_flux(drop, steep, threshold2)


@kernel
def masked_flows_x(low, here, high, open_x, above, below, rate, flow, n, momentum, gain, threshold2):
    """The same on right links; closed ones carry nothing and give nothing to the gradients around them.

    `open_x`, `above`, `below`: masks of the right link and of the upper and lower links of n + 1 cells.
    """
    quarter = here.dtype.type(0.25)
    for p in range(n):
        drop = open_x[p] * (here[p + 2] - here[p + 1])
        left = above[p] * (high[p + 1] - here[p + 1]) + below[p] * (here[p + 1] - low[p + 1])
        right = above[p + 1] * (high[p + 2] - here[p + 2]) + below[p + 1] * (here[p + 2] - low[p + 2])
        across = quarter * (left + right)
        steep = drop * drop + across * across
        flow[p] = momentum * flow[p] + gain * rate[p] * brisk_flux(drop, steep, threshold2)


@kernel
def masked_flows_y(here, high, open_y, right, right_high, rate, flow, n, momentum, gain, threshold2):
    """The same on upper links. `right`, `right_high`: masks of the right links of both rows, from one cell before."""
    quarter = here.dtype.type(0.25)
    for p in range(n):
        drop = open_y[p] * (high[p + 1] - here[p + 1])
        lower = right[p + 1] * (here[p + 2] - here[p + 1]) + right[p] * (here[p + 1] - here[p])
        upper = right_high[p + 1] * (high[p + 2] - high[p + 1]) + right_high[p] * (high[p + 1] - high[p])
        across = quarter * (lower + upper)
        steep = drop * drop + across * across
        flow[p] = momentum * flow[p] + gain * rate[p] * brisk_flux(drop, steep, threshold2)


@kernel
def keep(flow, rest, n):
    """Put what n links carry aside, to be sent later."""
    for p in range(n):
        rest[p] += flow[p]


@kernel
def send(flow, rest, sent, n, lock):
    """Round what n links carry to the quantum; what that leaves over, `rest`, is sent with a later stage's flow."""
    for p in range(n):
        whole = flow[p] + rest[p]
        rounded = quantise(whole, lock)
        sent[p] = rounded
        rest[p] = whole - rounded


@kernel
def add(ground, out_x, in_x, out_y, in_y, n):
    """h -= div F, as it is, in place."""
    for p in range(n):
        ground[p] += (out_x[p] - in_x[p]) + (out_y[p] - in_y[p])


@kernel
def add_to(ground, out_x, in_x, out_y, in_y, after, n):
    """h - div F, as it is."""
    for p in range(n):
        after[p] = ground[p] + ((out_x[p] - in_x[p]) + (out_y[p] - in_y[p]))


@kernel
def carry(sheet, fine, after, stride, p, n, lock, last):
    """Move what the links of the cells [p, p + n) carry, over the ground `fine`; `after` takes what that becomes.

    Nothing is rounded off `fine`, because momentum adds up the noise of a thousand roundings to tens of quanta, which
    flattens piles of fine cells. What crossed a link in a run of stages is sent over the exact ground in whole quanta
    with the `last` of them; `fine` then is the exact ground and what is left to send.
    """
    ground, flow_x, flow_y = sheet[GROUND], sheet[FLOW_X], sheet[FLOW_Y]
    sent_x, sent_y, rest_x, rest_y = sheet[SENT_X], sheet[SENT_Y], sheet[REST_X], sheet[REST_Y]
    if not last:
        keep(flow_x[p:], rest_x[p:], n)
        keep(flow_y[p:], rest_y[p:], n)
        add_to(fine[p:], flow_x[p:], flow_x[p - 1 :], flow_y[p:], flow_y[p - stride :], after[p:], n)
        return
    send(flow_x[p:], rest_x[p:], sent_x[p:], n, lock)
    send(flow_y[p:], rest_y[p:], sent_y[p:], n, lock)
    add(ground[p:], sent_x[p:], sent_x[p - 1 :], sent_y[p:], sent_y[p - stride :], n)
    add_to(ground[p:], rest_x[p:], rest_x[p - 1 :], rest_y[p:], rest_y[p - stride :], after[p:], n)


@kernel
def lean_rows(sheet, fine, after, stride, window, rows, cols, a, b, momentum, gain, threshold2, lock, last):
    """One stage of the sheet's rows [a, b), counted with the ring, of a window in which all links are open."""
    ground, flow_x, flow_y = sheet[GROUND], sheet[FLOW_X], sheet[FLOW_Y]
    tall, wide = window[1] - window[0], window[3] - window[2]
    p, n = a * stride + 1, (b - a) * stride
    lean_flows(
        fine[p - stride - 1 :], fine[p - 1 :], fine[p + stride - 1 :], flow_x[p:], flow_y[p:], n,
        momentum, gain, threshold2,
    )  # fmt: skip
    for q in range(p - 1, p + n, stride):  # nothing crosses the window's sides, the next row's first one included
        flow_x[q] = flow_x[q + wide] = 0
    if b == tall + 1:
        flow_y[p + n - stride : p + n] = 0
    carry(sheet, fine, after, stride, p, n, lock, last)
    if last:
        hold_ring(fine, ground, stride, window, rows, cols, a, b)
    hold_ring(fine, after, stride, window, rows, cols, a, b)


@kernel
def weights(stage, real):
    """(momentum, gain) of a stage of a super-step, counted from 1."""
    return real((stage - 1) / stage), real(RATE * (2 * stage - 1) / stage)


@kernel
def lean_stages(sheet, fine, after, stride, window, rows, cols, stage, count, threshold2, lock):
    """`count` stages after number `stage` of a super-step.

    Each follows the one before it one row behind, a few rows at a time, while these are still in the cache; the last
    leaves the fine ground in `fine` if `count` is even, else in `after`.
    """
    real = fine.dtype.type
    tall = window[1] - window[0]
    block = max(1, BLOCK // stride)
    for first in range(1, tall + count, block):
        for i in range(count):
            a, b = max(first - i, 1), min(first + block - i, tall + 1)
            if a < b:
                momentum, gain = weights(stage + i + 1, real)
                old, new = (fine, after) if i % 2 == 0 else (after, fine)
                last = i == count - 1
                lean_rows(sheet, old, new, stride, window, rows, cols, a, b, momentum, gain, threshold2, lock, last)


@kernel
def masked_stage(sheet, fine, after, stride, tall, momentum, gain, threshold, lock, last):
    """A stage of the whole sheet, with walls and solid cells in the window."""
    p, n = stride + 1, tall * stride
    open_x, open_y = sheet[OPEN_X], sheet[OPEN_Y]
    low, here, high = fine[p - stride - 1 :], fine[p - 1 :], fine[p + stride - 1 :]
    threshold2 = threshold * threshold
    masked_flows_x(
        low, here, high, open_x[p:], open_y[p:], open_y[p - stride :], sheet[RATE_X][p:], sheet[FLOW_X][p:], n,
        momentum, gain, threshold2,
    )  # fmt: skip
    masked_flows_y(
        here, high, open_y[p:], open_x[p - 1 :], open_x[p + stride - 1 :], sheet[RATE_Y][p:], sheet[FLOW_Y][p:], n,
        momentum, gain, threshold2,
    )  # fmt: skip
    carry(sheet, fine, after, stride, p, n, lock, last)
