"""Anti-aliased shapes for numpy pictures: coverage of pixels from signed distances, and blending."""

from typing import NamedTuple

import numpy as np


class View(NamedTuple):
    """Where the site lies in a picture: `scale` pixels per metre, its left and bottom edge in pixels."""

    scale: float
    left: float
    bottom: float

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Picture coordinates (right, down) [px] of the site's point (x, y) [m]."""
        return self.left + x * self.scale, self.bottom - y * self.scale


def box_distance(
    along: np.ndarray, across: np.ndarray, center: tuple[float, float], half: tuple[float, float], radius: float
) -> np.ndarray:
    """Signed distance to a rounded rectangle, negative inside; same unit and shape as the two coordinates."""
    radius = min(radius, *half)
    a = np.abs(along - center[0]) - (half[0] - radius)
    b = np.abs(across - center[1]) - (half[1] - radius)
    return np.hypot(np.maximum(a, 0), np.maximum(b, 0)) + np.minimum(np.maximum(a, b), 0) - radius


def segment_distance(
    along: np.ndarray, across: np.ndarray, begin: tuple[float, float], end: tuple[float, float]
) -> np.ndarray:
    """Distance to the segment from `begin` to `end`; same unit and shape as the two coordinates."""
    da, db = end[0] - begin[0], end[1] - begin[1]
    a, b = along - begin[0], across - begin[1]
    share = np.clip((a * da + b * db) / max(da * da + db * db, 1e-12), 0, 1)
    return np.hypot(a - share * da, b - share * db)


def coverage(distance_px: np.ndarray) -> np.ndarray:
    """Share of each pixel covered by a shape, from the signed distance of its centre to the outline [px]."""
    return np.clip(0.5 - distance_px, 0, 1)


def blend(image: np.ndarray, alpha: np.ndarray, color: tuple[float, float, float]) -> None:
    """Paint `color` (0..255) over `image` f4[3, h, w] in place, as opaque as `alpha` [h, w]."""
    for channel, value in zip(image, color, strict=True):
        channel += alpha * (value - channel)


class Resampling:
    """Cubic resampling of `source` samples along one axis to `out` pixels, and `apron` more on either side; ends held.

    Enlarging interpolates (Mitchell and Netravali 1988: no visible grid, little blur); reducing averages. A few taps
    for each pixel rather than a matrix: that needs no threads of a linear algebra library, which would wait for each
    other where several programs share the processor.
    """

    def __init__(self, out: int, source: int, apron: int = 0, backwards: bool = False):
        shrink = max(1.0, source / out)
        center = (np.arange(-apron, out + apron) + 0.5) * (source / out) - 0.5
        taps = np.arange(int(np.ceil(4 * shrink)) + (shrink > 1))[:, None]
        index = np.floor(center - 2 * shrink).astype(int) + 1 + taps
        weight = _mitchell((index - center) / shrink)
        weight /= weight.sum(axis=0)
        turn = slice(None, None, -1 if backwards else 1)
        self._index = np.clip(index, 0, source - 1)[:, turn]
        self._weight = weight.astype(np.float32)[:, turn]

    def rows(self, values: np.ndarray, part: slice = slice(None)) -> np.ndarray:
        """Resample f4[source, n] along the first axis to f4[out, n], or only the rows of the result named by `part`."""
        return self._sum(values, part, axis=0)

    def cols(self, values: np.ndarray) -> np.ndarray:
        """Resample f4[n, source] along the second axis to f4[n, out]."""
        return self._sum(values, slice(None), axis=1)

    def _sum(self, values: np.ndarray, part: slice, axis: int) -> np.ndarray:
        total = None
        for index, weight in zip(self._index[:, part], self._weight[:, part], strict=True):
            term = values.take(index, axis=axis)
            term *= weight[:, None] if axis == 0 else weight
            total = term if total is None else np.add(total, term, out=total)
        return total


def _mitchell(x: np.ndarray) -> np.ndarray:
    x = np.abs(x)
    near = (7 * x**3 - 12 * x**2 + 16 / 3) / 6
    far = (-7 / 3 * x**3 + 12 * x**2 - 20 * x + 32 / 3) / 6
    return np.where(x < 1, near, np.where(x < 2, far, 0.0))
