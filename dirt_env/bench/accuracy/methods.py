"""What is put to the test: each method prepares a case, runs it, and shows the ground it ended with."""

from collections.abc import Callable
from functools import partial
from math import ceil, floor, fsum
from typing import NamedTuple

import numpy as np

from dirt_env.bench.accuracy.case import Case
from dirt_env.bench.accuracy.pouring import portions
from dirt_env.bench.accuracy.worlds import world_of
from dirt_env.sim.advance import METHODS as SETTLING
from dirt_env.sim.advance import settle
from dirt_env.sim.drag import drag
from dirt_env.sim.heap import dump
from dirt_env.sim.neighbour_rules import relax_by_neighbours, work_shape
from dirt_env.sim.params import Soil
from dirt_env.sim.slump import settle_window
from dirt_env.sim.voxel import update
from dirt_env.sim.voxel_state import GRAIN, Rules, make_voxels

PRECISIONS = {"f4": np.float32, "f8": np.float64}
ENDLESS = 10**9  # sweeps
UPDATES = 20000  # of the paper's cells, after which they count as never at rest
TITLES = {"super": "super-steps"}  # of the methods of `settle`, where the name does not do


class Settings(NamedTuple):
    """`tolerance`: share of repose by which settled ground may be steeper; `cap`: most sweeps, None for no bound."""

    tolerance: float | None = 1e-3
    cap: int | None = None
    precision: str = "f4"


class Trial(NamedTuple):
    """One run: `run()` is what is timed and returns how many sweeps it took; then `height()` f8[rows, cols] m.

    `given` is the soil that it began with and was given, and `gone()` what left over an open border [m of one cell].
    """

    run: Callable[[], int]
    height: Callable[[], np.ndarray]
    given: float
    gone: Callable[[], float] = lambda: 0.0


class Method(NamedTuple):
    """`prepare(case, settings)` makes a Trial. `kinds`: what it can do; `knobs`: settings that it listens to.

    `cells`: the largest resolution that it is run at; `explicit`: its time grows with the fourth power of that.
    """

    name: str
    title: str
    kinds: tuple[str, ...]
    prepare: Callable[[Case, Settings], Trial]
    knobs: tuple[str, ...] = ("tolerance", "cap", "precision")
    cells: int = 1024
    explicit: bool = True


def exact_sum(height: np.ndarray) -> float:
    """Sum of heights without any rounding but the last."""
    return fsum(np.asarray(height, np.float64).ravel())


def _soil(case: Case, settings: Settings) -> Soil:
    sweeps = settings.cap or case.sweeps or Soil().max_sweeps
    return Soil(slope=case.slope, tolerance=settings.tolerance or 0.0, max_sweeps=sweeps)


def _sweeping(world, grid, soil: Soil, bounded: bool) -> int:
    """Explicit sweeps of what is pending: once over if they are `bounded`, or else until all has settled."""
    sweeps = settle_window(world, grid, soil)
    while not bounded and world.pending[1] > world.pending[0]:
        sweeps += settle_window(world, grid, soil)
    return sweeps


def explicit(case: Case, settings: Settings) -> Trial:
    """Explicit sweeps of the height field, in its active window; pours a portion, and lets it settle."""
    grid, soil = case.grid, _soil(case, settings)
    world = world_of(case.start, grid, PRECISIONS[settings.precision], case.solid, case.outside)
    given = portions(case, world.quantum)
    before = exact_sum(world.height)
    bounded = settings.cap is not None or case.sweeps is not None

    def run() -> int:
        sweeps = 0 if given else _sweeping(world, grid, soil, bounded)
        for rows, cols, amounts in given:
            world.height[rows, cols] += amounts.astype(world.height.dtype)
            world.pending[:] = rows.start, rows.stop, cols.start, cols.stop
            sweeps += _sweeping(world, grid, soil, bounded)
        return sweeps

    poured = fsum(exact_sum(amounts) for *_, amounts in given)
    return Trial(run, lambda: world.height.astype(float), before + poured, lambda: _lost(world, grid))


def _lost(world, grid) -> float:
    return float(world.tally[0].lost) / grid.cell**2


def settling(method: str, case: Case, settings: Settings) -> Trial:
    """`settle` by that method of its, the height field's."""
    grid, soil = case.grid, _soil(case, settings)
    world = world_of(case.start, grid, PRECISIONS[settings.precision], case.solid, case.outside)
    given = portions(case, world.quantum)
    for rows, cols, amounts in given:
        world.height[rows, cols] += amounts.astype(world.height.dtype)
    before = exact_sum(world.height)
    return Trial(
        lambda: settle(world, grid, soil, method),
        lambda: world.height.astype(float),
        before,
        lambda: _lost(world, grid),
    )


