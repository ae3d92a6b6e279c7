"""Scalar laws: one equation each; they return a number and write nothing."""

from dirt_env.sim.jit import kernel

# Share of a height difference that crosses a face in one sweep, far above repose. A flux F(s) along the gradient s is
# stable where F' + F / s <= 1/2; F = a s (1 - (T / s)**2) has 2 a there at every slope, so a may be up to 1/4. At 1/4
# itself a checkerboard without friction would swing for ever.
RATE = 0.24
GRAVITY = 9.81  # m/s2


@kernel
def slump_share(drop, across, threshold, settled):
    """Share of `drop` that moves: 1 - (T / |grad|)**2, and 0 where |grad| is at most `settled`.

    `drop` [m] is the height difference over a face, `across` [m] the one along it, `threshold` T = slope * cell. The
    slope that counts is the length of the gradient, which makes piles round (Prigozhin's |grad h| <= k, q = -m grad h).
    """
    steep = drop * drop + across * across
    calm = threshold * threshold
    return (steep - calm) / steep if steep > settled * settled else calm - calm


@kernel
def link_excess(high, low, edge, top, threshold):
    """What may slump from `high` to `low` past a blade that closes the link from `edge` up to `top` [m].

    Over the top, or under the edge, whichever is more.
    """
    over = high - max(low, top)
    under = min(high, edge) - low
    return max(over, under) - threshold


@kernel
def quantise(value, lock):
    """`value` rounded to the quantum q by adding and subtracting `lock` = 1.5 * 2**23 q (float32), 1.5 * 2**52 q."""
    return (value + lock) - lock


@kernel
def push_work(load, density, friction, distance):
    """Work of sliding a loose `load` [m3] over `distance` [m] of ground [J]: friction * density * g * V * s."""
    return friction * density * GRAVITY * load * abs(distance)
