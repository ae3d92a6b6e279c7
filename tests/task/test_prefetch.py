"""What is asked for in good time: all that is going to be read, and not much more."""

import numpy as np
import pytest

from dirt_env.task.prefetch import cells, chord, sides_of

ROWS, COLS = 40, 30


@pytest.mark.parametrize("heading", [0.0, 0.3, np.pi / 4, np.pi / 2, 2.0, np.pi, -0.9, -np.pi / 2])
@pytest.mark.parametrize("middle", [(15.0, 20.0), (2.5, 38.0), (31.0, -3.0)])
def test_all_cells_of_a_turned_square_are_asked_for_and_few_others(heading, middle):
    (x, y), half, ahead = middle, 6.0, np.array([np.cos(heading), np.sin(heading)])
    row, col = np.mgrid[:ROWS, :COLS] + 0.5
    along, across = (col - x) * ahead[0] + (row - y) * ahead[1], (row - y) * ahead[0] - (col - x) * ahead[1]
    inside = np.maximum(abs(along), abs(across)) <= half
    asked = np.zeros_like(inside)
    sides, farthest = sides_of(half, *ahead), half * abs(ahead).sum()
    for r in range(*cells(y - farthest, y + farthest, ROWS)):
        left, right = chord(sides, r + 0.5 - y)
        first, end = cells(x + left, x + right, COLS)
        asked[r, first:end] = True
    assert not (inside & ~asked).any()
    near = np.maximum(abs(along), abs(across)) <= half + 1.5
    assert not (asked & ~near).any()


@pytest.mark.parametrize(
    ("ends", "found"),
    [
        ((2.5, 4.5), (2, 5)),
        ((-7.0, -3.0), (0, 0)),
        ((-0.5, 0.5), (0, 1)),
        ((8.0, 99.0), (8, 10)),
        ((12.0, 14.0), (10, 10)),
    ],
)
def test_cells_are_those_of_the_map(ends, found):
    assert cells(*ends, 10) == found
