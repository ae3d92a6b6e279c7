"""The bulldozer seen from above, drawn into a picture at its true place and size, with its shadow."""

from math import ceil, cos, hypot, sin
from typing import NamedTuple

import numpy as np

from dirt_env.render.raster import View, blend, box_distance, coverage, segment_distance
from dirt_env.sim.params import Blade, Machine

ABOVE, LEVEL, BELOW = (86, 180, 233), (250, 250, 250), (213, 60, 0)  # told apart by the colour-blind too
_AT_GRADE = 0.02  # m: an edge as near to the plane of the tracks as this is at grade
_TINY = 12.0  # px: a machine shorter than this gets a ring around it
HOOD, CAB = (247, 186, 22), (255, 214, 92)
_SHADE = (205, 146, 8)
_BLACK, _RUBBER, _STEEL, _GLASS = (24, 24, 26), (58, 58, 60), (96, 98, 102), (38, 58, 74)


class Part(NamedTuple):
    """A rounded rectangle of the machine [m]: centre and half size along and across, corner radius, colour, height.

    The large ones are outlined and cast a shadow.
    """

    center: tuple[float, float]
    half: tuple[float, float]
    radius: float
    color: tuple[int, int, int]
    high: float
    casts: bool = False


def blade_color(edge: float) -> tuple[int, int, int]:
    """Colour of a blade whose cutting edge is `edge` metres over the plane of the tracks."""
    if abs(edge) <= _AT_GRADE:
        return LEVEL
    return ABOVE if edge > 0 else BELOW


class Dozer:
    """Draws one machine with its blade; all shapes follow from their sizes."""

    def __init__(self, blade: Blade, machine: Machine):
        self.blade, self.machine = blade, machine
        self._tracks = track_parts(machine)
        self._body = body_parts(machine)
        front, back = max(blade.reach + 0.2, machine.length / 2), -machine.length / 2
        self._middle = (front + back) / 2
        self._radius = hypot((front - back) / 2, max(blade.width, machine.width) / 2) + 0.35

    def draw(self, image: np.ndarray, view: View, pose: np.void) -> None:
        """Paint the machine into `image` f4[3, h, w] in place; what lies outside the picture is left away."""
        window = self._window(image.shape[1:], view, pose)
        if window is None:
            return
        patch = image[(slice(None), *window)]
        along, across = _local(window, view, pose)
        self._shadow(patch, view, pose, along, across)
        self._arms(patch, view, along, across)
        for part in self._tracks:
            self._part(patch, view, part, along, across)
        self._grousers(patch, view, pose, along, across)
        for part in self._body:
            self._part(patch, view, part, along, across)
        self._blade(patch, view, blade_color(float(pose["edge"])), along, across)
        if self.machine.length * view.scale < _TINY:
            ring = np.abs(np.hypot(along, across) * view.scale - _TINY) - 1.0
            blend(patch, coverage(ring - 0.8), _BLACK)
            blend(patch, coverage(ring), HOOD)

    def _window(self, shape: tuple[int, int], view: View, pose: np.void) -> tuple[slice, slice] | None:
        """Rows and columns of the picture that the disc around machine and blade touches."""
        x = float(pose["x"]) + self._middle * cos(float(pose["heading"]))
        y = float(pose["y"]) + self._middle * sin(float(pose["heading"]))
        right, down = view.pixel(x, y)
        reach = ceil(max(self._radius * view.scale, 1.3 * _TINY)) + 2
        rows = slice(max(0, int(down) - reach), min(shape[0], int(down) + reach))
        cols = slice(max(0, int(right) - reach), min(shape[1], int(right) + reach))
        return (rows, cols) if rows.stop > rows.start and cols.stop > cols.start else None

    def _part(self, patch: np.ndarray, view: View, part: Part, along: np.ndarray, across: np.ndarray) -> None:
        far = box_distance(along, across, part.center, part.half, part.radius) * view.scale
        if part.casts:
            blend(patch, 0.55 * coverage(far - 0.8), _BLACK)
        blend(patch, coverage(far), part.color)

    def _shadow(self, patch: np.ndarray, view: View, pose: np.void, along: np.ndarray, across: np.ndarray) -> None:
        """Darken the ground to the south-east, farther for higher parts; a lifted blade leaves its shadow behind."""
        turn, edge = float(pose["heading"]), max(float(pose["edge"]), 0.0)
        dark = np.zeros(along.shape)
        blade = Part(
            (self.blade.reach, 0.0), (0.12, self.blade.width / 2), 0.05, _BLACK, 0.5 * self.blade.height + edge
        )
        for part in (*(part for part in self._tracks + self._body if part.casts), blade):
            x, y = 0.45 * part.high, -0.45 * part.high
            s, u = x * cos(turn) + y * sin(turn), y * cos(turn) - x * sin(turn)
            far = box_distance(along - s, across - u, part.center, part.half, part.radius)
            dark = np.maximum(dark, np.clip(0.5 - far / 0.25, 0, 1))
        patch *= 1 - 0.5 * dark

    def _arms(self, patch: np.ndarray, view: View, along: np.ndarray, across: np.ndarray) -> None:
        side = min(self.machine.width / 2 + 0.02, self.blade.width / 2 - 0.1)
        for u in (-side, side):
            far = segment_distance(along, across, (0.0, u), (self.blade.reach - 0.1, u * 0.92)) - 0.09
            blend(patch, coverage(far * view.scale - 0.8), _BLACK)
            blend(patch, coverage(far * view.scale), _SHADE)

    def _grousers(self, patch: np.ndarray, view: View, pose: np.void, along: np.ndarray, across: np.ndarray) -> None:
        """Bars across the tracks that roll as the machine drives."""
        driven = float(pose["x"]) * cos(float(pose["heading"])) + float(pose["y"]) * sin(float(pose["heading"]))
        bars = 0.5 + 0.5 * np.cos((along + driven) * (2 * np.pi / 0.28))
        for part in self._tracks:
            far = box_distance(along, across, part.center, (part.half[0] - 0.06, part.half[1] - 0.05), 0.05)
            blend(patch, 0.7 * bars * coverage(far * view.scale), _STEEL)

    def _blade(
        self, patch: np.ndarray, view: View, color: tuple[int, int, int], along: np.ndarray, across: np.ndarray
    ) -> None:
        half, reach = self.blade.width / 2, self.blade.reach
        thick = max(0.09, 1.6 / view.scale)
        wing = min(0.16, 0.1 * self.blade.width)
        back = segment_distance(along, across, (reach - thick, -half + thick), (reach - thick, half - thick))
        for u in (-1, 1):
            tip = segment_distance(
                along, across, (reach - thick, u * (half - thick)), (reach + wing - thick, u * (half - thick / 2))
            )
            back = np.minimum(back, tip)
        far = (back - thick) * view.scale
        blend(patch, coverage(far - 1.2), _BLACK)
        blend(patch, coverage(far), color)
        ridge = segment_distance(along, across, (reach - 1.45 * thick, -half), (reach - 1.45 * thick, half))
        blend(patch, 0.35 * coverage((ridge - 0.35 * thick) * view.scale) * coverage(far), _BLACK)


