"""`python -m dirt_env.bench.paper --out DIR`: the paper's cells against the height field, in figures and one picture.

A column that collapses against the exact cone; time of an update; slopes at rest; limit cycles; adaptive push in the
paper's scenes. Needs matplotlib.
"""

import sys
from math import pi, radians, tan
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np

from dirt_env.bench.document import report
from dirt_env.env import DirtPushEnv
from dirt_env.policy import load_policy
from dirt_env.rollout import play
from dirt_env.sim.advance import settle
from dirt_env.sim.params import Grid, Soil
from dirt_env.sim.state import make_world
from dirt_env.sim.voxel import update, update_all
from dirt_env.sim.voxel_state import Rules, Voxels, make_voxels

SIDE, CELL, TOWER, HIGH = 64, 0.5, 7, 14.0  # cells, m, cells, m
REPEATS = 7
SCENES = {"heap": {"level": 0}, "several_starts": {}, "several_goals": {}, "uneven": {}, "dig": {}}
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

    def other_reading():
        voxels = make_voxels(ground, grid, 1.0, 0.0, 32)
        update(voxels, rules, PATIENCE)
        readings = rules._replace(rise_into_constraint=True)

        def run():
            for _ in range(100):
                voxels.active[:] = 1, SIDE + 1, 1, SIDE + 1  # at rest it would stop
                update(voxels, readings, 1)

        return run

    cells = SIDE * SIDE * 32 * 100
    names = ("every cell of a settled grid", "a blade of 6 columns on it", "every cell, with another reading")
    makers = zip(names, (all_cells, part, other_reading), strict=True)
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
    """Whether ground of about equally full cells comes to rest, for rates in units of the required difference."""
    found = []
    for difference in (0.01, 0.03):
        for fill in (0.1, 0.15, 0.25, 0.4, 0.6, 0.8, 0.95):
            for share in (0.6, 0.75, 0.9, 1.05, 1.2, 1.4, 1.7, 2.0):  # of difference / fill
                ratio = share / fill
                if ratio * difference > 1.0:
                    continue
                rough = np.random.default_rng(1).uniform(fill - 0.05, fill + 0.05, (16, 16))
                voxels = make_voxels(rough, Grid(16, 16, 1.0), 1.0, 0.0, 2)
                done = update(voxels, Rules(difference, ratio * difference), PATIENCE)
                found.append({"difference": difference, "fill": fill, "ratio": ratio, "at_rest": done < PATIENCE})
    return found


def scenes() -> list[dict]:
    """Adaptive push on both terrains, and with the other readings of the agent's height: share in the goal, seconds."""
    terrains = {"height field": "heightfield", "cells": "voxel"}
    terrains |= {f'cells, footing "{name}"': {"kind": "voxel", "footing": name} for name in ("heap", "point")}
    rows = []
    for scene, options in SCENES.items():
        row: dict = {"scene": scene}
        for name, terrain in terrains.items():
            env = DirtPushEnv(scene=scene, terrain=terrain, observation={"map": True}, **options)
            figures = play(env, load_policy("adaptive_push", env.config), 0, env.config.steps)
            row[name] = {key: figures[key] for key in ("share_in_goal", "time_s", "is_success")}
        rows.append(row)
    return rows


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
    for at_rest, marker, color, label in (
        (True, "o", "#1b6ec4", "comes to rest"),
        (False, "x", "#c4581b", f"not in {PATIENCE} updates"),
    ):
        rows = [row for row in results["limit_cycles"] if row["at_rest"] == at_rest]
        right.plot([row["fill"] for row in rows], [row["ratio"] for row in rows], marker, color=color, label=label)
    fill = np.linspace(0.08, 1.0, 100)
    right.plot(fill, 1.0 / fill, "k-", lw=1, label="rate = r / fill")
    right.axhline(4.0, color="gray", ls=":", label="rate = 4 r")
    right.set(xlabel="mean fill of the cells", ylabel="transfer rate / r", title="Limit cycles", yscale="log")
    right.legend()
    figure.savefig(path, dpi=110)


def table(results: dict) -> str:
    """The figures as Markdown."""
    names = [name for name in results["scenes"][0] if name != "scene"]
    lines = ["| column collapse, 64 x 64 | relative L1 error | time, ms |", "|---|---|---|"]
    lines += [f"| {row['terrain']} | {100 * row['error']:.2f} % | {row['ms']:.1f} |" for row in results["collapse"]]
    lines += ["", "| one update of 64 x 64 x 32 cells | ns a cell of the grid |", "|---|---|"]
    lines += [f"| {row['what']} | {row['ns']:.3f} |" for row in results["updates"]]
    lines += ["", f"| adaptive push | {' | '.join(names)} |", "|---|" + "---|" * len(names)]
    lines += [f"| {row['scene']} | {' | '.join(outcome(row[name]) for name in names)} |" for row in results["scenes"]]
    return "\n".join(lines)


def outcome(figures: dict) -> str:
    """Share in the goal and time of an episode, as words."""
    share, time = 100 * figures["share_in_goal"], figures["time_s"]
    return f"{share:.1f} %, {time:.0f} s" if figures["is_success"] else f"{share:.1f} % after {time:.0f} s: not done"


def measure() -> dict:
    """All results by name."""
    results = {"collapse": collapse(), "updates": update_times(), "slopes": slopes(), "limit_cycles": limit_cycles()}
    return results | {"scenes": scenes()}


def main() -> int:
    """Measure, write `paper.json` and `paper.png`, and print the tables."""
    return report("paper", __doc__, measure, draw, table)


if __name__ == "__main__":
    sys.exit(main())
