"""`python -m dirt_env.bench.draft --out DIR`: draft and load of the blade beside published numbers and rules.

Passive pressure on an upright blade against tables by curved failure planes; draft against depth, of the equation and
of a machine that cuts; load ahead of the blade against its width. Needs matplotlib.
"""

import sys
from math import pi, radians
from pathlib import Path

import numpy as np

from dirt_env.bench.document import markdown, report
from dirt_env.config import SceneConfig, load
from dirt_env.sim.advance import advance, place
from dirt_env.sim.draft import draft_force, earthmoving_factors
from dirt_env.sim.params import Command
from dirt_env.sim.state import World, make_world
from dirt_env.sim.traction import cut_of

# Coefficients of passive pressure of cohesionless soil on an upright wall with level ground, from failure planes that
# are logarithmic spirals: A. Caquot, J. Kerisel, Tables for the calculation of passive pressure, 1948, as given in
# B. Look, Handbook of Geotechnical Investigation and Design Tables, table 19.13. (internal friction [degrees], wall
# friction as share of it): coefficient
SPIRALS = {
    (20, 0.0): 2.0, (20, 1 / 3): 2.3, (20, 1 / 2): 2.6,
    (25, 0.0): 2.5, (25, 1 / 3): 3.0, (25, 1 / 2): 3.4,
    (30, 0.0): 3.0, (30, 1 / 3): 4.0, (30, 1 / 2): 4.5,
    (35, 0.0): 3.7, (35, 1 / 3): 5.4, (35, 1 / 2): 6.0,
    (40, 0.0): 4.6, (40, 1 / 3): 7.5, (40, 1 / 2): 9.0,
}  # fmt: skip
SOILS = ("dry_sand", "gravel", "loam", "clay", "snow")
DEPTHS = np.linspace(0.0, 0.3, 31)  # m
CUTS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3)  # m, of the machine
WIDTHS = (2.0, 3.0, 4.0, 5.0, 6.0)  # m
SPEED, PERIOD = 1.0, 0.5  # m/s, s
RUN = 24.0  # m, of a blade that fills up
DIG = 0.1  # m
RATED, FIELD = 0.8, 0.375  # SAE J1265, ISO 9246: W H^2; Caterpillar, FM 5-434: H W L of a pile
LEAST = 0.1  # of a pile's height; what is lower is not seen as pile by whoever measures it


def passive_pressure() -> list[dict]:
    """Twice N_weight of an upright blade beside the coefficients of curved failure planes."""
    rows = []
    for (friction, share), curved in SPIRALS.items():
        plane = 2.0 * earthmoving_factors(0.5 * pi, radians(friction), radians(share * friction)).weight
        rows.append({"friction": friction, "share": share, "curved": curved, "plane": plane})
    return rows


def site(soil: str, width: float = 3.0, cell: float = 0.5, cut: float = 0.3) -> SceneConfig:
    """A level site for a heavy machine with a blade of that `width` [m] on a soil by name."""
    return load(
        level=0,
        site={"size": [48.0, 24.0], "cell": cell},
        soil={"preset": soil},
        blade={"width": width},
        machine={"cut": cut},
        traction={"mass": 1e5, "power": 1e9, "rolling_resistance": 0.0},
    )


def begin(config: SceneConfig) -> World:
    """Its level ground, with the machine at the western end, heading east."""
    grid = config.grid
    world = make_world(np.zeros((grid.rows, grid.cols)), grid)
    place(world, grid, config.soil, config.blade, config.machine, 6.0, 0.5 * config.site.size[1], 0.0)
    return world


def drive(world: World, config: SceneConfig, speed: float, edge: float, seconds: float, traction: bool = True) -> None:
    """Drive with the edge at that height [m] for so long [s]."""
    constants = config.grid, config.soil, config.blade, config.machine
    for _ in range(max(round(seconds / PERIOD), 1)):
        advance(world, *constants, Command(speed, 0.0, edge), PERIOD, config.pull if traction else None)


