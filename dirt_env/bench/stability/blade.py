"""The blade at any speed, yaw, direction and depth."""

from math import pi, radians, sqrt

import numpy as np

from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import (
    BLADE,
    CELL,
    SLOPE,
    SOIL,
    Driven,
    at_rest,
    line_at,
    straight,
    sweep_blade,
    total,
)
from dirt_env.sim.blade import blade_frame
from dirt_env.sim.params import Machine

FINE = SOIL._replace(tolerance=1e-3)
TALL = 100.0  # m, a blade that nothing goes over
RAPID = Machine(speed=1e6, edge_rate=1e6)


def _berm(distance, stride, depth=0.1):
    """Heights after a blade as wide as a channel has pushed a layer, and the exact ones as cell averages."""
    world, grid = at_rest(4, 64, depth)
    sweep_blade(world, grid, straight(0.0, 1.0, 0.0, distance, stride, width=100.0, height=TALL), FINE)
    x = (np.arange(grid.cols * 64) + 0.5) * CELL / 64
    pile = depth + np.maximum(sqrt(2 * SLOPE * depth * distance) - SLOPE * (x - distance), 0)
    return world, np.where(x < distance, 0.0, pile).reshape(grid.cols, 64).mean(1)


@case("a layer dozed 20 m in a channel: berm sqrt(2 k t D), within 0.5 % of what was moved; nothing left behind")
def the_berm_at_whole_cells():
    world, exact = _berm(20.0, 0.25)
    off = float(np.abs(world.height[1] - exact).sum() / np.abs(exact - 0.1)[exact > 0.1].sum())
    behind = float(np.abs(world.height[:, :39]).max())
    return f"error {100 * off:.2f} %, left behind {behind:g} m", off < 0.005 and behind == 0


@case("the same, ending between cells: the front, a cliff of height p, within half a cell: error at most p dx / (t D)")
def the_berm_between_cells():
    worst = 0.0
    for part in np.arange(0.1, 1.0, 0.1):
        distance = 20.0 + part * CELL
        world, exact = _berm(distance, 0.25)
        off = float(np.abs(world.height[1] - exact).sum()) * CELL
        worst = max(worst, off / (sqrt(2 * SLOPE * 0.1 * distance) * CELL))
    return f"error at most {worst:.3f} of p dx", worst < 1.03


def _pushed(heading, stride=0.25, direction=1, depth=0.15):
    """Soil [m3] ahead of a blade of 3 m after 10 m through a layer, and whether the volume is equal."""
    world, grid = at_rest(80, 80, depth)
    before = total(world)
    x, y = 20.07 - 5.0 * np.array([np.cos(heading), np.sin(heading)]) * direction
    lines = straight(x, y, heading, 10.0 * direction, stride)
    sweep_blade(world, grid, lines)
    rows, cols = np.indices((80, 80))
    frame = np.vectorize(lambda px, py: blade_frame(lines[-1], px, py))
    ahead, left = frame((cols + 0.5) * CELL, (rows + 0.5) * CELL)
    front = (ahead * direction > 0) & (np.abs(left) < 1.5)
    return np.maximum(world.height - depth, 0)[front].sum() * CELL**2, total(world) == before


@case("yaw 0 to 90 degrees in steps of 7.5: the load within 12 % of that at 0; volume equal")
def any_yaw():
    found = [_pushed(radians(yaw)) for yaw in np.arange(0.0, 90.1, 7.5)]
    loads = np.array([load for load, _ in found]) / found[0][0]
    ok = np.abs(loads - 1).max() < 0.12 and all(equal for _, equal in found)
    return f"{found[0][0]:.3f} m3 at 0, others {loads.min():.3f} to {loads.max():.3f} of it", ok


@case("all 32 headings round the circle, pushed forward and backward: the volume equal to the last bit")
def any_heading_keeps_the_volume():
    equal = [_pushed(heading, 0.25, sign)[1] for heading in np.arange(32) * pi / 16 for sign in (1, -1)]
    return f"{sum(equal)} of {len(equal)} equal", all(equal)


def _heap_driven(cells_a_step, cells=48, high=0.3):
    """Ground and load after a heap, less than the blade holds, was pushed so many cells, `cells_a_step` a step."""
    ground = np.zeros((40, 90))
    ground[17:23, 18:22] = high
    drive = Driven(ground, 4.0, 10.0, machine=RAPID).go(edge=0.0, dt=4.0)
    drive.go(speed=cells_a_step * CELL / 0.5, steps=round(cells / cells_a_step))
    return drive, drive.pose.load


