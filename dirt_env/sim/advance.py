"""What one control step does to a world: the one composition of the phases."""

import numpy as np

from dirt_env.sim.bank import bank_of
from dirt_env.sim.blade import cells_between, held_links, line_of, load_ahead, scrape, stands_above
from dirt_env.sim.intrinsics import uncounted
from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.laws import RATE, push_work
from dirt_env.sim.machine import drive, facing_of, ground_at, is_free, track_plane, wrap
from dirt_env.sim.params import Blade, Command, Grid, Machine, Soil
from dirt_env.sim.projection import project
from dirt_env.sim.slump import at_rest, limits, relax, settle_window
from dirt_env.sim.state import TALLY, World
from dirt_env.sim.super_steps import is_settled, settle_long
from dirt_env.sim.timestep import substeps
from dirt_env.sim.traction import Pull, effort
from dirt_env.sim.window import on_map, widen, within
from dirt_env.sim.zones import Zones, extremes, slope_ahead, work_ahead

METHODS = ("auto", "explicit", "super", "projection")
FEW = 24  # sweeps after which `auto` goes on by super-steps
FINISH = 200.0  # pseudo-time that a projection counts as having taken, for what is left to settle after it
PATIENCE = 50  # stages for each row and column after which plain sweeps, which always end, take over


@kernel
def stand(height, cell, pose, facing, blade, machine):
    """Lay the machine on the ground under its tracks."""
    pose.z, pose.pitch, pose.roll = track_plane(height, cell, pose.x, pose.y, facing, blade, machine)


@kernel
def measure_load(height, solid, pose, line, cell, soil, blade, zones=None):
    """Write the soil ahead of the blade [m3], which is at `line`, into the machine's record."""
    plane, slope = pose.z + pose.pitch * blade.reach, soil.slope
    if zones is not None:
        slope = slope_ahead(zones, slope, line, cell, 1)
    pose.load, _ = load_ahead(height, solid, line, cell, slope, plane, 1)


@kernel
def work_of_way(height, solid, pose, line, cell, soil, blade, way, zones=None):
    """Work on the soil that stands against the blade, on the side it moves to, over a `way` of one substep [J].

    Going forward, that soil is the load, and goes into the machine's record.
    """
    plane, slope = pose.z + pose.pitch * blade.reach, soil.slope
    side = 1 if way > 0 else -1
    if zones is not None:
        slope = slope_ahead(zones, slope, line, cell, side)
    load, pushed = load_ahead(height, solid, line, cell, slope, plane, side)
    if side > 0:
        pose.load = load
    if not pushed:
        return 0.0
    if zones is not None:
        return work_ahead(zones, load, soil.density, soil.friction, way)
    return push_work(load, soil.density, soil.friction, way)


@kernel
def graded_edge(target, pose, facing, cell, blade, machine, asked):
    """Height of the edge over the tracks [m] by automatic grade control, for an `asked` one as in `Command`.

    At 0 the middle of the edge is at the target surface, target[row, col], below 0 as much below it; above 0 it goes
    from there evenly to `machine.lift` over the tracks.
    """
    x, y = pose.x + blade.reach * facing[0], pose.y + blade.reach * facing[1]
    level = ground_at(target, cell, x, y) - pose.z - pose.pitch * blade.reach
    share = max(asked, 0.0) / machine.lift
    edge = (1.0 - share) * level + share * machine.lift + min(asked, 0.0)
    return min(max(edge, -machine.cut), machine.lift)


@kernel
def move_soil(
    height, solid, outside, buffers, links, levels, changed, pending, cell, soil, quantum, pose, old, new, tally,
    zones=None, bank=None,
):  # fmt: skip
    """Cut, carry and slump for one substep of the blade, from `old` to `new`; nothing where it touches no soil and did
    not before.

    Adds to the record `tally` what was cut, lost and stuck [m of one cell], and the sweeps, of which there are at most
    `soil.max_sweeps` in all; what is left over stays pending. Ground at rest stays so as long as the blade moves none
    of it, closes the same links, which the machine's record `pose` keeps, and lets nothing past. Returns whether the
    blade touches soil.
    """
    box = cells_between(old, new, cell)
    lowest = min(old.edge - abs(old.roll) * old.half, new.edge - abs(new.roll) * new.half)
    touches = stands_above(height, box, lowest)
    held, key = 0, 0
    if touches or pose.closed != 0.0:  # or it closed links before
        threshold, settled, lock = limits(height, quantum, cell, soil.slope, soil.tolerance)
        if zones is not None:
            low, _ = extremes(zones.soils)
            threshold, settled, _ = limits(height, quantum, cell, low, soil.tolerance)
        moved = scrape(height, solid, outside, old, new, cell, lock, tally, bank)
        grown = 1 if moved else 0  # soil is put down in cells next to those that gave it
        box = (box[0] - grown, box[1] + grown, box[2] - grown, box[3] + grown)
        r0, r1, c0, c1 = on_map(box, *height.shape)
        if moved:
            widen(changed, r0, r1, c0, c1)
        held, key, passes = held_links(height, new, cell, threshold, settled, links, levels)
        stays = not moved and key == pose.closed
        known = outside is None or within(box, 2, *height.shape)  # a border at rest is not looked into
        looks = pending[1] > pending[0] or passes or not known
        if looks or not (stays or at_rest(height, solid, buffers, box, links, held, settled)):
            widen(pending, r0, r1, c0, c1)
    pose.closed = key
    if pending[1] <= pending[0]:
        return touches
    sweeps, lost = relax(
        height, solid, outside, buffers, links, levels, changed, pending, cell, soil, quantum, held,
        soil.max_sweeps - tally.sweeps, zones, bank,
    )  # fmt: skip
    tally.lost += lost
    tally.sweeps += sweeps
    return touches


