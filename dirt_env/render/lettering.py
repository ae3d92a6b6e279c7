"""Text in numpy pictures: an own stroke alphabet, drawn anti-aliased at any size. No font files."""

from functools import cache
from itertools import pairwise

import numpy as np

from dirt_env.render.raster import coverage, segment_distance

# Polylines of points "xy" on a grid: base line y = 2, small letters up to 6, capitals up to 8, descenders down to 0.
_STROKES = {
    "0": "12 03 07 18 28 37 33 22 12", "1": "07 18 12|02 22", "2": "07 18 28 37 36 02 32",
    "3": "07 18 28 37 36 25 34 33 22 12 03|15 25", "4": "28 04 34|25 22", "5": "38 08 05 25 34 33 22 12 03",
    "6": "37 28 18 07 03 12 22 33 34 25 15 04", "7": "08 38 12", "8": "15 06 07 18 28 37 36 25 15 04 03 12 22 33 34 25",
    "9": "03 12 22 33 37 28 18 07 06 15 25 36",
    "A": "02 28 42|14 34", "B": "02 08 28 37 36 25 05|25 34 33 22 02", "C": "37 28 18 07 03 12 22 33",
    "D": "02 08 18 36 34 12 02", "E": "38 08 02 32|05 25", "F": "38 08 02|05 25", "G": "37 28 18 07 03 12 22 33 35 25",
    "H": "02 08|38 32|05 35", "I": "02 08", "J": "38 33 22 12 03", "K": "02 08|38 05 32", "L": "08 02 32",
    "M": "02 08 24 48 42", "N": "02 08 32 38", "O": "12 03 07 18 28 37 33 22 12", "P": "02 08 28 37 36 25 05",
    "Q": "12 03 07 18 28 37 33 22 12|24 32", "R": "02 08 28 37 36 25 05|15 32",
    "S": "37 28 18 07 06 15 25 34 33 22 12 03",
    "T": "08 48|28 22", "U": "08 03 12 22 33 38", "V": "08 22 48", "W": "08 12 26 32 48", "X": "02 38|08 32",
    "Y": "08 25 48|25 22", "Z": "08 38 02 32",
    "a": "05 16 26 35 32|34 14 03 12 22 33", "b": "08 02 22 33 35 26 06", "c": "35 26 16 05 03 12 22 33",
    "d": "38 32 12 03 05 16 36", "e": "04 34 35 26 16 05 03 12 32", "f": "28 18 07 02|06 26",
    "g": "36 31 20 10 01|36 16 05 03 12 32", "h": "08 02|05 16 26 35 32", "i": "02 06|08 08", "j": "16 11 00|18 18",
    "k": "08 02|26 04 22", "l": "08 03 12", "m": "02 06|05 16 25 22|25 36 45 42", "n": "02 06|05 16 26 35 32",
    "o": "12 03 05 16 26 35 33 22 12", "p": "00 06 26 35 33 22 02", "q": "30 36 16 05 03 12 32", "r": "02 06|04 16 26",
    "s": "36 16 05 14 24 33 22 02", "t": "08 03 12 22|06 26", "u": "06 03 12 22 33|36 32", "v": "06 22 46",
    "w": "06 12 25 32 46", "x": "02 36|06 32", "y": "06 22|46 22 10", "z": "06 36 02 32",
    ".": "02 02", ",": "02 01", ":": "02 02|05 05", "%": "02 48|07 08 18 17 07|32 33 43 42 32", "/": "02 38",
    "+": "05 25|16 14", "-": "05 25", "=": "04 24|06 26", "(": "18 06 04 12", ")": "08 16 14 02", "|": "02 08",
    "'": "08 07", "_": "02 32", "#": "12 18|22 28|04 34|06 36", "<": "27 05 23",
    ">": "07 25 03", "?": "07 18 28 37 36 14|12 12",
    "²": "08 19 28 27 05 25", "³": "09 29 17 27 26 15 05",
    "°": "07 08 18 17 07", "·": "05 05", "—": "05 45", "–": "05 35",
}  # fmt: skip


def text(line: str, size: float) -> np.ndarray:
    """Coverage f4[h, w] of one line of text whose capitals are `size` pixels high; unknown characters become `?`."""
    return np.concatenate([_glyph(char, size) for char in line] or [_glyph(" ", size)], axis=1)


@cache
def _glyph(char: str, size: float) -> np.ndarray:
    """Coverage f4[h, w] of one character: 10 grid units high with the base line 2 above the bottom."""
    unit = size / 6.0
    lines = [_points(line) for line in _STROKES.get(char, _STROKES["?"]).split("|")] if char != " " else []
    right = max((x for line in lines for x, _ in line), default=1.0)
    across = (np.arange(round((right + 2.0) * unit)) + 0.5) / unit - 0.8
    up = (np.arange(round(10.5 * unit))[::-1, None] + 0.5) / unit - 0.3
    near = np.full((len(up), len(across)), np.inf)
    for line in lines:
        for begin, end in pairwise(line):
            near = np.minimum(near, segment_distance(across, up, begin, end))
    return coverage((near - 0.42) * unit).astype(np.float32)


def _points(line: str) -> list[tuple[float, float]]:
    return [(float(point[0]), float(point[1])) for point in line.split()]
