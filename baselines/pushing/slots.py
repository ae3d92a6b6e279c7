"""Slots: parallel lanes from the soil to its goal, and the next pass in one of them."""

from math import atan2
from typing import NamedTuple

import numpy as np

from .choose import Push, has_room
from .parameters import SlotParameters
from .site import Site
from .worth import SOIL


class Slot(NamedTuple):
    """A lane: the blade's middle goes from beside the soil's middle to its end in the goal, x, y [m].

    The soil lies from `rear` to `front` m ahead of the middle; what is dropped farther ahead is the way's.
    """

    middle: tuple[float, float]
    end: tuple[float, float]
    rear: float
    front: float


def lay_slots(site: Site, numbers: SlotParameters) -> list[Slot]:
    """Lanes side by side over all the soil that is to be moved, to the goal nearest to its middle.

    They lie `spacing` blade widths apart, and run together where the goal is narrower than the soil is wide.
    """
    soil = site.excess > numbers.min_height
    if not soil.any() or not site.goals:
        return []
    middle = _middle(site, site.excess * soil)
    goal = min(site.goals, key=lambda mask: np.hypot(*np.subtract(_middle(site, mask), middle)))
    end = _middle(site, goal)
    ahead = np.subtract(end, middle) / max(np.hypot(*np.subtract(end, middle)), 1e-9)
    left = np.array([-ahead[1], ahead[0]])
    aside = (site.x - middle[0]) * left[0] + (site.y - middle[1]) * left[1]
    low, high = float(aside[soil].min()), float(aside[soil].max())
    width = site.blade.width
    count = max(1, round((high - low + site.grid.cell) / (numbers.spacing * width)))
    offsets = 0.5 * (low + high) + (np.arange(count) - 0.5 * (count - 1)) * numbers.spacing * width
    beside = (site.x - end[0]) * left[0] + (site.y - end[1]) * left[1]
    room = max(0.0, float(np.abs(beside[goal]).max()) - 0.5 * width)
    narrow = min(1.0, room / max(float(np.abs(offsets).max()), 1e-9))
    there = (site.x[soil] - middle[0]) * ahead[0] + (site.y[soil] - middle[1]) * ahead[1]
    reach = float(there.min()) - site.grid.cell, float(there.max()) + site.grid.cell
    ends = [(_along(middle, left, offset), _along(end, left, narrow * offset)) for offset in offsets.tolist()]
    return [Slot(*points, *reach) for points in ends]


def loads_in(site: Site, slot: Slot) -> float:
    """Soil to be moved in a slot, in loads."""
    soil, _ = _profile(site, slot)
    return float(soil.sum()) / site.rated


def next_pass(site: Site, numbers: SlotParameters, slot: Slot) -> Push | None:
    """The pass that takes the last load before the goal, so that a slot is dug from its front to its rear.

    None where the machine has no room to begin it.
    """
    soil, ahead = _profile(site, slot)
    order = np.argsort(-ahead)
    enough = np.searchsorted(np.cumsum(soil[order]), numbers.loads * site.rated)
    far = float(ahead[order[min(int(enough), len(order) - 1)]]) - 0.5 * site.grid.cell
    heading = atan2(slot.end[1] - slot.middle[1], slot.end[0] - slot.middle[0])
    unit = np.array([np.cos(heading), np.sin(heading)])
    first, approach = _along(slot.middle, unit, far), _along(slot.middle, unit, far - numbers.back_off)
    if not has_room(site, np.array([approach])).all():
        return None
    return Push(first, approach, heading, [first, slot.end])


def _profile(site: Site, slot: Slot) -> tuple[np.ndarray, np.ndarray]:
    """Soil to be moved [n] m3 where the slot is to be dug, and where it lies [n] m ahead of the slot's middle."""
    way = np.subtract(slot.end, slot.middle)
    east, north = way / max(np.hypot(*way), 1e-9)
    dx, dy = site.x - slot.middle[0], site.y - slot.middle[1]
    along, across = dx * east + dy * north, dy * east - dx * north
    there = (np.abs(across) <= 0.5 * site.blade.width) & (site.excess > SOIL)
    there &= (along >= slot.rear) & (along <= slot.front)
    return site.excess[there] * site.grid.cell**2, along[there]


def _middle(site: Site, weight: np.ndarray) -> tuple[float, float]:
    total = float(weight.sum())
    return float((site.x * weight).sum()) / total, float((site.y * weight).sum()) / total


def _along(point: tuple[float, float], unit: np.ndarray, far: float) -> tuple[float, float]:
    return point[0] + far * float(unit[0]), point[1] + far * float(unit[1])