def draft_against_depth() -> list[dict]:
    """Draft without load [kN] of the equation, and of machines as they begin to cut."""
    rows = []
    for soil in SOILS:
        config = site(soil)
        cut = cut_of(config.soil, config.strength, config.blade, config.traction.rake)
        measured = []
        for depth in CUTS:
            world = begin(config)
            drive(world, config, 0.0, -depth, 3.0)
            drive(world, config, 0.01, -depth, PERIOD)
            measured.append(1e-3 * float(world.tally[0].draft))
        equation = [1e-3 * draft_force(depth, 0.0, cut) for depth in DEPTHS]
        rows.append({"soil": soil, "equation_kn": equation, "machine_kn": measured})
    return rows


def pile_of(height: np.ndarray, cell: float) -> dict:
    """Volume, height, width across and length along the way of a pile on level ground, and the field's estimate."""
    top = float(height.max())
    seen = height > LEAST * top
    extent = [float(seen.any(axis=axis).sum()) * cell for axis in (1, 0)]
    return {
        "volume": float(height[seen].sum()) * cell**2,
        "height": top,
        "width": extent[0],
        "length": extent[1],
        "field": FIELD * top * extent[0] * extent[1],
    }


def load_against_width(cell: float = 0.5) -> list[dict]:
    """Load of a blade that has cut itself full and carried on at grade, and the pile that it leaves behind."""
    rows = []
    for width in WIDTHS:
        config = site("dry_sand", width, cell)
        world = begin(config)
        drive(world, config, 0.0, -DIG, 3.0)
        drive(world, config, SPEED, -DIG, RUN)
        full = float(world.machine[0].load)
        drive(world, config, SPEED, 0.0, 4.0)
        front = world.machine[0].x + config.blade.reach
        left, right = (0.5 * config.site.size[1] + sign * (0.5 * width + 1.5) for sign in (-1.0, 1.0))
        drive(world, config, 0.0, config.machine.lift, 4.0)
        drive(world, config, -SPEED, config.machine.lift, 4.0)
        r0, r1, c0 = int(left / cell), int(right / cell), int(front / cell) - 4
        pile = pile_of(world.height[r0:r1, c0:].astype(float), cell)
        rated = RATED * width * config.blade.height**2
        rows.append({"width": width, "cell": cell, "full": full, "rated": rated, "pile": pile})
    return rows


def scales() -> list[dict]:
    """How draft grows with the size of a blade that cuts 30 % of its height, in soils without and with cohesion."""
    rows = []
    for cohesion in (0.0, 1e3, 1e4, 1e5):
        config = site("dry_sand")
        forces = []
        for scale in (1.0, 1 / 8):
            blade = config.blade._replace(width=3.0 * scale, height=scale)
            cut = cut_of(config.soil, config.strength._replace(cohesion=cohesion), blade, config.traction.rake)
            forces.append(draft_force(0.3 * scale, RATED * blade.width * blade.height**2, cut))
        rows.append({"cohesion": cohesion, "exponent": float(np.log(forces[0] / forces[1]) / np.log(8.0))})
    return rows