@kernel
def step(
    height, solid, outside, pose, tally, buffers, links, levels, changed, pending, quantum,
    grid, soil, blade, machine, command, dt, pull=None, target=None, zones=None, bank=None,
):  # fmt: skip
    """One control step in place; see `advance`. With a target[row, col] [m] its edge is under grade control."""
    rows, cols = height.shape
    cell = grid.cell
    pieces = substeps(command.speed, command.yaw_rate, dt, cell, blade)
    period = dt / pieces
    tally.cut = tally.lost = tally.stuck = 0.0
    tally.sweeps = 0
    distance = turned = held = work = energy = draft = slip = 0.0
    measured = False
    old = line_of(pose, facing_of(pose.heading), blade)
    for _ in range(pieces):
        forward, turn = command.speed * period, command.yaw_rate * period
        if pull is not None:
            share, force, power, slipped = effort(
                height, solid, pose, old, cell, soil, blade, machine, pull, command.speed, zones
            )
            forward, turn = share * forward, share * turn
            energy += power * period
            draft += force / pieces
            slip += slipped / pieces
        went, swung, facing = drive(solid, outside, rows, cols, cell, pose, blade, machine, forward, turn)
        held += 0.0 if went == forward and swung == turn else 1.0 / pieces
        distance += went
        turned += swung
        stand(height, cell, pose, facing, blade, machine)
        edge, largest = command.edge, machine.edge_rate * period
        if target is not None:
            edge = graded_edge(target, pose, facing, cell, blade, machine, edge)
        pose.edge += min(max(edge - pose.edge, -largest), largest)
        new = line_of(pose, facing, blade)
        touches = move_soil(
            height, solid, outside, buffers, links, levels, changed, pending, cell, soil, quantum, pose, old, new,
            tally, zones, bank,
        )  # fmt: skip
        weigh = touches and went != 0.0
        if pull is not None:
            work += force * abs(went)
        elif weigh:
            work += work_of_way(height, solid, pose, new, cell, soil, blade, went, zones)
            measured = went > 0.0
        else:
            measured = False
        old = new
    if not measured:
        measure_load(height, solid, pose, old, cell, soil, blade, zones)
    pose.speed, pose.yaw_rate = distance / dt, turned / dt
    tally.distance, tally.work, tally.blocked = abs(distance), work, held
    tally.cut, tally.lost, tally.stuck = tally.cut * cell**2, tally.lost * cell**2, tally.stuck * cell**2
    if pull is not None:
        tally.energy, tally.draft, tally.slip = energy, draft, slip
    else:
        tally.energy = work


@entry
def advance(
    world: World,
    grid: Grid,
    soil: Soil,
    blade: Blade,
    machine: Machine,
    command: Command,
    dt: float,
    pull: Pull | None = None,
    zones: Zones | None = None,
) -> None:
    """Advance a world by one control step of `dt` seconds, in place; `world.tally` then holds what it did.

    With `pull`, draft and traction decide how fast the machine goes; without, it does what the command says. With
    `zones`, the soil differs from place to place.
    """
    world, zones = uncounted(world), uncounted(zones)
    step(
        world.height, world.solid, world.outside, world.machine[0], world.tally[0], world.buffers, world.links,
        world.link_levels, world.changed, world.pending, world.quantum, grid, soil, blade, machine, command, dt, pull,
        None, zones, bank_of(world.bank, world.natural, soil.swell),
    )  # fmt: skip


