"""One control step on the paper's terrain: the machine of `advance`, on cells instead of a height field."""

from math import ceil
from typing import NamedTuple

import numpy as np

from dirt_env.sim.advance import measure_load, place, stand, work_of_way
from dirt_env.sim.blade import box_around, line_of, stands_above
from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.machine import drive, facing_of
from dirt_env.sim.params import Blade, Command, Grid, Machine, Soil
from dirt_env.sim.state import POSE, TALLY
from dirt_env.sim.timestep import substeps
from dirt_env.sim.voxel import updates
from dirt_env.sim.voxel_agent import occupy
from dirt_env.sim.voxel_state import HEAP, POINT, Rules, Voxels, make_voxels
from dirt_env.sim.voxel_surface import height_at, lay_surface
from dirt_env.sim.window import clear, widen

MOST_UPDATES = 20000  # of settling; a ground in a limit cycle never comes to rest


class VoxelWorld(NamedTuple):
    """One world of cells; every array is updated in place. The first six fields are as in `state.World`.

    `height` f4[rows, cols] m is the soil of each column put on a heap, fill in transit too, so that its sum is the
    volume; `surface` f4[rows, cols] m is the paper's. They differ only where soil is in the air or on a constraint.
    Which of them the machine stands on says `Rules.footing`. The rest are the cells, see `Voxels`.
    """

    height: np.ndarray
    solid: np.ndarray | None
    outside: np.ndarray | None
    machine: np.ndarray
    tally: np.ndarray
    changed: np.ndarray
    surface: np.ndarray
    fill: np.ndarray
    incoming: np.ndarray
    life: np.ndarray
    active: np.ndarray
    touched: np.ndarray
    work: np.ndarray
    flags: np.ndarray
    bottom: float
    dy: float

    @property
    def voxels(self) -> Voxels:
        """The cells; the same arrays."""
        return Voxels(**{name: getattr(self, name) for name in Voxels._fields})


def make_voxel_world(
    height: np.ndarray,
    grid: Grid,
    rules: Rules,
    dy: float,
    depth: float,
    headroom: float,
    solid: np.ndarray | None = None,
    open_border: bool = False,
) -> VoxelWorld:
    """World of cells with the ground `height` [rows, cols] m; the machine is not placed yet.

    The grid reaches at least `depth` m below the lowest ground and `headroom` m above the highest. Height 0 is a
    boundary between two levels.
    """
    height = np.asarray(height, np.float64)
    if height.shape != (grid.rows, grid.cols) or not np.isfinite(height).all():
        raise ValueError(f"height has shape {height.shape}; allowed: {(grid.rows, grid.cols)}, all finite")
    solid = np.ascontiguousarray(solid, np.bool_) if solid is not None and np.any(solid) else None
    below = ceil((depth - float(height.min())) / dy - 1e-9)
    levels = max(ceil((float(height.max()) + headroom) / dy - 1e-9) + below, 1)
    voxels = make_voxels(height, grid, dy, -below * dy, levels, solid, open_border, rules.grain)
    ground = np.ascontiguousarray(height, np.float32)
    world = VoxelWorld(
        height=ground,
        solid=solid,
        outside=ground.copy() if open_border else None,
        machine=np.zeros(1, POSE),
        tally=np.zeros(1, TALLY),
        changed=np.array([0, grid.rows, 0, grid.cols]),
        surface=ground.copy(),
        **voxels._asdict(),
    )
    update_world(world, rules, 0)
    return world


@kernel
def refresh(world):
    """Lay surface and heights over the columns that were touched since the last time."""
    touched, changed = world.touched, world.changed
    if touched[1] > touched[0]:
        lay_surface(
            world.fill, world.incoming, world.solid, world.bottom, world.dy, touched, world.surface, world.height
        )
        widen(changed, touched[0] - 1, touched[1] - 1, touched[2] - 1, touched[3] - 1)
    clear(touched)


@kernel
def run_updates(world, rules, count):
    """Updates of the grid, and the surface after them; returns how many it took."""
    done = updates(
        world.fill, world.incoming, world.life, world.active, world.touched, world.work, world.flags, rules, count
    )
    refresh(world)
    return done


@kernel
def soil_in(world):
    """All fill and fill in transit on the site [cells]."""
    rows, cols, high = world.fill.shape
    total = 0.0
    for r in range(1, rows - 1):
        for c in range(1, cols - 1):
            for m in range(1, high - 1):
                total += world.fill[r, c, m] + world.incoming[r, c, m]
    return total


