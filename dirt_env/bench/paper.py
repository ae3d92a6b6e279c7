"""`python -m dirt_env.bench.paper --out DIR`: the paper's cells against the height field, in figures and one picture.

A column that collapses against the exact cone; time of an update; slopes at rest and limit cycles. Needs matplotlib.
"""

import argparse
import json
import sys
from math import pi, radians, tan
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np

from dirt_env.sim.advance import settle
from dirt_env.sim.params import Grid, Soil
from dirt_env.sim.state import make_world
from dirt_env.sim.voxel import update, update_all
from dirt_env.sim.voxel_state import Rules, Voxels, make_voxels

SIDE, CELL, TOWER, HIGH = 64, 0.5, 7, 14.0  # cells, m, cells, m
REPEATS = 7
PATIENCE = 20000  # updates after which a ground counts as never at rest


def tower() -> np.ndarray:
    """A column of soil on flat ground, f8[64, 64] m."""
    ground = np.zeros((SIDE, SIDE))
    first = (SIDE - TOWER) // 2
    ground[first : first + TOWER, first : first + TOWER] = HIGH
    return ground


def cone(slope: float) -> np.ndarray:
    """What it collapses to: a cone of the same volume, V = pi H^3 / (3 slope^2), as cell averages."""
    volume = tower().sum() * CELL**2
    high = (3 * slope**2 * volume / pi) ** (1 / 3)
    fine = 8
    middle = ((SIDE - TOWER) // 2 + 0.5 * TOWER) * CELL
    x = (np.arange(SIDE * fine) + 0.5) * CELL / fine - middle
    exact = np.maximum(0.0, high - slope * np.hypot(x[:, None], x[None, :]))
    return exact.reshape(SIDE, fine, SIDE, fine).mean(axis=(1, 3))


def stacked(voxels: Voxels) -> np.ndarray:
    """Height of each column's soil [m]."""
    inner = np.s_[1:-1, 1:-1, 1:-1]
    return voxels.bottom + (voxels.fill[inner] + voxels.incoming[inner]).sum(axis=2) * voxels.dy


def seconds(run, repeats: int = REPEATS) -> float:
    """Median processor time of a call; `run()` makes a new one each time. The first, which compiles, does not count."""
    run()()
    times = []
    for _ in range(repeats):
        call = run()
        begin = process_time()
        call()
        times.append(process_time() - begin)
    return median(times)


def collapse() -> list[dict]:
    """Relative L1 error and time of both terrains for the column, repose 35 degrees."""
    soil, grid = Soil(), Grid(SIDE, SIDE, CELL)
    exact = cone(soil.slope)

    def field():
        world = make_world(tower(), grid)
        return lambda: (settle(world, grid, soil), world.height)[1]

    def cells(difference, rate):
        voxels = make_voxels(tower(), grid, CELL, 0.0, 30)
        return lambda: (update(voxels, Rules(difference, rate), PATIENCE), stacked(voxels))[1]

    rows = [("height field (default)", field)]
    rows += [
        (f"cells, required difference {share:g} x repose", lambda share=share: cells(share * soil.slope, 0.08))
        for share in (1.0, 0.75, 0.5)
    ]
    return [
        {
            "terrain": name,
            "error": float(np.abs(make()() - exact).sum() / exact.sum()),
            "ms": 1e3 * seconds(make),
        }
        for name, make in rows
    ]


def update_times() -> list[dict]:
    """ns for each cell of a 64 x 64 x 32 grid and update: every cell; what is active of a local heap; nothing."""
    grid, rules = Grid(SIDE, SIDE, CELL), Rules()
    x = np.arange(SIDE) - 32.0
    ground = np.maximum(8.0, 20.0 - 0.6 * np.hypot(x[:, None], x[None, :]))

    def all_cells():
        voxels = make_voxels(ground, grid, 1.0, 0.0, 32)
        update(voxels, rules, PATIENCE)
        return lambda: update_all(voxels, rules, 100)

    def part():
        voxels = make_voxels(ground, grid, 1.0, 0.0, 32)
        update(voxels, rules, PATIENCE)
        voxels.life[20:26, 30, 22:24] = 101  # a blade's constraints, for as long as they last
        voxels.active[:] = 20, 26, 30, 31
        return lambda: update(voxels, rules, 100)

    cells = SIDE * SIDE * 32 * 100
    names = ("every cell of a settled grid", "a blade of 6 columns on it")
    makers = zip(names, (all_cells, part), strict=True)
    return [{"what": name, "ns": 1e9 * seconds(make) / cells} for name, make in makers]


def slopes() -> list[dict]:
    """The steepest face of the collapsed column for required differences r, in units of dy / dx."""
    found = []
    for difference in np.linspace(0.05, 0.95, 10):
        voxels = make_voxels(tower(), Grid(SIDE, SIDE, CELL), CELL, 0.0, 30)
        done = update(voxels, Rules(float(difference)), PATIENCE)
        pile = stacked(voxels) / CELL
        steepest = max(np.abs(np.diff(pile, axis=axis)).max() for axis in (0, 1))
        found.append({"difference": float(difference), "steepest": float(steepest), "at_rest": done < PATIENCE})
    return found


def limit_cycles() -> list[dict]:
    """Whether a rough ground ever comes to rest, for rates in units of the required difference."""
    found = []
    for difference in (0.01, 0.02, 0.05):
        for ratio in (1, 2, 3, 4, 5, 6, 8):
            rough = np.random.default_rng(1).uniform(0.4, 1.0, (24, 24))
            voxels = make_voxels(rough, Grid(24, 24, 1.0), 1.0, 0.0, 2)
            done = update(voxels, Rules(difference, ratio * difference), PATIENCE)
            found.append({"difference": difference, "ratio": ratio, "at_rest": done < PATIENCE})
    return found


def draw(results: dict, path: Path) -> None:
    """The slopes at rest and the limit cycles as one picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 4), layout="constrained")
    r = np.array([row["difference"] for row in results["slopes"]])
    left.plot(r, r, "k-", lw=1, label="r")
    left.plot(r, 2 * r, "k--", lw=1, label="2 r")
    left.plot(r, [row["steepest"] for row in results["slopes"]], "o", color="#c4581b", label="steepest face at rest")
    left.plot(r, np.full_like(r, tan(radians(35.0))), ":", color="gray", label="repose 35°")
    left.set(xlabel="required difference r", ylabel="slope [dy/dx]", title="Slopes of a collapsed column")
    left.legend()
    for at_rest, marker, label in ((True, "o", "comes to rest"), (False, "x", f"not in {PATIENCE} updates")):
        rows = [row for row in results["limit_cycles"] if row["at_rest"] == at_rest]
        places = [row["ratio"] for row in rows], [row["difference"] for row in rows]
        right.plot(*places, marker, color="#1b6ec4", ms=8, label=label)
    right.set(xlabel="transfer rate / r", ylabel="required difference r", title="Limit cycles on rough ground")
    right.legend(loc="center")
    figure.savefig(path, dpi=110)


def table(results: dict) -> str:
    """The figures as Markdown."""
    lines = ["| column collapse, 64 x 64 | relative L1 error | time, ms |", "|---|---|---|"]
    lines += [f"| {row['terrain']} | {100 * row['error']:.2f} % | {row['ms']:.1f} |" for row in results["collapse"]]
    lines += ["", "| one update of 64 x 64 x 32 cells | ns a cell |", "|---|---|"]
    lines += [f"| {row['what']} | {row['ns']:.3f} |" for row in results["updates"]]
    return "\n".join(lines)


def main() -> None:
    """Measure, write `paper.json` and `paper.png`, and print the tables."""
    parser = argparse.ArgumentParser("python -m dirt_env.bench.paper", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for what is written")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    results = {"collapse": collapse(), "updates": update_times(), "slopes": slopes(), "limit_cycles": limit_cycles()}
    (out / "paper.json").write_text(json.dumps(results, indent=1) + "\n")
    draw(results, out / "paper.png")
    sys.stdout.write(table(results) + "\n")


if __name__ == "__main__":
    main()