def _at_speeds(speeds, high):
    """Loads over that at one cell a step, and the ground's relative L1 distance from that."""
    reference, load = _heap_driven(1.0, high=high)
    loads, grounds = [], []
    for speed in speeds:
        drive, here = _heap_driven(speed, high=high)
        loads.append(here / load)
        grounds.append(np.abs(drive.world.height - reference.world.height).sum() / total(reference.world))
        if total(drive.world) != total(reference.world):
            raise ArithmeticError(f"volume at {speed} cells a step is not that at 1")
    return np.array(loads), max(grounds)


@case("a blade alone through a layer, 0.05 to 20 cells a step: the load within 10 % of that at one cell a step")
def any_speed_of_a_blade():
    loads = []
    for speed in (1.0, 0.05, 0.1, 0.3, 0.7, 3.0, 20.0):  # a step is cut into strides of at most half a cell
        stride = speed * CELL / np.ceil(2 * speed)
        loads.append(_pushed(radians(30.0), stride)[0])
    others = np.array(loads[1:]) / loads[0]
    return f"{others.min():.3f} to {others.max():.3f} of {loads[0]:.3f} m3", np.abs(others - 1).max() < 0.1


@case("a machine with half a load, 0.05 to 24 cells a step: load within 10 % of that at one cell, ground within 10 %")
def any_speed():
    loads, off = _at_speeds((0.05, 0.1, 0.2, 0.3, 0.5, 2.0, 4.0, 12.0, 24.0), 0.3)
    ok = np.abs(loads - 1).max() < 0.1 and off < 0.1
    return f"load {loads.min():.3f} to {loads.max():.3f}, ground at most {100 * off:.1f} % off", ok


@case("50 cells in one step: the same pile as at 0.5 cells a step, to the last bit")
def fifty_cells_in_a_step():
    (fast, load), (slow, load_slow) = (_heap_driven(cells, 50) for cells in (50.0, 0.5))
    off = float(np.abs(fast.world.height - slow.world.height).max())
    return f"loads {load:.4f} and {load_slow:.4f} m3, heights at most {off:g} m apart", off < 1e-4


@case("0.01 cells a step, 4800 steps: nothing leaks behind the blade and it makes no more sweeps a cell than at 1")
def a_hundredth_of_a_cell_a_step():
    (slow, load), (fast, load_fast) = (_heap_driven(cells, 48) for cells in (0.01, 1.0))
    behind = float(slow.world.height[18:22, 30:60].sum()) * CELL**2
    behind_fast = float(fast.world.height[18:22, 30:60].sum()) * CELL**2
    ok = behind <= behind_fast + 0.05 and slow.sweeps <= 4800 + 4 * fast.sweeps and abs(load / load_fast - 1) < 0.1
    return f"behind {behind:.3f} m3 for {behind_fast:.3f}, {slow.sweeps} sweeps for {fast.sweeps}", ok


@case("1e-9 cells a step, 20,000 steps in a heap: at most one sweep a step, not a bit of the ground changes")
def a_billionth_of_a_cell_a_step():
    drive, _ = _heap_driven(1.0, 10)
    before, sweeps = drive.world.height.copy(), drive.sweeps
    drive.go(speed=1e-9 * CELL / 0.5, steps=20_000)
    same = np.array_equal(before, drive.world.height)
    return f"{drive.sweeps - sweeps} sweeps, ground unchanged: {same}", same and drive.sweeps - sweeps <= 20_000


@case("the centre of every crossed cell met exactly, at 0, 45 and 90 degrees: volume equal, under 5 mm of 200 left in the track")
def ties_on_cell_centres():
    left, equal = [], True
    for heading, at in ((0.0, (4.25, 10.25)), (0.5 * pi, (10.25, 4.25)), (0.25 * pi, (6.25, 6.25))):
        world, grid = at_rest(60, 60, 0.2)
        before = total(world)
        stride = 0.25 * (sqrt(2) if heading == 0.25 * pi else 1.0)
        sweep_blade(world, grid, straight(*at, heading, 40 * stride, stride, width=4.0, height=TALL))
        lane = [(at[0] + s * np.cos(heading), at[1] + s * np.sin(heading)) for s in np.arange(1.0, 38 * stride, CELL)]
        left.append(max(float(world.height[int(y / CELL), int(x / CELL)]) for x, y in lane))
        equal &= total(world) == before
    return f"left in the middle of the track {max(left):g} m", max(left) <= 5e-3 and equal


@case("a blade at exactly 45 degrees and 1e-12 rad beside it: the loads within 2 %")
def ties_at_45_degrees():
    loads = [_pushed(radians(45.0) + off)[0] for off in (0.0, 1e-12, -1e-12, 1e-6)]
    spread = (max(loads) - min(loads)) / loads[0]
    return f"{loads[0]:.3f} m3, apart by {100 * spread:.2f} %", spread < 0.02


