"""What has no exact answer, or is no settling: the finite blade, its speed and yaw, long drives, one step's time.

Each study is a list of settings, and a function that returns the columns of a setting's row: `value` [`unit`], and what
is measured of the usual ones.
"""

from collections.abc import Callable
from math import cos, radians, sin
from statistics import median
from time import thread_time
from typing import Any, NamedTuple

import numpy as np

from dirt_env.bench.accuracy.berms import eastward
from dirt_env.bench.accuracy.case import SLOPE, averages, site
from dirt_env.bench.accuracy.methods import exact_sum
from dirt_env.bench.accuracy.naive import rounded_push, wrapping_sweep
from dirt_env.bench.accuracy.piles import column, column_collapse, cone
from dirt_env.bench.accuracy.worlds import world_of
from dirt_env.sim.advance import advance, place
from dirt_env.sim.drag import drag, drive_along
from dirt_env.sim.params import Blade, Command, Machine, Soil

SOIL, BLADE, MACHINE = Soil(slope=SLOPE, tolerance=1e-3), Blade(), Machine()
# Cells by which a scene is moved on the grid: what depends on where a cell's border lies averages out.
SHIFTS = tuple(((0.07 + 0.618034 * k) % 1.0, (0.11 + 0.754878 * k) % 1.0) for k in range(8))
WAY = 10.0  # m that a heap is pushed
CUT = 0.3  # m
PERIOD = 0.5  # s


class Study(NamedTuple):
    """`rows`: (method, cells, setting) of each row; `measure(method, cells, setting)` gives its columns."""

    name: str
    title: str
    truth: str
    unit: str
    rows: tuple[tuple[str, int, str], ...]
    measure: Callable[[str, int, str], dict[str, Any]]


def _load_of_a_finite_blade(method: str, cells: int, setting: str) -> dict[str, Any]:
    """Soil ahead of a blade of 3 m that has cut 0.3 m deep for 10 m [m3], above the ground and within its width."""
    grid = site(cells)
    world = world_of(np.zeros((cells, cells)), grid)
    world.pending[:] = 0
    lines = eastward(8.0, 8.0 + WAY, grid, width=BLADE.width, edge=-CUT, height=4.0)
    before = exact_sum(world.height)
    sweeps = drag(world, grid, SOIL, lines)
    x, y = (np.arange(cells) + 0.5) * grid.cell, (np.arange(cells)[:, None] + 0.5) * grid.cell
    front = (x > 8.0 + WAY) & (np.abs(y - 16.0) < 0.5 * BLADE.width)
    load = float(np.maximum(world.height, 0.0)[front].sum()) * grid.cell**2
    return {"value": load, "sweeps": sweeps, "volume_error": (exact_sum(world.height) - before) / front.sum()}


def _pushed(method: str, cells: int, heading: float, stride: float, shift: tuple[float, float]):
    """Ground after a heap was pushed along `heading` [rad], `stride` cells a control step; share that lies ahead.

    The scene is turned about the map's middle and moved by `shift` cells, so that the grid lies differently under it.
    """
    grid = site(cells)
    ahead_x, ahead_y = cos(heading), sin(heading)
    middle = 16.0 + shift[0] * grid.cell, 16.0 + shift[1] * grid.cell
    begin = middle[0] - 7.0 * ahead_x, middle[1] - 7.0 * ahead_y  # of the blade
    heap = cone(middle[0] - 4.0 * ahead_x, middle[1] - 4.0 * ahead_y, 1.2)
    push = _pushed_by_machine if method == "blade" else _pushed_by_cells
    height = push(averages(heap, grid), grid, begin, heading, round(WAY / (stride * grid.cell)))
    ahead = averages(lambda x, y: (x - begin[0]) * ahead_x + (y - begin[1]) * ahead_y > WAY, grid)
    return height, float((height * ahead).sum() / height.sum())


def _pushed_by_machine(height: np.ndarray, grid, begin, heading: float, steps: int) -> np.ndarray:
    world = world_of(height, grid)
    x, y = begin[0] - BLADE.reach * cos(heading), begin[1] - BLADE.reach * sin(heading)
    place(world, grid, SOIL, BLADE, MACHINE, x, y, heading)
    world.machine[0].edge = 0.0
    world.pending[:] = 0
    command = Command(WAY / steps / PERIOD, 0.0, 0.0)
    for _ in range(steps):
        advance(world, grid, SOIL, BLADE, MACHINE, command, PERIOD)
    return world.height.astype(float)


def _pushed_by_cells(height: np.ndarray, grid, begin, heading: float, steps: int) -> np.ndarray:
    for k in range(1, steps + 1):
        way = k * WAY / steps
        pose = begin[0] + way * cos(heading), begin[1] + way * sin(heading), heading
        height = rounded_push(height, grid.cell, pose, BLADE.width, SLOPE * grid.cell)
    return height


def _speed(method: str, cells: int, setting: str) -> dict[str, Any]:
    """Mean share that lies ahead in the end, and how far the ground differs from that at half a cell a step."""
    shares, changes = [], []
    for shift in SHIFTS:
        reference, _ = _pushed(method, cells, 0.0, 0.5, shift)
        height, share = _pushed(method, cells, 0.0, float(setting.split()[0]), shift)
        shares.append(share)
        changes.append(np.abs(height - reference).sum() / reference.sum())
    return {"value": float(np.mean(shares)), "rel_l1": float(np.mean(changes)), "spread": float(np.std(shares))}


