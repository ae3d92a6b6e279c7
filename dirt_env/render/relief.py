"""Shaded relief of a height field: light, shadow, soil colours. Arrays in, picture planes out; numpy only."""

from functools import cache

import numpy as np

from dirt_env.render.raster import Resampling

GROUND = np.array([164.0, 152.0, 126.0])  # settled ground, dry and pale
SOIL = np.array([138.0, 84.0, 42.0])  # soil above the target: loose and warm
CUT = np.array([96.0, 82.0, 70.0])  # ground below the target: damp subsoil
FILL = np.array([70.0, 104.0, 150.0])  # the same inside a design region: soil is missing here
_THIN = 0.06  # m of soil that gives half of the full colour, so that a film of a few cm is seen
_BAND = 64  # px
_SUN = (-0.56, 0.56, 0.61)  # unit vector to the sun: north-west, 38 degrees up
_BOOST = 1.9  # small slopes are drawn steeper by this factor,
_STEEP = 0.9  # slopes of about this much no longer


class Relief:
    """Turns heights f4[rows, cols] (row 0 south) into a lit picture f4[3, h, w] (row 0 north)."""

    def __init__(self, target: np.ndarray, design: np.ndarray | None, cell: float, shape: tuple[int, int]):
        rows, cols = target.shape
        self.cell = cell
        self._down = Resampling(shape[0], rows, apron=1, backwards=True)
        self._across = Resampling(shape[1], cols, apron=1)
        self._per_pixel = rows * cell / shape[0], cols * cell / shape[1]
        self._target = self.enlarge(target)[1:-1, 1:-1]
        self._interval = contour_interval(target)
        self._albedo, self._below = self._ground(target, design, shape)

    def enlarge(self, values: np.ndarray) -> np.ndarray:
        """Cell values [rows, cols] as smooth pixels f4[h + 2, w + 2] with one pixel to spare on each side."""
        return self._down.rows(self._across.cols(np.asarray(values, np.float32)))

    def draw(self, height: np.ndarray) -> np.ndarray:
        """The lit ground f4[3, h, w], values about 0..255."""
        height = np.asarray(height, np.float32)
        surface, ambient = self._across.cols(height), self._across.cols(occlusion(height, self.cell))
        image = np.empty_like(self._albedo)
        for top in range(0, image.shape[1], _BAND):  # in bands that stay in the processor's cache
            rows = slice(top, min(top + _BAND, image.shape[1]))
            around = slice(rows.start, rows.stop + 2)
            open_sky = self._down.rows(ambient, around)[1:-1, 1:-1]
            self._band(self._down.rows(surface, around), open_sky, rows, image)
        return image

    def _band(self, surface: np.ndarray, ambient: np.ndarray, rows: slice, image: np.ndarray) -> None:
        """Draw the pixel rows `rows` of the image, from heights f4[rows + 2, w + 2] and ambient light f4[rows, w]."""
        inner = surface[1:-1, 1:-1]
        north = (surface[:-2, 1:-1] - surface[2:, 1:-1]) * np.float32(0.5 / self._per_pixel[0])
        east = (surface[1:-1, 2:] - surface[1:-1, :-2]) * np.float32(0.5 / self._per_pixel[1])
        slope2 = north * north
        slope2 += east * east
        light = _sunlight(north, east, slope2)
        light *= ambient
        light *= self._contours(inner, slope2)
        depth = inner - self._target[rows]
        depth /= np.abs(depth) + np.float32(_THIN)
        above, below = np.maximum(depth, 0), np.minimum(depth, 0)
        for k in range(3):
            color = image[k, rows]
            np.multiply(np.float32(SOIL[k]) - self._albedo[k, rows], above, out=color)
            color += self._albedo[k, rows]
            color += self._below[k, rows] * below
            color *= light

    def _contours(self, inner: np.ndarray, slope2: np.ndarray) -> np.ndarray:
        """Light kept at each pixel f4[h, w] by thin height lines; flat ground carries none."""
        level = inner * np.float32(1 / self._interval)
        level -= np.floor(level)
        level -= np.float32(0.5)
        slope = np.sqrt(slope2)
        away = np.abs(level, out=level)
        away *= np.float32(self._interval / self._per_pixel[0])
        away /= slope + np.float32(1e-6)
        line = np.clip(np.float32(1.1) - away, 0, 1)
        line *= np.minimum(slope * np.float32(4), np.float32(0.2))
        return np.subtract(np.float32(1), line, out=line)

    def _ground(
        self, target: np.ndarray, design: np.ndarray | None, shape: tuple[int, int]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Static colours f4[3, h, w]: the bare ground, lighter where it is high, and what a cut takes from it."""
        span = max(float(np.ptp(target)), 1.0)
        high = (self._target - np.float32(target.mean())) / np.float32(span)
        tint = 1 + np.float32(0.22) * high + _grain(shape)
        albedo = _plane(GROUND) * tint
        if design is None:
            return albedo, albedo - _plane(CUT)
        inside = np.clip(self.enlarge(design)[1:-1, 1:-1], 0, 1)
        return albedo, albedo - _plane(CUT) - _plane(FILL - CUT) * inside


def _plane(color: np.ndarray) -> np.ndarray:
    """A colour as f4[3, 1, 1], to go with planes [h, w]."""
    return color.astype(np.float32)[:, None, None]


def contour_interval(target: np.ndarray) -> float:
    """Metres between height lines: 0.25, 0.5, 1, 2.5, ... so that about twelve cover the ground's relief."""
    span = max(float(np.ptp(target)), 1e-9) / 12
    steps = [0.25, 0.5] + [a * 10.0**k for k in range(5) for a in (1.0, 2.5, 5.0)]
    return next((step for step in steps if step >= span), steps[-1])


def occlusion(height: np.ndarray, cell: float) -> np.ndarray:
    """Light left at each cell f4[rows, cols], 0.5..1.1: hollows and the feet of heaps are darker, ridges lighter."""
    height = np.asarray(height, np.float32)
    light = np.ones_like(height)
    for radius, strength in ((0.75, 0.35), (2.0, 0.25)):
        cells = max(1, round(radius / cell))
        light -= np.float32(strength / radius) * (_mean(height, cells) - height)
    return np.clip(light, 0.5, 1.1)


def _mean(values: np.ndarray, cells: int) -> np.ndarray:
    """Mean over the square of 2 `cells` + 1 around each cell; the edge is held."""
    width = 2 * cells + 1
    padded = np.pad(values, cells, mode="edge")
    total = np.cumsum(np.pad(padded, ((1, 0), (0, 0))), axis=0, dtype=np.float64)
    total = total[width:] - total[:-width]
    total = np.cumsum(np.pad(total, ((0, 0), (1, 0))), axis=1)
    return ((total[:, width:] - total[:, :-width]) / width**2).astype(np.float32)


def _sunlight(north: np.ndarray, east: np.ndarray, slope2: np.ndarray) -> np.ndarray:
    """Brightness f4[h, w] of slopes, 1 on flat ground; small slopes are boosted."""
    boost = np.float32(_BOOST) / np.sqrt(1 + slope2 * np.float32((_BOOST / _STEEP) ** 2 * 0.25))
    light = north * np.float32(-_SUN[1])
    light -= east * np.float32(_SUN[0])
    light *= boost
    light += np.float32(_SUN[2])
    light /= np.sqrt(1 + slope2 * boost * boost)
    np.maximum(light, 0, out=light)
    light *= np.float32(0.62 / _SUN[2])
    light += np.float32(0.38)
    return light


@cache
def _grain(shape: tuple[int, int]) -> np.ndarray:
    """Fixed speckle f4[h, w] of a few per cent: earth is not paint."""
    random = np.random.default_rng(0)
    grain = np.zeros(shape, np.float32)
    for pixels, strength in ((24, 0.018), (6, 0.014), (2, 0.014)):
        coarse = [max(2, side // pixels) for side in shape]
        noise = random.standard_normal(coarse, np.float32)
        noise = Resampling(shape[0], coarse[0]).rows(Resampling(shape[1], coarse[1]).cols(noise))
        grain += np.float32(strength) * noise
    return grain
