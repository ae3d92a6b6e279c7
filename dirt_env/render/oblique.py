"""The site seen obliquely, as in Figure 1 of the paper: the smooth surface, or the cells with partly filled tops.

A painter that needs numpy only: faces are projected in parallel and drawn from far to near.
"""

from math import cos, radians, sin
from typing import NamedTuple

import numpy as np

from dirt_env.render.dozer import Part, blade_color, body_parts, track_parts
from dirt_env.render.overlay import DESIGN, GOAL, START
from dirt_env.render.relief import GROUND, SOIL
from dirt_env.sim.params import Blade, Machine
from dirt_env.sim.voxel_surface import normals_of

_AZIMUTH, _ELEVATION = radians(28.0), radians(36.0)
_RIGHT = np.array([cos(_AZIMUTH), sin(_AZIMUTH), 0.0])
_AWAY = np.array([-sin(_AZIMUTH), cos(_AZIMUTH), 0.0])
_UP = _AWAY * sin(_ELEVATION) + np.array([0.0, 0.0, cos(_ELEVATION)])
_SUN = np.array([-0.56, -0.2, 0.80])
_PAPER, _BLOCK = (236, 240, 245), np.array([88.0, 92.0, 100.0])
_MARGIN = 12  # px
_THIN = 0.06  # m of soil that gives half of the full colour
_BASE = 0.6  # m of ground shown at the site's edges
_NEARER = 1.0  # m that the machine counts as nearer, so that the ground it stands on does not hide it
_CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)


class Faces(NamedTuple):
    """Convex quadrilaterals: `points` f8[n, 4, 3] m, `colors` f8[n, 3], `near` f8[n] m to draw them later."""

    points: np.ndarray
    colors: np.ndarray
    near: np.ndarray