def track_parts(machine: Machine) -> tuple[Part, ...]:
    """The two tracks."""
    half, wide = machine.length / 2, 0.125 * machine.width
    return tuple(
        Part((0.0, side * (machine.width / 2 - wide)), (half, wide), 0.1, _RUBBER, 0.6, True) for side in (-1.0, 1.0)
    )


def body_parts(machine: Machine) -> tuple[Part, ...]:
    """Chassis, engine hood with grille and exhaust, cab with roof: lengths as shares of the machine's."""
    long, wide = machine.length, machine.width
    return (
        Part((-0.01 * long, 0.0), (0.43 * long, 0.26 * wide), 0.1, _SHADE, 0.8, True),
        Part((-0.42 * long, 0.0), (0.07 * long, 0.22 * wide), 0.06, _STEEL, 0.8),
        Part((0.25 * long, 0.0), (0.21 * long, 0.19 * wide), 0.1, HOOD, 1.2, True),
        Part((0.435 * long, 0.0), (0.02 * long, 0.17 * wide), 0.03, _BLACK, 1.2),
        Part((0.22 * long, 0.0), (0.12 * long, 0.012 * wide), 0.02, _SHADE, 1.2),
        Part((0.30 * long, -0.11 * wide), (0.025 * long, 0.03 * wide), 0.1, _BLACK, 1.4),
        Part((-0.15 * long, 0.0), (0.18 * long, 0.25 * wide), 0.1, _GLASS, 2.0, True),
        Part((-0.17 * long, 0.0), (0.13 * long, 0.2 * wide), 0.1, CAB, 2.0),
    )


def _local(window: tuple[slice, slice], view: View, pose: np.void) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates [m] of the window's pixels ahead of the pivot and to its left."""
    right, down = view.pixel(float(pose["x"]), float(pose["y"]))
    east = (np.arange(window[1].start, window[1].stop) + 0.5 - right)[None, :] / view.scale
    north = (down - 0.5 - np.arange(window[0].start, window[0].stop))[:, None] / view.scale
    c, s = cos(float(pose["heading"])), sin(float(pose["heading"]))
    along, across = east * c + north * s, north * c - east * s
    return along.astype(np.float32), across.astype(np.float32)
