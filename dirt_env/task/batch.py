"""The arrays of a batch of worlds, and of their jobs, for the kernels: a single environment is a batch of one.

Everything that differs from world to world is an array with the world as its first index, the scene's constants too:
one compiled step takes any of them, and few arguments.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dirt_env.sim.bank import bank_of
from dirt_env.sim.jit import kernel
from dirt_env.sim.params import Blade, Grid, Machine, Soil, record_of
from dirt_env.sim.state import POSE, TALLY
from dirt_env.sim.traction import PULL, Pull
from dirt_env.sim.zones import SOILS, Zones
from dirt_env.task.goal import Remaining, Sums, make_sums
from dirt_env.task.job import Job
from dirt_env.task.observation import POSE_ENTRIES, Noise, Sight, View
from dirt_env.task.reward import TERMS, Scale


class Totals(NamedTuple):
    """What has been done since the start: control steps, work on the soil [J], distance [m], soil lost over the border
    [m3], what driving and pushing took in all [J].
    """

    steps: int = 0
    work: float = 0.0
    distance: float = 0.0
    lost: float = 0.0
    energy: float = 0.0


JOB_NUMBERS = tuple(name for name, kind in Job.__annotations__.items() if kind is float)
COLUMNS = ("offset", "scale", "low", "high")  # of the pose table, the arrays of a View

# A scene: side of a cell [m], soil, blade, machine, what the observation is made of, control period and job time [s],
# share in the goal or grade error [m] that is success (the other can never be met), weights of the reward.
SCENE = np.dtype(
    (
        np.record,
        [("soil", SOILS), ("blade", record_of(Blade)), ("machine", record_of(Machine))]
        + [("eye", record_of(View)), ("columns", "f8", (len(COLUMNS), len(POSE_ENTRIES)))]
        + [(name, "f8") for name in ("cell", "period", "time", "success", "tolerance")]
        + [("weights", "f8", (len(TERMS),))],
    )
)

# An episode: the world's quantum [m], number of goal centres, scale of the reward, the job at its start, what has been
# done since, and whether it is finished.
_PARTS = [("scale", record_of(Scale)), ("start", record_of(Remaining)), ("totals", record_of(Totals))]
EPISODE = np.dtype((np.record, [*_PARTS, ("quantum", "f8"), ("centers", "i8"), ("finished", "i8")]))


class Batch(NamedTuple):
    """Worlds [n], jobs and scenes; see `sim.state.World` and `Job` for the arrays, which have one index more here.

    The numbers of `job` are f8[n], `job.centers` is f8[n, most, 2], of which EPISODE.centers are in use.
    `sums` is that of the gauge; `channels` i8[c], the patch's, are those of all worlds. `pulls` PULL[n], or None where
    traction is not computed; `grade` is the job's target where the blade is under grade control, else None. `bank` and
    `natural` are None where no soil swells; `zone` i1[n, rows, cols] and its tables `soils` SOILS[n, k] and
    `zone_pulls` PULL[n, k] where there is one soil only.
    """

    height: np.ndarray
    solid: np.ndarray | None
    outside: np.ndarray | None
    machine: np.ndarray
    tally: np.ndarray
    changed: np.ndarray
    pending: np.ndarray
    sums: Sums
    episodes: np.ndarray
    job: Job
    scenes: np.ndarray
    channels: np.ndarray
    pulls: np.ndarray | None
    grade: np.ndarray | None
    bank: np.ndarray | None
    natural: np.ndarray | None
    zone: np.ndarray | None
    soils: np.ndarray | None
    zone_pulls: np.ndarray | None


class Scratch(NamedTuple):
    """Work space of one thread; holds nothing between two steps."""

    buffers: np.ndarray
    links: np.ndarray
    link_levels: np.ndarray


def make_batch(
    count: int,
    rows: int,
    cols: int,
    walls: bool,
    open_border: bool,
    channels: Sequence[int],
    traction: bool = False,
    grade_control: bool = False,
    swell: bool = False,
    soils: int = 1,
) -> Batch:
    """Arrays for `count` worlds of so many `soils`, all zero; what such worlds do not have is None."""
    shape = count, rows, cols
    grounds = [np.zeros(shape, np.float32) for _ in range(4)]
    job = Job(
        target=grounds[1],
        aim=grounds[2],
        haul=grounds[3],
        kind=np.zeros(shape, np.uint8),
        centers=np.zeros((count, 1, 2)),
        **{name: np.zeros(count) for name in JOB_NUMBERS},
    )
    sums = make_sums(rows, cols)
    return Batch(
        height=grounds[0],
        solid=np.zeros(shape, np.bool_) if walls else None,
        outside=np.zeros(shape, np.float32) if open_border else None,
        machine=np.zeros(count, POSE),
        tally=np.zeros(count, TALLY),
        changed=np.zeros((count, 4), np.int64),
        pending=np.zeros((count, 4), np.int64),
        sums=Sums(*(np.zeros((count, *part.shape)) for part in sums)),
        episodes=np.zeros(count, EPISODE),
        job=job,
        scenes=np.zeros(count, SCENE),
        channels=np.array(channels),
        pulls=np.zeros(count, PULL) if traction else None,
        grade=job.target if grade_control else None,
        bank=np.zeros(shape, np.float32) if swell else None,
        natural=np.zeros(shape, np.float32) if swell else None,
        zone=np.zeros(shape, np.int8) if soils > 1 else None,
        soils=np.zeros((count, soils), SOILS) if soils > 1 else None,
        zone_pulls=np.zeros((count, soils), PULL) if traction and soils > 1 else None,
    )


@kernel
def at(array, world):
    """One world's part of an array, or None of None."""
    if array is None:
        return None
    return array[world]