def water_filling(case: Case, settings: Settings) -> Trial:
    """`dump`: each portion at once, h = max(h0, c - k dist)."""
    grid, soil = case.grid, _soil(case, settings)
    world = world_of(case.start, grid, PRECISIONS[settings.precision], case.solid)
    grains = sum(round(volume / grid.cell**2 / world.quantum) for *_, volume in case.pours)
    before = exact_sum(world.height)

    def run() -> int:
        for x, y, volume in case.pours:
            dump(world, grid, soil, x, y, volume)
        return 0

    return Trial(run, lambda: world.height.astype(float), before + grains * world.quantum)


def blade(case: Case, settings: Settings) -> Trial:
    """The default's blade, moved along the case's lines."""
    grid, soil = case.grid, _soil(case, settings)
    world = world_of(case.start, grid, PRECISIONS[settings.precision])
    world.pending[:] = 0
    before = exact_sum(world.height)
    return Trial(lambda: drag(world, grid, soil, case.lines), lambda: world.height.astype(float), before)


def _neighbours(case: Case, settings: Settings, eight: bool) -> Trial:
    grid, dtype = case.grid, PRECISIONS[settings.precision]
    start, solid, sink = case.start, case.solid, None
    if case.outside is not None:  # a row of cells more on each side, whose level is given
        start = np.pad(start, 1, constant_values=case.outside)
        sink = np.pad(np.zeros(case.start.shape, bool), 1, constant_values=True)
        solid = None if solid is None else np.pad(solid, 1)
    height = start.astype(dtype)
    work = np.zeros(work_shape(height), dtype)
    inner = np.s_[1:-1, 1:-1] if sink is not None else np.s_[:, :]
    given = portions(case, None)
    taken = [0.0]
    most = settings.cap or case.sweeps or ENDLESS
    before = exact_sum(height[inner])

    def relax(*box: int) -> int:
        sweeps, gone = relax_by_neighbours(
            height, solid, sink, grid.cell, case.slope, settings.tolerance or 0.0, eight, most, np.array(box), work
        )
        taken[0] += gone
        return sweeps

    def run() -> int:
        sweeps = 0 if given else relax(0, height.shape[0], 0, height.shape[1])
        for rows, cols, amounts in given:
            height[rows, cols] += amounts.astype(dtype)
            sweeps += relax(rows.start, rows.stop, cols.start, cols.stop)
        return sweeps

    poured = fsum(exact_sum(amounts) for *_, amounts in given)
    return Trial(run, lambda: height[inner].astype(float), before + poured, lambda: taken[0])


def four_neighbours(case: Case, settings: Settings) -> Trial:
    """Each cell looks at its 4 neighbours, one by one."""
    return _neighbours(case, settings, False)


def eight_neighbours(case: Case, settings: Settings) -> Trial:
    """Each cell looks at its 8 neighbours, one by one."""
    return _neighbours(case, settings, True)


def paper(case: Case, settings: Settings) -> Trial:
    """Algorithms 1 and 2 on cells as high as they are wide, reqDiff = the slope of repose; one portion at once."""
    grid = case.grid
    start = case.start.copy()
    for rows, cols, amounts in portions(case, None):
        start[rows, cols] += amounts
    bottom = floor(start.min() / grid.cell) * grid.cell
    levels = ceil((start.max() - bottom) / grid.cell) + 1
    voxels = make_voxels(start, grid, grid.cell, bottom, levels, solid=case.solid, grain=GRAIN)
    rules = Rules(difference=case.slope, grain=GRAIN)
    inner = np.s_[1:-1, 1:-1, 1:-1]

    def height() -> np.ndarray:
        return bottom + (voxels.fill[inner] + voxels.incoming[inner]).sum(axis=2) * voxels.dy

    before = exact_sum(height())
    return Trial(lambda: update(voxels, rules, settings.cap or UPDATES), height, before)


def _settling(name: str, method: str, title: str) -> Method:
    kinds = ("settle", "pour once") if method == "projection" else ("settle", "drain", "pour once")
    return Method(name, title, kinds, partial(settling, method), ("tolerance", "precision"), explicit=False)


_SWEEPERS = ("settle", "drain", "pour once", "pour", "sweep")
METHODS = {
    method.name: method
    for method in (
        Method("paper", "the paper's cells", ("settle", "pour once"), paper, ("cap",), 64),
        Method("neighbours-4", "4 neighbours", _SWEEPERS, four_neighbours, cells=128),
        Method("neighbours-8", "8 neighbours", _SWEEPERS[:-1], eight_neighbours, cells=128),
        Method("explicit", "explicit sweeps", (*_SWEEPERS, "flux"), explicit),
        _settling("default", "auto", "default (settle)"),
        *(_settling(name, name, TITLES.get(name, name)) for name in SETTLING if name not in ("auto", "explicit")),
        Method("water-filling", "dump", ("pour once", "pour"), water_filling, ("precision",), explicit=False),
        Method("blade", "default (blade)", ("drag",), blade, ("tolerance", "precision")),
    )
}
