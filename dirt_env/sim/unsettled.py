"""Which links of a wide window are steeper than what counts as settled, by the same arithmetic as a sweep's."""

from math import sqrt

import numpy as np

from dirt_env.sim.jit import kernel
from dirt_env.sim.sheet import OPEN_X, OPEN_Y, RATE_X, RATE_Y


@kernel
def count_steep(low, here, high, rate_x, rate_y, n, limit):
    """How many of the links that are swept have a gradient with a square above `limit`; all links are open."""
    quarter = here.dtype.type(0.25)
    count = 0
    for p in range(n):
        drop = here[p + 2] - here[p + 1]
        across = quarter * ((high[p + 1] - low[p + 1]) + (high[p + 2] - low[p + 2]))
        count += rate_x[p] * (drop * drop + across * across) > limit
        drop = high[p + 1] - here[p + 1]
        across = quarter * ((here[p + 2] - here[p]) + (high[p + 2] - high[p]))
        count += rate_y[p] * (drop * drop + across * across) > limit
    return count


@kernel
def count_steep_masked(low, here, high, x, x_high, y, y_low, rate_x, rate_y, n, limit):
    """The same where links are closed; `x` and `y` are the masks OPEN of the rows, from one cell before."""
    quarter = here.dtype.type(0.25)
    count = 0
    for p in range(n):
        drop = x[p + 1] * (here[p + 2] - here[p + 1])
        left = y[p + 1] * (high[p + 1] - here[p + 1]) + y_low[p + 1] * (here[p + 1] - low[p + 1])
        right = y[p + 2] * (high[p + 2] - here[p + 2]) + y_low[p + 2] * (here[p + 2] - low[p + 2])
        across = quarter * (left + right)
        count += rate_x[p] * (drop * drop + across * across) > limit
        drop = y[p + 1] * (high[p + 1] - here[p + 1])
        lower = x[p + 1] * (here[p + 2] - here[p + 1]) + x[p] * (here[p + 1] - here[p])
        upper = x_high[p + 1] * (high[p + 2] - high[p + 1]) + x_high[p] * (high[p + 1] - high[p])
        across = quarter * (lower + upper)
        count += rate_y[p] * (drop * drop + across * across) > limit
    return count


@kernel
def count_unsettled(sheet, ground, stride, tall, masked, settled):
    """How many links are steeper than what counts as settled, by the same arithmetic as `slump`."""
    p, n = stride + 1, tall * stride
    open_x, open_y = sheet[OPEN_X], sheet[OPEN_Y]
    limit = largest_square(settled)
    low, here, high = ground[p - stride - 1 :], ground[p - 1 :], ground[p + stride - 1 :]
    if not masked:
        return count_steep(low, here, high, sheet[RATE_X][p:], sheet[RATE_Y][p:], n, limit)
    return count_steep_masked(
        low, here, high, open_x[p - 1 :], open_x[p + stride - 1 :], open_y[p - 1 :], open_y[p - stride - 1 :],
        sheet[RATE_X][p:], sheet[RATE_Y][p:], n, limit,
    )  # fmt: skip


@kernel
def largest_square(bound):
    """The largest number whose root is at most `bound`."""
    real = type(bound)
    square = bound * bound
    while sqrt(square) > bound:
        square = np.nextafter(square, real(0.0))
    while sqrt(np.nextafter(square, real(np.inf))) <= bound:
        square = np.nextafter(square, real(np.inf))
    return square
