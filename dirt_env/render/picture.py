"""The site from above, north up, as an array: shaded relief, regions, obstacles, machine. numpy only, no display."""

from math import log10

import numpy as np

from dirt_env.render.dozer import ABOVE, BELOW, CAB, HOOD, LEVEL, Dozer
from dirt_env.render.lettering import text
from dirt_env.render.overlay import DESIGN, GOAL, START, Overlay
from dirt_env.render.raster import View
from dirt_env.render.relief import Relief
from dirt_env.sim.params import Blade, Machine

SIGNS = (START, GOAL, DESIGN, ABOVE, LEVEL, BELOW, HOOD, CAB)  # few pixels that mean much: a palette has to keep them
_PAPER, _INK, _RIM = (30, 35, 42), (222, 227, 233), (120, 128, 138)
_MARGIN, _STRIP = 10, 34  # px around the map and below it
_SMALL = 200  # px: narrower maps carry neither margin nor strip


class Picture:
    """Draws one site. `frame` gives uint8 (h, w, 3) of always the same shape; the longer side of the map is `width_px`.

    start, goal: bool[rows, cols] regions; design: bool[rows, cols] or None, where `target` is asked for;
    solid: bool[rows, cols] obstacles or None; target: f8[rows, cols] the ground that should be left [m].
    """

    def __init__(
        self,
        cell: float,
        start: np.ndarray,
        goal: np.ndarray,
        design: np.ndarray | None,
        solid: np.ndarray | None,
        target: np.ndarray,
        blade: Blade,
        machine: Machine,
        width_px: int = 640,
    ):
        if width_px < 16:
            raise ValueError(f"width_px is {width_px}; allowed: >= 16 px")
        rows, cols = target.shape
        scale = width_px / max(rows, cols)
        shape = max(2, round(rows * scale)), max(2, round(cols * scale))
        self._relief = Relief(target, design, cell, shape)
        self._overlay = Overlay(shape, scale)
        self._cover(start, goal, design, solid)
        self._dozer = Dozer(blade, machine)
        self._view = View(scale / cell, 0.0, float(shape[0]))
        self._sheet = self._paper(shape, scale / cell)

    def frame(self, height: np.ndarray, pose: np.void | None, caption: str = "") -> np.ndarray:
        """The picture uint8 (h, w, 3) of heights f4[rows, cols] and one machine record (None: no machine)."""
        image = self._relief.draw(height)
        self._overlay.apply(image)
        if pose is not None:
            self._dozer.draw(image, self._view, pose)
        np.clip(image, 0, 255, out=image)
        sheet = self._sheet.copy()
        top, left = self._corner
        rows, cols = image.shape[1:]
        for k in range(3):
            sheet[top : top + rows, left : left + cols, k] = image[k]
        if caption and self._room:
            self._write(sheet, caption)
        return sheet

    def _cover(self, start: np.ndarray, goal: np.ndarray, design: np.ndarray | None, solid: np.ndarray | None) -> None:
        if design is not None:
            self._overlay.region(design, DESIGN, hatch=-1)
        self._overlay.region(start, START, hatch=1)
        self._overlay.region(goal, GOAL)
        if solid is not None:
            self._overlay.blocks(solid)

    def _paper(self, shape: tuple[int, int], scale: float) -> np.ndarray:
        """The sheet uint8 (h, w, 3) for map and caption, with border and scale bar; its sides are even, for video."""
        framed = shape[1] >= _SMALL
        margin, strip = (_MARGIN, _STRIP) if framed else (0, 0)
        high, wide = shape[0] + 2 * margin + strip, shape[1] + 2 * margin
        self._corner = margin, margin
        sheet = np.full((high + high % 2, wide + wide % 2, 3), _PAPER, np.uint8)
        self._room = 0
        if framed:
            sheet[margin - 2 : margin + shape[0] + 2, margin - 2 : margin + shape[1] + 2] = _RIM
            self._room = wide - 2 * margin - self._scale_bar(sheet, scale)
        return sheet

    def _scale_bar(self, sheet: np.ndarray, scale: float) -> int:
        """Draw a bar of a round length and its label into the strip, at the right; returns the pixels it takes."""
        metres = round_length(110 / scale)
        bar = round(metres * scale)
        label = text(f"{metres:g} m", 10)
        right, middle = sheet.shape[1] - _MARGIN - 2, sheet.shape[0] - _STRIP // 2 - 3
        left = right - label.shape[1] - bar - 8
        sheet[middle - 2 : middle + 3, left : left + bar] = _INK
        for part in (1, 3):
            sheet[middle - 1 : middle + 2, left + part * bar // 4 : left + (part + 1) * bar // 4] = _PAPER
        _stamp(sheet, label, middle - label.shape[0] // 2, right - label.shape[1])
        return label.shape[1] + bar + 30

    def _write(self, sheet: np.ndarray, caption: str) -> None:
        """Write the caption into the strip, smaller if it is long, cut if it is too long."""
        size = 11
        while size > 7 and text(caption, size).shape[1] > self._room:
            size -= 1
        line = text(caption, size)[:, : self._room]
        _stamp(sheet, line, sheet.shape[0] - _STRIP // 2 - 3 - line.shape[0] // 2, _MARGIN)


def round_length(metres: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above `metres`."""
    decade = 10.0 ** int(np.floor(log10(metres)))
    return max(step * decade for step in (1, 2, 5) if step * decade <= metres * (1 + 1e-9))


def _stamp(sheet: np.ndarray, cover: np.ndarray, top: int, left: int) -> None:
    """Lay ink on `sheet` uint8 (h, w, 3) in place, as much as `cover` [h, w] says."""
    part = sheet[top : top + cover.shape[0], left : left + cover.shape[1]]
    part[:] = part + cover[: part.shape[0], : part.shape[1], None] * (np.array(_INK) - part)
