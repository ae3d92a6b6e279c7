"""Immutable constants of a world: the grid, the soil, the blade, the machine. SI units; angles in radians.

Everything here is plain numbers, checked once by `dirt_env.config`; the kernels trust them.
"""

from math import radians, tan
from typing import NamedTuple

import numpy as np


class Grid(NamedTuple):
    """The site's raster: `rows` x `cols` square cells of `cell` metres; row 0 is the southern edge."""

    rows: int = 64
    cols: int = 64
    cell: float = 0.5


class Soil(NamedTuple):
    """Loose, cohesionless soil.

    `slope` is the tangent of the angle of repose, `density` the loose bulk density [kg/m3], `friction` the
    coefficient of soil sliding on soil. `tolerance`: ground counts as settled where it is steeper than repose by at
    most this share. `max_sweeps` bounds the relaxation in one control step; the rest goes on in the next. `swell`: by
    which share of its volume undisturbed soil grows as it is loosened; 0 leaves all soil loose from the start.
    """

    slope: float = tan(radians(35.0))
    density: float = 1500.0
    friction: float = tan(radians(35.0))
    tolerance: float = 4e-3
    max_sweeps: int = 2000
    swell: float = 0.0


class Blade(NamedTuple):
    """A straight blade: `width` and `height` [m], carried `reach` metres ahead of the machine's pivot."""

    width: float = 3.0
    height: float = 1.0
    reach: float = 1.5


class Machine(NamedTuple):
    """A tracked machine: `length` and `width` of its tracks [m], centred on the pivot, and its limits.

    `speed` [m/s] and `yaw_rate` [rad/s] are the largest either way; the cutting edge goes from `cut` metres below the
    plane of the tracks to `lift` metres above it, at most `edge_rate` [m/s].
    """

    length: float = 2.5
    width: float = 2.0
    speed: float = 2.0
    yaw_rate: float = 0.6
    cut: float = 0.25
    lift: float = 0.75
    edge_rate: float = 0.5


class Strength(NamedTuple):
    """What the soil stands before it gives way; for machines whose traction is computed.

    `cohesion` and `adhesion` to the blade [Pa], angles of `internal_friction` and of `external_friction` on the blade
    [rad]; `shear_deformation` [m] is Janosi and Hanamoto's modulus K, over which the tracks mobilise the strength.
    """

    cohesion: float = 0.0
    internal_friction: float = radians(35.0)
    adhesion: float = 0.0
    external_friction: float = radians(35.0) * 2 / 3
    shear_deformation: float = 0.025


class Traction(NamedTuple):
    """What a machine has to push with: `mass` [kg], engine `power` [W] of which the share `efficiency` reaches the
    tracks, `track_width` [m] of each of two tracks, `rolling_resistance` as share of the weight; and the blade's
    `rake` [rad], from the ground ahead up to its face, 90 degrees being upright.

    The defaults are typical of a small crawler dozer of the 9 t, 75 kW class.
    """

    mass: float = 9000.0
    power: float = 75e3
    efficiency: float = 0.75
    track_width: float = 0.45
    rolling_resistance: float = 0.06
    rake: float = radians(60.0)


class Command(NamedTuple):
    """What the machine is told for one control step: speed [m/s], yaw rate [rad/s], edge height over the tracks [m]."""

    speed: float
    yaw_rate: float
    edge: float


def record_of(kind: type) -> np.dtype:
    """Record with the numbers among the fields of a NamedTuple, under the same names."""
    codes = {float: "f8", int: "i8"}
    fields = [(name, codes[field]) for name, field in kind.__annotations__.items() if field in codes]
    return np.dtype((np.record, fields))