@entry
def fits(world: World, grid: Grid, blade: Blade, machine: Machine, x: float, y: float, heading: float) -> bool:
    """Whether the machine can stand with its pivot at (x, y) [m] and that heading [rad]."""
    return is_free(
        world.solid, world.outside, grid.rows, grid.cols, grid.cell, x, y, facing_of(heading), blade, machine
    )


@entry
def set_down(
    world: World, grid: Grid, soil: Soil, blade: Blade, machine: Machine, x: float, y: float, heading: float,
    zones: Zones | None = None,
) -> None:  # fmt: skip
    """Put the machine there at rest, with its blade at travel height."""
    pose = world.machine[0]
    pose.x, pose.y, pose.heading, pose.edge = x, y, wrap(heading), machine.lift
    pose.speed = pose.yaw_rate = pose.closed = 0.0
    facing = facing_of(pose.heading)
    stand(world.height, grid.cell, pose, facing, blade, machine)
    measure_load(world.height, world.solid, pose, line_of(pose, facing, blade), grid.cell, soil, blade, zones)


@entry
def let_go(world: World, grid: Grid, blade: Blade) -> None:
    """Let slump from now on what leans on the machine's blade, which is about to be taken away."""
    held = line_of(world.machine[0], facing_of(world.machine[0].heading), blade)
    r0, r1, c0, c1 = cells_between(held, held, grid.cell)
    r0, r1, c0, c1 = max(r0 - 1, 0), min(r1 + 1, grid.rows), max(c0 - 1, 0), min(c1 + 1, grid.cols)
    lowest = held.edge - abs(held.roll) * held.half
    leans = world.machine[0].closed != 0.0 or stands_above(world.height, (r0, r1, c0, c1), lowest)
    if leans and r1 > r0 and c1 > c0:
        widen(world.pending, r0, r1, c0, c1)


def place(
    world: World, grid: Grid, soil: Soil, blade: Blade, machine: Machine, x: float, y: float, heading: float,
    zones: Zones | None = None,
) -> None:  # fmt: skip
    """Put the machine at (x, y) [m] with that heading [rad], at rest, its blade at travel height.

    What leans on the blade where it was slumps in the next step. Raises ValueError where it cannot stand: outside the
    site, or on something solid.
    """
    if not fits(world, grid, blade, machine, float(x), float(y), float(heading)):
        raise ValueError(
            f"the machine does not fit at x {x:g} m, y {y:g} m, heading {heading:g} rad; "
            f"allowed: tracks and blade inside 0..{grid.cols * grid.cell:g} m x 0..{grid.rows * grid.cell:g} m, "
            "clear of everything solid"
        )
    if isinstance(world, World):  # constraints of a blade in cells last as long as they last
        let_go(world, grid, blade)
    set_down(world, grid, soil, blade, machine, float(x), float(y), float(heading), zones)
    world.tally[:] = np.zeros(1, TALLY)


def settle(world: World, grid: Grid, soil: Soil, method: str = "auto", zones: Zones | None = None) -> int:
    """Relax the whole ground to the angle of repose; returns the sweeps (stages, iterations) it took.

    `method`: "explicit", sweep by sweep; "super", by super-steps (`super_steps`); "auto", super-steps where few sweeps
    do not do; "projection", all soil at once (`projection`), which is another physics and therefore never chosen for
    you. docs/physics.md says which to take. Where soils differ, or the undisturbed soil is told apart from the loose,
    "auto" goes sweep by sweep too. Raises ValueError for another method, for a projection of a site with solid cells or
    an open border, and for both other methods where soils differ or swell.
    """
    if method not in METHODS:
        raise ValueError(f"method is {method!r}; allowed: {', '.join(METHODS)}")
    if method == "projection" and (world.solid is not None or world.outside is not None):
        raise ValueError("method is 'projection' on a site with solid cells or an open border; allowed: walls only")
    if zones is not None or world.bank is not None:
        if method not in ("auto", "explicit"):
            raise ValueError(f"method is {method!r} where soils differ or swell; allowed: auto, explicit")
        method = "explicit"
    world.pending[:] = (0, grid.rows, 0, grid.cols)
    total, elapsed = 0, 0.0
    if method == "projection" and not is_settled(world, grid, soil):
        total, elapsed = project(world, grid, soil), FINISH
    if method == "auto":
        total = settle_window(world, grid, soil._replace(max_sweeps=min(soil.max_sweeps, FEW)))
        elapsed = total * RATE
    most = total + PATIENCE * (grid.rows + grid.cols) + 1000
    while world.pending[1] > world.pending[0] and total < most and method != "explicit":
        total += settle_long(world, grid, soil, elapsed)
    while world.pending[1] > world.pending[0]:
        total += settle_window(world, grid, soil, zones)
    world.machine[0].closed = 0.0  # at rest with no link closed
    return total
