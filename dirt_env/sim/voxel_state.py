"""The paper's grid of cells (Section III): what it consists of, the readings of its rules, and how one is made.

The paper's x is our x (columns, east), its z our y (rows, north), its y is up. Cells are kept as arrays
[row, column, level]: a column of soil is contiguous, and so is a run of columns along x, whatever the levels. One cell
more on every side (the rim, the floor, the ceiling) bears a constraint for ever, so that no rule needs a border case.
"""

from typing import NamedTuple

import numpy as np

from dirt_env.sim.params import Grid

FOREVER = -1  # life of a constraint that is never removed
LARGEST_LIFE = 32766  # updates; lives are 16-bit
WORK = 8  # rows of the work space, named in `voxel`
FOOTINGS = ("tracks", "point", "heap")  # what the agent's height is taken from, see `Rules.footing`
TRACKS, POINT, HEAP = range(3)
VOXEL_WORK_SPACE = ("work", "flags")  # fields that hold nothing between two updates
MOST_VOXELS = 2**26
GRAIN = 2.0**-36  # share of a cell; sums of fills that are multiples of it are exact


class Rules(NamedTuple):
    """How soil moves between cells, and which of the readings that the paper's text allows.

    `difference` is reqDiff, the share of a cell by which a neighbour must be emptier; soil then stands at slopes of
    `difference` dy / dx up to twice that. `rate` is transferRate, the share of a cell's fill that spreads in one
    update, `life` how many updates a constraint lasts. `grain`: amounts that spread are rounded to multiples of it, a
    power of two, so that volume is equal to the last bit; 0 does not round.

    Readings: `neighbours` 4 or 8 cells of the same level; `in_place` lets a cell see what its neighbours have become
    in this update, not what they were; `down_in_transit` puts soil that sinks among the outgoing, to arrive with the
    next update; `rise_into_constraint` lets overflow rise into a cell with a constraint. `footing` is what the agent's
    y follows: TRACKS, the surface under its tracks; POINT, the surface at its position, the agent upright; HEAP, as
    TRACKS, with soil in the air counted as fallen.
    """

    difference: float = 0.7
    rate: float = 0.08
    life: int = 100
    grain: float = 0.0
    neighbours: int = 4
    in_place: bool = False
    down_in_transit: bool = False
    rise_into_constraint: bool = False
    footing: int = TRACKS


class Voxels(NamedTuple):
    """The cells; every array is updated in place and has a rim of one cell on every side.

    `fill` f8[rows + 2, cols + 2, levels + 2], share of each cell that is soil; `incoming` f8, the sum of the list of
    incoming fill; `life` i2, updates that the cell's constraint has left, plus one (0: none, FOREVER: always);
    `active` i8[4], rows and columns [r0, r1) x [c0, c1) of these arrays that changed last (the rest is at rest);
    `touched` i8[4], the same since a reader last emptied it; `work` and `flags` are work space; `bottom` m is ymin,
    `dy` m the height of a level.
    """

    fill: np.ndarray
    incoming: np.ndarray
    life: np.ndarray
    active: np.ndarray
    touched: np.ndarray
    work: np.ndarray
    flags: np.ndarray
    bottom: float
    dy: float


def make_voxels(
    height: np.ndarray,
    grid: Grid,
    dy: float,
    bottom: float,
    levels: int,
    solid: np.ndarray | None = None,
    open_border: bool = False,
    grain: float = 0.0,
) -> Voxels:
    """Cells filled up to `height` [rows, cols] m from `bottom` m (ymin), in `levels` levels of `dy` m.

    A column lower than the bottom is empty; one higher than the top overfills its topmost cell. Solid columns are empty
    and shut. Beyond an open border the rim holds its neighbour's soil and takes what comes.
    """
    shape = (grid.rows + 2, grid.cols + 2, levels + 2)
    if levels < 1 or np.prod(shape, dtype=float) > MOST_VOXELS:
        raise ValueError(f"the grid has {' x '.join(map(str, shape))} cells; allowed: 1 level to {MOST_VOXELS} cells")
    stacked = np.maximum((np.asarray(height, np.float64) - bottom) / dy, 0.0)
    if grain > 0.0:
        stacked = np.round(stacked / grain) * grain
    stacked = np.pad(stacked, 1, mode="edge")
    life = np.full(shape, FOREVER, np.int16)
    inner = np.s_[:, :, 1:-1] if open_border else np.s_[1:-1, 1:-1, 1:-1]
    life[inner] = 0
    if solid is not None:
        life[1:-1, 1:-1][solid] = FOREVER
    fill = np.zeros(shape)
    fill[:, :, 1:-1] = np.clip(stacked[:, :, None] - np.arange(levels), 0.0, 1.0)
    fill[:, :, levels] += np.maximum(stacked - levels, 0.0)
    fill[life == FOREVER] = 0.0
    return Voxels(
        fill=fill,
        incoming=np.zeros(shape),
        life=life,
        active=np.array([1, grid.rows + 1, 1, grid.cols + 1]),
        touched=np.array([1, grid.rows + 1, 1, grid.cols + 1]),
        bottom=bottom,
        dy=dy,
        **voxel_work_space(shape),
    )


def voxel_work_space(shape: tuple[int, int, int]) -> dict[str, np.ndarray]:
    """The VOXEL_WORK_SPACE of a grid whose arrays have that shape."""
    run = shape[1] * shape[2]
    return {"work": np.zeros((WORK, 4, run)), "flags": np.zeros(run, np.uint8)}


def volume(voxels: Voxels, cell: float) -> float:
    """Soil over the bottom [m3]: fill and fill in transit, without the rim."""
    inner = np.s_[1:-1, 1:-1, 1:-1]
    return float(voxels.fill[inner].sum() + voxels.incoming[inner].sum()) * cell**2 * voxels.dy