class ObliquePicture:
    """Draws one site from the south-east and above; `frame` gives uint8 (h, w, 3) of always the same shape."""

    def __init__(
        self,
        cell: float,
        regions: dict[str, np.ndarray | None],
        target: np.ndarray,
        blade: Blade,
        machine: Machine,
        width_px: int = 640,
    ):
        self._cell, self._target, self._solid = cell, target, regions.get("solid")
        self._blade, self._machine = blade, machine
        self._tint = _tints(regions, target.shape)
        rows, cols = target.shape
        low, high = float(target.min()) - _BASE, float(target.max()) + 2.0
        corners = np.array([[x, y, z] for x in (0, cols * cell) for y in (0, rows * cell) for z in (low, high)])
        u, v = corners @ _RIGHT, corners @ _UP
        self._scale = (width_px - 2 * _MARGIN) / np.ptp(u)
        self._left, self._top = u.min(), v.max()
        high_px = round(np.ptp(v) * self._scale) + 2 * _MARGIN
        self._shape = high_px + high_px % 2, width_px + width_px % 2
        self._base = low

    def surface(self, height: np.ndarray, pose: np.void | None) -> np.ndarray:
        """The smooth surface through `height` [rows, cols] m, with the machine."""
        height = np.asarray(height, np.float64)
        rows, cols = height.shape
        x, y = np.meshgrid((np.arange(cols) + 0.5) * self._cell, (np.arange(rows) + 0.5) * self._cell)
        points = np.stack([x, y, height], axis=2)
        light = _light(normals_of(height, self._cell))[:, :, None]
        colors = self._colors(height) * light
        quads = np.stack([points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]], axis=2).reshape(-1, 4, 3)
        mean = (colors[:-1, :-1] + colors[:-1, 1:] + colors[1:, 1:] + colors[1:, :-1]).reshape(-1, 3) / 4
        return self._paint([Faces(quads, mean, np.zeros(len(quads))), *self._sides(points), *self._dozer(pose)])

    def cells(self, fill: np.ndarray, bottom: float, dy: float, pose: np.void | None) -> np.ndarray:
        """The cells of `fill` [rows, cols, levels] that are not empty, each as full as it is, with the machine.

        Only faces that can be seen are drawn; nothing is drawn below the deepest ground.
        """
        first = max(0, int((self._base - bottom) / dy))
        shown = np.array(fill[:, :, first:], np.float64)
        if self._solid is not None:
            level = (self._target - bottom) / dy - first
            shown[self._solid] = np.clip(level[self._solid][:, None] + 1.0 / dy - np.arange(shown.shape[2]), 0.0, 1.0)
        origin = np.array([0.0, 0.0, bottom + first * dy])
        size = np.array([self._cell, self._cell, dy])
        above = np.pad(shown, ((0, 0), (0, 0), (0, 1)))[:, :, 1:]
        south, east = np.pad(shown, ((1, 0), (0, 0), (0, 0)))[:-1], np.pad(shown, ((0, 0), (0, 1), (0, 0)))[:, 1:]
        full = np.minimum(shown, 1.0)
        parts = []
        for axis, seen in ((2, (shown > 0) & (above == 0)), (1, full > south), (0, full > east)):
            r, c, m = np.nonzero(seen)
            top = shown[r, c, m] if axis == 2 else full[r, c, m]
            low = np.zeros_like(top) if axis == 2 else np.minimum({1: south, 0: east}[axis][r, c, m], top)
            corner = np.stack([c, r, m], axis=1).astype(float)
            points = origin + size * (corner[:, None, :] + _face(axis, low, top))
            level = origin[2] + (m + top) * dy
            light = float(_light({2: _axis(2), 1: -_axis(1), 0: _axis(0)}[axis]))
            parts.append(Faces(points, self._colors_at(r, c, level) * light, np.zeros(len(r))))
        return self._paint([*parts, *self._dozer(pose)], outlined=True)

    def _colors(self, height: np.ndarray) -> np.ndarray:
        r, c = np.indices(height.shape)
        return self._colors_at(r.ravel(), c.ravel(), height.ravel()).reshape(*height.shape, 3)

    def _colors_at(self, r: np.ndarray, c: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Ground, or soil as far as the level lies over the target, tinted by regions, f8[n, 3]."""
        over = np.maximum(level - self._target[r, c], 0.0)
        share = (over / (over + _THIN))[:, None]
        ground = GROUND * (1 - self._tint[1][r, c, None]) + self._tint[0][r, c] * self._tint[1][r, c, None]
        colors = ground + share * (SOIL - ground)
        if self._solid is not None:
            colors[self._solid[r, c]] = _BLOCK
        return colors

    def _sides(self, points: np.ndarray) -> list[Faces]:
        """The southern and eastern sides of the block of ground."""
        faces = []
        for line, normal in ((points[0], -_axis(1)), (points[:, -1], _axis(0))):
            low = line.copy()
            low[:, 2] = self._base
            quads = np.stack([line[:-1], line[1:], low[1:], low[:-1]], axis=1)
            faces.append(Faces(quads, np.tile(0.8 * GROUND * _light(normal), (len(quads), 1)), np.zeros(len(quads))))
        return faces

    def _dozer(self, pose: np.void | None) -> list[Faces]:
        """The machine's parts as boxes, standing on the plane of its tracks."""
        if pose is None:
            return []
        reach, half, edge = self._blade.reach, self._blade.width / 2, float(pose["edge"])
        plate = Part((reach - 0.05, 0.0), (0.09, half), 0.0, blade_color(edge), edge + self._blade.height)
        parts = [
            (part, 0.25 if part.high > 0.7 else 0.0)
            for part in (*track_parts(self._machine), *body_parts(self._machine))
        ]
        faces = [_box(part, low, pose) for part, low in (*parts, (plate, edge))]
        order = np.repeat(np.arange(len(faces)), [len(f.points) for f in faces]) * 1e-3
        points, colors = (np.concatenate([getattr(f, name) for f in faces]) for name in ("points", "colors"))
        middle = float(np.array([pose["x"], pose["y"], 0.0]) @ _AWAY)
        return [Faces(points, colors, points.mean(axis=1) @ _AWAY - middle + _NEARER + order)]

    def _paint(self, groups: list[Faces], outlined: bool = False) -> np.ndarray:
        image = np.empty((*self._shape, 3), np.float32)
        image[:] = _PAPER
        points, colors, near = (np.concatenate([getattr(g, name) for g in groups]) for name in Faces._fields)
        corners = np.stack(
            [(points @ _RIGHT - self._left) * self._scale, (self._top - points @ _UP) * self._scale], axis=2
        )
        order = np.argsort(near - points.mean(axis=1) @ _AWAY, kind="stable")
        _fill(image, corners[order] + _MARGIN, colors[order], outlined)
        return np.clip(image, 0, 255).astype(np.uint8)


def _fill(image: np.ndarray, corners: np.ndarray, colors: np.ndarray, outlined: bool) -> None:
    """Draw convex polygons `corners` [n, k, 2] px (right, down) over `image` in place, in that order.

    Their edges are smooth, and darker where `outlined`.
    """
    x, y = np.arange(image.shape[1], dtype=np.float32) + 0.5, np.arange(image.shape[0], dtype=np.float32)[:, None] + 0.5
    lines = _edge_lines(corners).astype(np.float32)[..., None, None]
    first = np.maximum(np.floor(corners.min(axis=1)).astype(int) - 1, 0)
    end = np.minimum(np.floor(corners.max(axis=1)).astype(int) + 2, image.shape[1::-1])
    seen = np.nonzero((end > first).all(axis=1))[0].tolist()
    first, end, colors = first.tolist(), end.tolist(), colors.astype(np.float32)
    for k in seen:
        (left, top), (right, bottom) = first[k], end[k]
        along, across, shift = lines[k]
        inside = (across * x[left:right] + (along * y[top:bottom] + shift)).min(axis=0)[:, :, None]
        ink = colors[k] * np.minimum(np.maximum(0.62 + 0.4 * inside, 0.62), 1.0) if outlined else colors[k]
        patch = image[top:bottom, left:right]
        patch += np.minimum(np.maximum(inside + 0.7, 0.0), 1.0) * (ink - patch)


def _edge_lines(corners: np.ndarray) -> np.ndarray:
    """(along, across, shift) f8[n, 3, k]: a point (x, y) lies across x + along y + shift px inside that edge's line.

    An edge without length is no edge: everything lies inside it.
    """
    step = np.roll(corners, -1, axis=1) - corners
    x, y = corners[:, :, 0], corners[:, :, 1]
    area = (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1)
    turn = np.where(area > 0.0, 1.0, -1.0)[:, None]
    length = np.hypot(step[:, :, 0], step[:, :, 1])
    real = length > 1e-9
    scale = np.where(real, turn / np.where(real, length, 1.0), 0.0)
    along, across = step[:, :, 0] * scale, -step[:, :, 1] * scale
    shift = np.where(real, -(along * y + across * x), 1e6)
    return np.stack([along, across, shift], axis=1)


def _face(axis: int, low: np.ndarray, top: np.ndarray) -> np.ndarray:
    """Corners f8[n, 4, 3] in a unit cell of its top at `top`, or of the southern (1) or eastern (0) side from `low`."""
    corners = np.empty((len(top), 4, 3))
    first, second = _CORNERS[:, 0], _CORNERS[:, 1]
    if axis == 2:
        corners[:, :, 0], corners[:, :, 1], corners[:, :, 2] = first, second, top[:, None]
        return corners
    corners[:, :, 1 - axis] = first
    corners[:, :, axis] = 0.0 if axis == 1 else 1.0
    corners[:, :, 2] = low[:, None] + second * (top - low)[:, None]
    return corners


def _box(part: Part, low: float, pose: np.void) -> Faces:
    """The faces of a part between `low` and its height over the tracks that can be seen."""
    c, s = cos(float(pose["heading"])), sin(float(pose["heading"]))
    ahead = np.array([c, s, float(pose["pitch"])])
    left = np.array([-s, c, float(pose["roll"])])
    at = np.array([float(pose["x"]), float(pose["y"]), float(pose["z"])])
    corner = np.array(
        [[part.center[0] + a * part.half[0], part.center[1] + b * part.half[1]] for a, b in 2 * _CORNERS - 1]
    )
    ring = at + corner[:, :1] * ahead + corner[:, 1:] * left
    lower, upper = ring + low * _axis(2), ring + part.high * _axis(2)
    points, colors = [], []
    for k in range(4):
        n = (k + 1) % 4
        normal = np.cross(ring[n] - ring[k], _axis(2))
        normal /= np.linalg.norm(normal)
        if normal @ _AWAY < 0:
            points.append([lower[k], lower[n], upper[n], upper[k]])
            colors.append(np.array(part.color) * _light(normal))
    points.append(list(upper))
    colors.append(np.array(part.color) * 1.05)
    return Faces(np.array(points), np.array(colors), np.zeros(len(points)))


def _tints(regions: dict[str, np.ndarray | None], shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Colour f8[rows, cols, 3] and strength f8[rows, cols] of the regions."""
    color, strength = np.zeros((*shape, 3)), np.zeros(shape)
    for name, tint in (("design", DESIGN), ("start", START), ("goal", GOAL)):
        region = regions.get(name)
        if region is not None:
            color[region], strength[region] = tint, 0.45
    return color, strength


def _light(normal: np.ndarray) -> np.ndarray:
    """Brightness of faces with these unit normals [..., 3]."""
    return 0.45 + 0.68 * np.maximum(normal @ _SUN, 0.0)


def _axis(k: int) -> np.ndarray:
    return np.eye(3)[k]