@case("back-blading: pulls as much as pushing does, within 2 %")
def back_blading():
    (push, _), (pull, equal) = _pushed(0.0), _pushed(0.0, direction=-1)
    return f"{pull:.3f} m3 for {push:.3f}", abs(pull / push - 1) < 0.02 and equal


@case("an edge 50 cells under ground, 10 m: volume equal, no spike: nothing over 5 m, nothing as deep as the edge")
def an_edge_50_cells_under_ground():
    found = []
    for height in (1.0, 30.0):
        world, grid = at_rest(60, 60, 0.0)
        sweep_blade(world, grid, straight(8.0, 15.0, 0.0, 10.0, 0.25, edge=-25.0, height=height))
        found.append((total(world) == 0.0, float(world.height.min()), float(world.height.max())))
    text = ", ".join(f"{low:.2f} to {high:.2f} m" for _, low, high in found)
    return f"blade of 1 m and of 30 m: heights {text}", all(e and h < 5 and lo > -25 for e, lo, h in found)


@case("a blade driven through soil 10 m deep, its top 1 m up: what stands over the top stays behind; volume equal")
def a_buried_blade():
    world, grid = at_rest(40, 40, 10.0)
    before = total(world)
    sweep_blade(world, grid, straight(6.0, 10.0, 0.0, 6.0, 0.25))
    ok = total(world) == before and world.height.min() > 8.0 and world.height.max() < 12.0
    return f"heights {world.height.min():.2f} to {world.height.max():.2f} m", ok


@case("a blade of no height, or narrower than a cell, through a layer: finite, volume equal")
def a_blade_that_is_hardly_there():
    equal = True
    for shape in ({"height": 0.0}, {"width": 0.1}, {"width": 0.0}, {"height": 1e-6, "width": 1e-6}):
        world, grid = at_rest(30, 30, 0.2)
        before = total(world)
        sweep_blade(world, grid, straight(3.0, 7.25, 0.0, 8.0, 0.2, **shape))
        equal &= total(world) == before and np.isfinite(world.height).all()
        if shape.get("height") == 0.0:
            equal &= float(np.abs(world.height - np.float32(world.height[0, 0])).max()) == 0.0
    return f"4 blades, volume equal and nothing moved by the one of no height: {equal}", equal


@case("a tilted blade, roll 0.5: cuts on its lower side only; volume equal")
def a_tilted_blade():
    world, grid = at_rest(40, 60, 0.2)
    before = total(world)
    sweep_blade(world, grid, straight(5.0, 10.0, 0.0, 10.0, 0.25, edge=0.2, roll=0.5))
    low, high = float(world.height[18, 14:26].mean()), float(world.height[22, 14:26].mean())
    return f"right of the middle {low:.2f} m, left {high:.2f} m", total(world) == before and low < 0.1 <= high


@case("soil of 3 m against a tall blade that stands still: none passes in 1000 sweeps")
def a_standing_blade_holds():
    world, grid = at_rest(20, 60, 0.0)
    world.height[:, 30:40] = 3.0
    world.pending[:] = 0, 20, 0, 60
    sweep_blade(world, grid, [line_at(15.0, 5.0, pi, width=40.0, height=TALL)] * 20)
    passed = float(world.height[:, :30].sum())
    return f"{passed:g} m passed", passed == 0.0 and total(world) == 600.0


@case("the edge goes up and down 5 cm for 2000 steps in a heap: volume equal, ends in at most 40 sweeps a step")
def a_trembling_edge():
    drive, _ = _heap_driven(1.0, 10)
    before, sweeps = total(drive.world), drive.sweeps
    for _ in range(1000):
        drive.go(edge=0.05).go(edge=-0.05)
    spent = (drive.sweeps - sweeps) / 2000
    return f"{spent:.2f} sweeps a step", total(drive.world) == before and spent <= 40


@case("a blade wider and taller than the load fills up: the load stays under that of the whole wedge, W H^2 / (2 k)")
def the_load_has_a_bound():
    ground = np.full((80, 200), 0.3)
    drive = Driven(ground, 4.0, 20.0).go(edge=-0.2, dt=2.0)
    most = 0.0
    for _ in range(85):
        drive.go(speed=2.0, edge=-0.2)
        most = max(most, drive.pose.load)
    bound = BLADE.width * BLADE.height * (BLADE.height / SLOPE) * 1.5
    return f"at most {most:.2f} m3 in 85 m of cutting 0.2 m deep", 0.5 < most < bound
