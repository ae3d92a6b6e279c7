"""Thrust of tracks on shearing soil, and the slip that it takes. Z. Janosi, B. Hanamoto 1961; J. Y. Wong, Theory of
Ground Vehicles.

Soil under a track of length L has been sheared by i x at the distance x from the front, i being the slip, and answers
with the share 1 - exp(-i x / K) of its strength A c + W tan(f). Over the whole track that is

    thrust / strength = 1 - (1 - exp(-z)) / z,   z = i L / K.
"""

from math import expm1

from dirt_env.sim.jit import kernel

SMALL = 1e-2  # of z, below which a series is more exact than the formula
STEPS = 8  # of Newton's method: at full slip on the longest tracks five reach the last bits


@kernel
def mobilised_share(z):
    """Share of the soil's strength that tracks mobilise at z = slip * length / shear deformation."""
    if z < SMALL:
        return z * (1.0 / 2 - z * (1.0 / 6 - z * (1.0 / 24 - z * (1.0 / 120 - z / 720))))
    return 1.0 + expm1(-z) / z


@kernel
def _growth(z):
    """Derivative of `mobilised_share`."""
    if z < SMALL:
        return 1.0 / 2 - z * (1.0 / 3 - z * (1.0 / 8 - z * (1.0 / 30 - z / 144)))
    return (-expm1(-z) * (1.0 + z) - z) / (z * z)


@kernel
def slip_at(share, ratio):
    """Slip [-] at which tracks mobilise that `share` (0 to below 1) of the strength; `ratio` = K / L.

    The share grows ever less with z, so that Newton's method comes from below after its first step, and never leaves
    the bound z >= 2 share.
    """
    least = 2.0 * share
    z = 1.0 / (1.0 - share)
    for _ in range(STEPS):
        z = max(z - (mobilised_share(z) - share) / _growth(z), least)
    return z * ratio
