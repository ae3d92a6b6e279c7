"""All problems, by name."""

from dirt_env.bench.accuracy import berms, piles, smooth, tables, trenches
from dirt_env.bench.accuracy.case import Problem

_EXACT, _NAMED = "exact", "reference: "
_SMALL = (32, 64, 128)  # half the resolution of a reference that is computed, at most
_PILES = (32, 64, 128, 256)
_STRIPS = (32, 64, 128, 256, 512)

PROBLEMS = {
    problem.name: problem
    for problem in (
        Problem("linear-mode", "Wave without friction, 200 sweeps", "sweep", _EXACT, smooth.linear_mode, _STRIPS),
        Problem("manufactured", "Flux of a smooth ground", "flux", _EXACT, smooth.manufactured, _STRIPS),
        Problem("dump", "Dump on level ground", "pour once", _EXACT, piles.dump),
        Problem("dump-on-a-slope", "Dump on a slope of 0.4", "pour", _EXACT, piles.dump_on_a_slope, _PILES),
        Problem("column-collapse", "Column that collapses to a cone", "settle", _EXACT, piles.column_collapse),
        Problem("frustum", "Cylinder that collapses to a frustum", "settle", _EXACT, piles.frustum, _PILES),
        Problem("cone-at-a-wall", "Column at a wall", "settle", _EXACT, piles.cone_at_a_wall, _PILES),
        Problem("cone-in-a-corner", "Column in a corner", "settle", _EXACT, piles.cone_in_a_corner, _PILES),
        Problem("wedge", "Strip that collapses to a wedge", "settle", _EXACT, piles.wedge, _STRIPS),
        Problem("wedge-at-a-blade", "Strip against a blade", "drag", _EXACT, berms.wedge_at_a_blade, _STRIPS),
        Problem("berm", "Layer dozed in a channel, to a whole cell", "drag", _EXACT, berms.berm_at_a_cell, _STRIPS),
        Problem("berm-between", "Layer dozed, half a cell more", "drag", _EXACT, berms.berm_between_cells, _STRIPS),
        Problem("trench-wide", "Wide trench", "settle", _EXACT, trenches.wide_trench, _STRIPS),
        Problem("trench-narrow", "Narrow trench", "settle", _EXACT, trenches.narrow_trench, _STRIPS),
        Problem(
            "trench-spoil", "Trench with spoil, slow relaxation", "settle",
            f"{_NAMED}explicit sweeps in float64 to 1e-5 of repose, {trenches.FINEST} cells",
            trenches.trench_slow, _SMALL,
        ),
        Problem(
            "trench-spoil-at-once", "Trench with spoil, one projection", "settle",
            f"{_NAMED}projection in float64, {trenches.ITERATIONS} iterations, {trenches.FINEST} cells",
            trenches.trench_at_once, _SMALL,
        ),
        Problem("table", "Table with obstacles, open border", "drain", _EXACT, tables.table, (32, 64, 128), 64),
        Problem(
            "several-sources", "Three sources that meet", "pour",
            f"{_NAMED}equations of Aronsson, Evans and Wu, 200 steps", piles.several_sources, _PILES,
        ),
        Problem(
            "scattered-dumps", "100 scattered dumps", "pour",
            f"{_NAMED}water-filling by bisection in float64, cells of a quarter of the size",
            piles.scattered_dumps, _PILES,
        ),
    )
}  # fmt: skip