def draw(results: dict, path: Path) -> None:
    """Pressure, draft and load as one picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (first, middle, last) = pyplot.subplots(1, 3, figsize=(14, 4.4), layout="constrained")
    _draw_pressure(results["passive_pressure"], first)
    for row, color in zip(results["draft"], ("C0", "C7", "C2", "C1", "C9"), strict=True):
        middle.plot(DEPTHS, row["equation_kn"], color=color, label=row["soil"])
        middle.plot(CUTS, row["machine_kn"], "o", color=color, ms=4)
    middle.set(xlabel="depth of the cut [m]", ylabel="draft without load [kN]", title="Blade 3 m wide, rake 60°")
    middle.legend(title="line: equation; dots: machine")
    widths = [row["width"] for row in results["load"]]
    last.plot(widths, [row["rated"] for row in results["load"]], "k-", lw=1, label="rating 0.8 W H² (SAE J1265)")
    last.plot(widths, [row["full"] for row in results["load"]], "o", color="C1", label="ahead of the blade, cutting")
    piles = [row["pile"]["volume"] for row in results["load"]]
    last.plot(widths, piles, "^", color="C2", label="pile left, 4 m on at grade")
    field = [row["pile"]["field"] for row in results["load"]]
    last.plot(widths, field, "x", color="C2", label="0.375 H W L of that pile")
    last.set(xlabel="width of the blade [m]", ylabel="loose soil [m³]", title="Load, blade 1 m high, dry sand")
    last.set_ylim(bottom=0.0)
    last.legend()
    figure.savefig(path, dpi=110)


def _draw_pressure(rows: list[dict], axes) -> None:
    for share, color in ((0.0, "C0"), (1 / 3, "C1"), (1 / 2, "C2")):
        friction = np.linspace(15, 42, 50)
        factors = [2 * earthmoving_factors(pi / 2, radians(f), radians(share * f)).weight for f in friction]
        axes.plot(friction, factors, color=color, label=f"wall friction {share:.2g} φ")
        points = [row for row in rows if row["share"] == share]
        axes.plot([row["friction"] for row in points], [row["curved"] for row in points], "o", color=color)
    title = "Upright blade: wedge (lines), Caquot-Kérisel (dots)"
    axes.set(xlabel="internal friction φ [degrees]", ylabel="2 N of the weight [-]", title=title)
    axes.legend()


def tables(results: dict) -> str:
    """The figures as Markdown."""
    pressure = [["internal friction", "wall friction", "Caquot-Kérisel", "2 N, plane wedge", "deviation"]]
    for row in results["passive_pressure"]:
        shares = f"{row['share']:.2g} φ", f"{row['curved']:g}", f"{row['plane']:.2f}"
        pressure.append([f"{row['friction']}°", *shares, _off(row["plane"], row["curved"])])
    draft = [["soil", *(f"{depth:g} m" for depth in CUTS)]]
    for row in results["draft"]:
        exact = np.interp(CUTS, DEPTHS, row["equation_kn"])
        cells = zip(row["machine_kn"], exact, strict=True)
        draft.append([row["soil"], *(f"{found:.2f} kN ({_off(found, wanted)})" for found, wanted in cells)])
    load = [["width", "rating", "ahead of the blade", "pile left", "H x W x L of the pile", "0.375 H W L", "deviation"]]
    for row in results["load"]:
        pile = row["pile"]
        sizes = f"{pile['height']:.2f} x {pile['width']:.1f} x {pile['length']:.1f} m"
        share = f"{row['full']:.2f} m3 ({row['full'] / row['rated'] - 1:+.0%})"
        off = f"{pile['field'] / pile['volume'] - 1:+.0%}"
        pile_cells = [f"{pile['volume']:.2f} m3", sizes, f"{pile['field']:.2f} m3", off]
        load.append([f"{row['width']:g} m", f"{row['rated']:.2f} m3", share, *pile_cells])
    scale = [["cohesion", "exponent of draft over scale"]]
    scale += [[f"{row['cohesion'] / 1e3:g} kPa", f"{row['exponent']:.2f}"] for row in results["scales"]]
    return "\n\n".join(markdown(lines) for lines in (pressure, draft, load, scale))


def _off(found: float, wanted: float) -> str:
    """By how much one number is more than the other, in words."""
    return f"{found / wanted - 1:+z.1%}"


def measure() -> dict:
    """All results by name."""
    results = {"passive_pressure": passive_pressure(), "draft": draft_against_depth()}
    return results | {"load": load_against_width(), "scales": scales()}


def main() -> int:
    """Work all out, write `draft.json` and `draft.png`, and print the tables."""
    return report("draft", __doc__, measure, draw, tables)


if __name__ == "__main__":
    sys.exit(main())