@entry
def update_world(world: VoxelWorld, rules: Rules, count: int) -> int:
    """At most `count` updates of the grid, without the machine; returns how many it took to come to rest."""
    return run_updates(world, rules, count)


def settle_voxels(world: VoxelWorld, rules: Rules) -> int:
    """Update until the whole ground is at rest, or for 20,000 updates; returns how many."""
    return update_world(world, rules, MOST_UPDATES)


@kernel
def stand_on(world, cell, pose, facing, blade, machine, rules):
    """Update the agent's y from the surface, as `rules.footing` says."""
    if rules.footing == POINT:
        pose.z, pose.pitch, pose.roll = height_at(world.surface, cell, pose.x, pose.y), 0.0, 0.0
    elif rules.footing == HEAP:
        stand(world.height, cell, pose, facing, blade, machine)
    else:
        stand(world.surface, cell, pose, facing, blade, machine)


@entry
def lay_down(world: VoxelWorld, grid: Grid, soil: Soil, blade: Blade, machine: Machine, rules: Rules) -> None:
    """Lay the machine where it is on the ground, and measure its load."""
    pose = world.machine[0]
    facing = facing_of(pose.heading)
    stand_on(world, grid.cell, pose, facing, blade, machine, rules)
    measure_load(world.height, world.solid, pose, line_of(pose, facing, blade), grid.cell, soil, blade)


def place_on_voxels(
    world: VoxelWorld, grid: Grid, soil: Soil, blade: Blade, machine: Machine, rules: Rules, pose: tuple
) -> None:
    """`advance.place` on cells; `pose` is (x, y) [m] and heading [rad]. Raises ValueError where it cannot stand."""
    place(world, grid, soil, blade, machine, *pose)
    lay_down(world, grid, soil, blade, machine, rules)


@kernel
def push_soil(world, grid, rules, line, forward, turn, tally):
    """The blade's constraints of one substep; nothing is altered by a blade in the air.

    Returns whether it touches soil.
    """
    box = box_around(line, grid.cell)
    touches = stands_above(world.surface, box, line.edge - abs(line.roll) * line.half)
    if touches:
        occupy(
            world.fill, world.incoming, world.life, world.active, world.bottom, world.dy, grid.cell, line, forward,
            turn, rules, tally,
        )  # fmt: skip
        widen(world.touched, world.active[0], world.active[1], world.active[2], world.active[3])
    return touches


@entry
def advance_voxels(
    world: VoxelWorld,
    grid: Grid,
    soil: Soil,
    blade: Blade,
    machine: Machine,
    rules: Rules,
    pace: float,
    command: Command,
    dt: float,
) -> None:
    """Advance a world of cells by one control step of `dt` seconds, with `pace` updates of the grid a second.

    The agent's update (Section IV-A) in every substep: heading, position, then its height from the surface.
    """
    pose, tally = world.machine[0], world.tally[0]
    pieces = substeps(command.speed, command.yaw_rate, dt, grid.cell, blade)
    period, wanted = dt / pieces, int(round(pace * dt))
    tally.cut = tally.stuck = 0.0
    tally.sweeps = 0
    before = soil_in(world) if world.outside is not None else 0.0
    distance = turned = held = work = 0.0
    for k in range(pieces):
        forward, turn = command.speed * period, command.yaw_rate * period
        went, swung, facing = drive(
            world.solid, world.outside, grid.rows, grid.cols, grid.cell, pose, blade, machine, forward, turn
        )
        held += 0.0 if went == forward and swung == turn else 1.0 / pieces
        distance += went
        turned += swung
        largest = machine.edge_rate * period
        pose.edge += min(max(command.edge - pose.edge, -largest), largest)
        stand_on(world, grid.cell, pose, facing, blade, machine, rules)
        line = line_of(pose, facing, blade)
        touches = push_soil(world, grid, rules, line, went, swung, tally)
        if touches and went != 0.0:
            work += work_of_way(world.height, world.solid, pose, line, grid.cell, soil, blade, went)
        tally.sweeps += run_updates(world, rules, (k + 1) * wanted // pieces - k * wanted // pieces)
    measure_load(world.height, world.solid, pose, line, grid.cell, soil, blade)
    pose.speed, pose.yaw_rate = distance / dt, turned / dt
    lost = before - soil_in(world) if world.outside is not None else 0.0
    area = grid.cell**2
    tally.distance, tally.work, tally.energy, tally.blocked = abs(distance), work, work, held
    tally.cut, tally.lost, tally.stuck = tally.cut * area, lost * area * world.dy, tally.stuck * area