@kernel
def grid_of(batch, scene):
    """Grid of a SCENE record."""
    return Grid(batch.height.shape[1], batch.height.shape[2], scene.cell)


@kernel
def soil_of(scene):
    """Soil of a SCENE record. By value: what is read through a record in a loop would be read again each time."""
    soil = scene.soil
    return Soil(soil.slope, soil.density, soil.friction, soil.tolerance, soil.max_sweeps, soil.swell)


@kernel
def blade_of(scene):
    """Blade of a SCENE record."""
    return Blade(scene.blade.width, scene.blade.height, scene.blade.reach)


@kernel
def machine_of(scene):
    """Machine of a SCENE record."""
    machine = scene.machine
    return Machine(
        machine.length, machine.width, machine.speed, machine.yaw_rate, machine.cut, machine.lift, machine.edge_rate
    )


@kernel
def pull_at(pulls, w):
    """Pull of world w, or None where there are none."""
    if pulls is None:
        return None
    p = pulls[w]
    return Pull(
        p.cut, p.hold, p.press, p.slide, p.top, p.slope, p.width,
        p.weight, p.grip, p.tangent, p.full, p.ratio, p.rolling, p.power,
    )  # fmt: skip


@kernel
def zones_at(zone, soils, pulls, w):
    """Zones of world w from a batch's arrays, or None where there is one soil only."""
    if zone is None:
        return None
    count = soils.shape[1]
    return Zones(zone[w], soils[w], at(pulls, w), np.zeros(count), np.zeros(count))


@kernel
def bank_at(batch, w):
    """Bank of world w, or None where no soil swells."""
    return bank_of(at(batch.bank, w), at(batch.natural, w), batch.scenes[w].soil.swell)


@kernel
def view_of(batch, scene):
    """View of a SCENE record."""
    eye, columns = scene.eye, scene.columns
    return View(
        eye.resolution, eye.ahead, eye.limit, eye.beyond, eye.overview_cell, eye.doubt,
        batch.channels, columns[0], columns[1], columns[2], columns[3],
    )  # fmt: skip


@kernel
def job_of(batch, w):
    """The Job with index w; its arrays are those of the batch."""
    job = batch.job
    return Job(
        target=job.target[w],
        aim=job.aim[w],
        haul=job.haul[w],
        kind=job.kind[w],
        centers=job.centers[w][: batch.episodes[w].centers],
        mean_haul=job.mean_haul[w],
        missing=job.missing[w],
        soil=job.soil[w],
        design_cells=job.design_cells[w],
        goal_depth=job.goal_depth[w],
        limit=job.limit[w],
    )


@kernel
def sums_of(batch, w):
    """The Sums with index w; they are those of the batch."""
    sums = batch.sums
    return Sums(sums.blocks[w], sums.bands[w], sums.total[w], sums.result[w])


@kernel
def noise_at(noise, w):
    """The Noise with index w, or None where there is none."""
    if noise is None:
        return None
    return Noise(noise.height[w], noise.pose[w], noise.ground[w], noise.machine[w : w + 1])


@kernel
def sight_of(sight, w):
    """The Sight with index w of one with stacked arrays."""
    return Sight(sight.patch[w], sight.pose[w], at(sight.overview, w), at(sight.map, w), noise_at(sight.noise, w))
