"""What lies over the ground and never changes: outlined regions and obstacles, as one layer to blend with."""

import numpy as np

from dirt_env.render.raster import Resampling, blend

START, GOAL, DESIGN = (255, 200, 60), (20, 120, 220), (204, 121, 167)  # told apart by the colour-blind too
BLOCK = (52, 54, 60)


class Overlay:
    """A picture layer: `light` darkens what is below (shadows), `keep` of it stays, `paint` is added."""

    def __init__(self, shape: tuple[int, int], pixels_per_cell: float):
        self._shape = shape
        self._cell = pixels_per_cell
        self.keep = np.ones(shape, np.float32)
        self.paint = np.zeros((3, *shape), np.float32)

    def apply(self, image: np.ndarray) -> None:
        """Lay it over `image` f4[3, h, w] in place."""
        image *= self.keep
        image += self.paint

    def region(self, mask: np.ndarray, color: tuple[int, int, int], hatch: int = 0) -> None:
        """Tint the cells of `mask` bool[rows, cols] lightly and outline them; `hatch` +1 or -1 lays stripes on them."""
        if not mask.any():
            return
        inside = np.clip(_enlarge(mask, self._shape), 0, 1)
        slope = np.hypot(*np.gradient(inside)) + 1e-3
        away = np.abs(inside - 0.5) / slope
        line = np.clip(1.9 - away, 0, 1) * (slope > 0.01)
        shadow = np.clip(3.2 - away, 0, 1) * (slope > 0.01)
        self._lay(inside * (0.07 + 0.2 * self._stripes(hatch) if hatch else 0.15), color)
        self._lay(0.35 * shadow, (0, 0, 0))
        self._lay(0.95 * line, color)

    def blocks(self, solid: np.ndarray) -> None:
        """Cover the cells of `solid` bool[rows, cols] with dark hatched blocks that throw a shadow south-east."""
        down, right = (np.arange(side) for side in self._shape)
        rows, cols = solid.shape
        row = rows - 1 - down * rows // self._shape[0]
        block = solid[row[:, None], (right * cols // self._shape[1])[None, :]]
        shadow = np.zeros(self._shape, np.float32)
        reach = max(2, round(0.9 * self._cell))
        for step in range(1, reach + 1):
            shadow[step:, step:] = np.maximum(shadow[step:, step:], block[:-step, :-step] * (1 - 0.6 * step / reach))
        self._lay(0.6 * shadow * ~block, (0, 0, 0))
        self._lay(block.astype(np.float32), BLOCK)
        hatch = ((down[:, None] + right[None, :]) % 9 < 2) & block
        self._lay(0.12 * hatch, (255, 255, 255))
        rim = block & ~(_shift(block, 2, 0) & _shift(block, 0, 2))
        self._lay(0.45 * rim, (255, 255, 255))

    def _stripes(self, hatch: int) -> np.ndarray:
        """Thin diagonal stripes f4[h, w], rising to the right for +1 and falling for -1."""
        down, right = (np.arange(side, dtype=np.float32) for side in self._shape)
        period = np.float32(max(12.0, 2.4 * self._cell))
        place = (right + hatch * down[:, None]) / period % 1
        return np.clip(1.5 - np.abs(place - np.float32(0.5)) * period, 0, 1)

    def _lay(self, alpha: np.ndarray, color: tuple[int, int, int]) -> None:
        blend(self.paint, alpha, color)
        self.keep *= (1 - alpha).astype(np.float32)


def _enlarge(mask: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """The mask as smooth pixels f4[h, w]; its stairs are rounded over about two cells."""
    soft = np.pad(mask.astype(np.float32), 2, mode="edge")
    for _ in range(2):
        soft = (soft[:-2] + 2 * soft[1:-1] + soft[2:]) / 4
        soft = (soft[:, :-2] + 2 * soft[:, 1:-1] + soft[:, 2:]) / 4
    wide = Resampling(shape[1], mask.shape[1]).cols(soft)
    return Resampling(shape[0], mask.shape[0], backwards=True).rows(wide)


def _shift(block: np.ndarray, down: int, right: int) -> np.ndarray:
    """`block` moved by a few pixels down and right; what comes in from outside counts as not covered."""
    moved = np.zeros_like(block)
    moved[down:, right:] = block[: block.shape[0] - down, : block.shape[1] - right]
    return moved
