"""Zones: where a site's soil differs from place to place, and what of it a machine stands on and pushes against.

Soil has the properties of the place where it lies. What depends on the soil is worked out for each soil that the blade
or the tracks touch, and weighed by the share of their cells; in the form base + sum(share (soil - base)), so that soils
with the same numbers give the same result to the last bit.
"""

from typing import NamedTuple

import numpy as np

from dirt_env.sim.blade import blade_frame
from dirt_env.sim.jit import kernel
from dirt_env.sim.laws import push_work
from dirt_env.sim.machine import STATIONS
from dirt_env.sim.params import Soil, record_of

SOILS = record_of(Soil)


class Zones(NamedTuple):
    """Soils of a site: `index` i1[rows, cols], that of each cell in the tables, 0 being the scene's own.

    Tables: `soils` SOILS[k], `pulls` PULL[k] or None where traction is not computed. `ahead`, `under` f8[k] are work
    space: shares of the soils along the blade and under the tracks.
    """

    index: np.ndarray
    soils: np.ndarray
    pulls: np.ndarray | None
    ahead: np.ndarray
    under: np.ndarray


@kernel
def extremes(soils):
    """(smallest, largest) slope of repose among the soils."""
    low = high = soils[0].slope
    for k in range(1, len(soils)):
        low, high = min(low, soils[k].slope), max(high, soils[k].slope)
    return low, high


@kernel
def count_ahead(zones, line, cell, side):
    """Write into `zones.ahead` the shares of the soils within a cell of the blade, on the `side` it moves to.

    Off the site it is the scene's soil.
    """
    rows, cols = zones.index.shape
    zones.ahead[:] = 0.0
    x, y = line.x + 0.5 * side * cell * line.ahead_x, line.y + 0.5 * side * cell * line.ahead_y
    span_x = abs(line.ahead_y) * line.half + 0.5 * cell * abs(line.ahead_x)
    span_y = abs(line.ahead_x) * line.half + 0.5 * cell * abs(line.ahead_y)
    count = 0
    for r in range(max(int((y - span_y) // cell), 0), min(int((y + span_y) // cell) + 1, rows)):
        for c in range(max(int((x - span_x) // cell), 0), min(int((x + span_x) // cell) + 1, cols)):
            ahead, left = blade_frame(line, (c + 0.5) * cell, (r + 0.5) * cell)
            ahead *= side
            if 0 < ahead <= cell and abs(left) <= line.half:
                zones.ahead[zones.index[r, c]] += 1.0
                count += 1
    if count == 0:
        zones.ahead[0] = 1.0
    else:
        zones.ahead[:] /= count


@kernel
def count_under(zones, cell, pose, facing, machine):
    """Write into `zones.under` the shares of the soils at the points of the tracks on which the machine is laid."""
    rows, cols = zones.index.shape
    zones.under[:] = 0.0
    ahead_x, ahead_y = facing
    for i in range(STATIONS):
        s = machine.length * (i / (STATIONS - 1) - 0.5)
        for j in range(3):
            u = machine.width * (0.5 * j - 0.5)
            x, y = pose.x + s * ahead_x - u * ahead_y, pose.y + s * ahead_y + u * ahead_x
            r, c = min(max(int(y // cell), 0), rows - 1), min(max(int(x // cell), 0), cols - 1)
            zones.under[zones.index[r, c]] += 1.0 / (3 * STATIONS)


@kernel
def slope_ahead(zones, slope, line, cell, side):
    """Slope of repose at the blade, that of the scene being `slope`; fills `zones.ahead`."""
    count_ahead(zones, line, cell, side)
    result = slope
    for k in range(1, len(zones.soils)):
        result += zones.ahead[k] * (zones.soils[k].slope - slope)
    return result


@kernel
def work_ahead(zones, load, density, friction, way):
    """`push_work` over the soils in `zones.ahead`; `density` and `friction` are the scene's."""
    base = push_work(load, density, friction, way)
    result = base
    for k in range(1, len(zones.soils)):
        soil = zones.soils[k]
        result += zones.ahead[k] * (push_work(load, soil.density, soil.friction, way) - base)
    return result
