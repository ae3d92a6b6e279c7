"""Draft of a blade by the fundamental equation of earthmoving: the force balance of the wedge that it breaks out.

A blade with its face at the rake angle a over the ground ahead moves a wedge of soil up a plane that rises at the angle
b to the surface. Per metre of width and for a depth d of the cut, the wedge has the weight g d2 (cot a + cot b) / 2 and
carries a surcharge q on its top of d (cot a + cot b). The blade pushes with P, turned by the external friction e from
the normal of its face, adhesion acts along the face (d / sin a); the ground answers with R, turned by the internal
friction f from the normal of the plane, and with cohesion along it (d / sin b). Without R, the two balances are

    P sin(a + b + f + e) = (weight + surcharge) sin(b + f) + c d cos(f) / sin(b) - ca d cos(a + b + f) / sin(a)

which is P = g d2 N_weight + c d N_cohesion + q d N_surcharge + ca d N_adhesion. The plane is the one that gives way
first: its angle makes N_weight smallest.

A. R. Reece, The fundamental equation of earth-moving mechanics, Proc. Inst. Mech. Eng. 179 (3F), 1964;
E. McKyes, Soil Cutting and Tillage, Elsevier 1985.
"""

from math import cos, pi, sin, sqrt
from typing import NamedTuple

from dirt_env.sim.jit import kernel

STEEPEST = pi - 0.1  # rad; rake and both frictions together leave no wedge from pi on
LEAST_FRICTION = 1e-3  # rad
_GOLDEN = (sqrt(5.0) - 1.0) / 2.0


class Factors(NamedTuple):
    """The failure plane's angle [rad] and the N factors of the force P on the blade; `pull`, its horizontal share."""

    plane: float
    weight: float
    cohesion: float
    surcharge: float
    adhesion: float
    pull: float


class Cut(NamedTuple):
    """Constants of `draft_force` for one soil and blade; what it adds up, in its order.

    `weight` [N/m2] of the depth squared, `hold` [N/m] of the depth (cohesion and adhesion), `press` [N/m2] of the
    load's cross-section on the wedge, `slide` [N/m3] of the rest of the load. `top` is the length of the wedge's top
    over its depth, `slope` the load's, `width` [m] the blade's.
    """

    weight: float
    hold: float
    press: float
    slide: float
    top: float
    slope: float
    width: float


def weight_factor(plane: float, rake: float, internal: float, external: float) -> float:
    """N_weight of a failure plane at that angle [rad]: (cot a + cot b) sin(b + f) / (2 sin(a + b + f + e))."""
    across = cos(rake) / sin(rake) + cos(plane) / sin(plane)
    return 0.5 * across * sin(plane + internal) / sin(rake + plane + internal + external)


def earthmoving_factors(rake: float, internal: float, external: float) -> Factors:
    """N factors for a rake, internal and external friction [rad] which together are less than STEEPEST."""
    plane = _weakest_plane(rake, internal, external)
    whole = sin(rake + plane + internal + external)
    weight = weight_factor(plane, rake, internal, external)
    return Factors(
        plane=plane,
        weight=weight,
        cohesion=cos(internal) / (sin(plane) * whole),
        surcharge=2.0 * weight,
        adhesion=-cos(rake + plane + internal) / (sin(rake) * whole),
        pull=sin(rake + external),
    )


def _weakest_plane(rake: float, internal: float, external: float) -> float:
    """Angle [rad] of the failure plane with the least N_weight, by golden section: it has one minimum.

    Without any friction all planes weigh the same, and cohesion would hang on the choice: the limit of little friction
    is taken.
    """
    internal = max(internal, LEAST_FRICTION)
    low, high = 0.0, pi - rake - internal - external
    for _ in range(80):
        reach = _GOLDEN * (high - low)
        if weight_factor(high - reach, rake, internal, external) < weight_factor(low + reach, rake, internal, external):
            high = low + reach
        else:
            low = high - reach
    return 0.5 * (low + high)


@kernel
def draft_force(depth, load, cut):
    """Horizontal force [N] on a blade that cuts `depth` [m] deep and has a loose `load` [m3] ahead.

    The load lies as a prism at repose. What of it lies on the wedge presses on that as surcharge; the rest slides over
    the ground ahead, which is all that there is at depth 0.
    """
    top = depth * cut.top
    high = sqrt(2.0 * cut.slope * load / cut.width)
    whole = load / cut.width
    over = top * (high - 0.5 * cut.slope * top) if top * cut.slope < high else whole
    return (cut.weight * depth + cut.hold) * depth + cut.press * over + cut.slide * (whole - over) * cut.width