def _yaw(method: str, cells: int, setting: str) -> dict[str, Any]:
    """Mean share that lies ahead in the end, against that of a push along the cells."""
    heading = radians(float(setting.split()[0]))
    shares = [_pushed(method, cells, heading, 0.5, shift)[1] for shift in SHIFTS]
    straight = float(np.mean([_pushed(method, cells, 0.0, 0.5, shift)[1] for shift in SHIFTS]))
    share = float(np.mean(shares))
    return {"value": share, "rel_l1": abs(share - straight) / straight, "spread": float(np.std(shares))}


def _naive(method: str, cells: int, setting: str) -> dict[str, Any]:
    """How much of a column beside the border ends on the far side of the map; after how many sweeps all is lost."""
    grid = site(cells)
    threshold = SLOPE * grid.cell
    if setting.startswith("share"):
        height = averages(column(1.0, 16.0, 1.0, 8.0), grid)
        for _ in range(500):
            height = wrapping_sweep(height, threshold, 0.25)
        return {"value": float(height[:, cells // 2 :].sum() / height.sum())}
    height, sweeps = column_collapse(cells).start, 0
    while height.max() < 1e6:
        height, sweeps = wrapping_sweep(height, threshold), sweeps + 1
    return {"value": sweeps}


def _commands(count: int) -> np.ndarray:
    """Random commands that a machine carries out for some seconds each: f8[count, 3]."""
    generator = np.random.default_rng(1)
    pieces = -(-count // 8)
    low, high = (-2.0, -0.6, -0.15), (2.0, 0.6, 0.2)
    return np.repeat(generator.uniform(low, high, (pieces, 3)), 8, axis=0)[:count]


def _drive(method: str, cells: int, setting: str) -> dict[str, Any]:
    """Change of the exact sum of all heights over so many float32 steps of random driving and digging [m]."""
    grid = site(cells)
    generator = np.random.default_rng(0)
    world = world_of(generator.normal(0.0, 0.2, (cells, cells)), grid)
    soil = Soil(slope=SLOPE)
    place(world, grid, soil, BLADE, MACHINE, 16.0, 16.0, 0.0)
    before = exact_sum(world.height)
    steps = int(setting.split()[0])
    drive_along(world, grid, soil, BLADE, MACHINE, _commands(1), 0.2)  # compiles
    begin = thread_time()
    drive_along(world, grid, soil, BLADE, MACHINE, _commands(steps), 0.2)
    change = exact_sum(world.height) - before
    return {
        "value": change,
        "volume_error": change / float(np.abs(world.height).sum()),
        "cpu_ms": 1e3 * (thread_time() - begin),
    }


def _step(method: str, cells: int, setting: str) -> dict[str, Any]:
    """Time of a step of 0.1 s at 1 m/s [us], in a compiled loop, by a blade of 3 m that pushes what it can hold."""
    grid = site(cells)
    times = []
    for _ in range(15):
        world = world_of(np.full((cells, cells), 0.1), grid)
        place(world, grid, SOIL, BLADE, MACHINE, 4.0, 16.0, 0.0)
        drive_along(world, grid, SOIL, BLADE, MACHINE, np.tile((1.0, 0.0, -0.1), (100, 1)), 0.1)
        begin = thread_time()
        drive_along(world, grid, SOIL, BLADE, MACHINE, np.tile((1.0, 0.0, -0.1), (100, 1)), 0.1)
        times.append(thread_time() - begin)
    return {"value": 1e6 * median(times) / 100, "cpu_ms": 1e3 * median(times) / 100, "repeats": len(times)}


_SPEEDS, _YAWS = (0.05, 0.2, 0.5, 1, 2, 5, 20), (0, 10, 22.5, 30, 45, 60, 90)
_BLADES = ("blade", "rounded-blade")

STUDIES = {
    study.name: study
    for study in (
        Study(
            "blade-load", "Load ahead of a blade 3 m wide, cut 0.3 m", "none: it does not converge", "m3",
            tuple(("blade", cells, f"cells of {100 * 32 / cells:g} cm") for cells in (64, 128, 256, 512)),
            _load_of_a_finite_blade,
        ),
        Study(
            "blade-speed", "A heap pushed for 10 m at several speeds", "reference: 0.5 cells a step", "share ahead",
            tuple((method, 64, f"{speed:g} cells a step") for method in _BLADES for speed in _SPEEDS), _speed,
        ),
        Study(
            "blade-yaw", "A heap pushed for 10 m at several headings", "reference: along the cells", "share ahead",
            tuple((method, 64, f"{yaw:g} degrees") for method in _BLADES for yaw in _YAWS), _yaw,
        ),
        Study(
            "naive-rule", "4 neighbours with borders that wrap around", "nothing", "",
            (("wrap-around", 64, "share of a heap at the border that is across the map"),
             ("wrap-around", 64, "rate 0.5: sweeps until a collapsing column is a million metres high")), _naive,
        ),
        Study(
            "driving", "Volume over a long drive in float32", "exact: no change", "m",
            (("default", 64, "20000 steps"), ("default", 64, "1000000 steps")), _drive,
        ),
        Study(
            "world-step", "One step of the whole world, blade of 6 cells", "target: 10 us", "us",
            (("default", 64, "dt 0.1 s, 1 m/s"),), _step,
        ),
    )
}  # fmt: skip
