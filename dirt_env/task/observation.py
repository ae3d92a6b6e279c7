"""What a policy is shown: a patch of ground around the machine, a vector about the machine, maps of the whole site."""

from math import hypot
from typing import NamedTuple

import numpy as np

from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.machine import facing_of
from dirt_env.sim.params import Blade, Grid, Machine
from dirt_env.task.job import Job
from dirt_env.task.patch import CHANNELS, fill_patch
from dirt_env.task.site_map import MAP_LIMIT, OVERVIEW, fill_map, fill_overview

POSE_ENTRIES = (
    "x",
    "y",
    "sin_heading",
    "cos_heading",
    "edge",
    "speed",
    "yaw_rate",
    "pitch",
    "roll",
    "load",
    "goal_ahead",
    "goal_left",
    "goal_distance",
    "remaining",
    "time_left",
)
"""Order of the pose vector; `pose_table` has units and scales, `read_pose` turns it back into physical units."""


class PoseEntry(NamedTuple):
    """One entry of the pose vector: observed = (physical - offset) / scale, clipped to [low, high]."""

    name: str
    unit: str
    offset: float
    scale: float
    low: float
    high: float


class View(NamedTuple):
    """Constants of the observation for the kernel. Lengths in m.

    `ahead` is the share of the patch that lies ahead of the pivot; heights are clipped to `limit` either way; `beyond`
    is what the ground outside the site looks like, over the ground under the machine; in the overview, what is no more
    than `doubt` above its aim is left out; `channels` i8[n] are the patch's, as numbers of CHANNELS; the rest are the
    columns of `pose_table`.
    """

    resolution: float
    ahead: float
    limit: float
    beyond: float
    overview_cell: float
    doubt: float
    channels: np.ndarray
    offset: np.ndarray
    scale: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Noise(NamedTuple):
    """Errors of what a machine measures, and work space for what it takes for true.

    `height` f4[rows, cols] m, added to the ground; `pose` f8[3], to its x, y [m] and heading [rad]. `ground` is as
    `height`, `machine` POSE[1].
    """

    height: np.ndarray
    pose: np.ndarray
    ground: np.ndarray
    machine: np.ndarray


class Sight(NamedTuple):
    """The arrays of one observation, f4; what was not asked for is None. Shapes in `bounds`.

    `noise` is what its machine gets wrong, None for a machine that knows everything as it is.
    """

    patch: np.ndarray
    pose: np.ndarray
    overview: np.ndarray | None
    map: np.ndarray | None
    noise: Noise | None = None


def pose_table(grid: Grid, blade: Blade, machine: Machine) -> tuple[PoseEntry, ...]:
    """Unit, scale and bounds of every entry of the pose vector."""
    half_x, half_y = 0.5 * grid.cols * grid.cell, 0.5 * grid.rows * grid.cell
    full_blade = 0.8 * blade.width * blade.height**2  # rated capacity of a straight blade, SAE J1265
    scales = {
        "x": ("m", half_x, half_x, -1.0, 1.0),
        "y": ("m", half_y, half_y, -1.0, 1.0),
        "edge": ("m", 0.0, max(machine.cut, machine.lift), -2.0, 2.0),
        "speed": ("m/s", 0.0, machine.speed, -2.0, 2.0),
        "yaw_rate": ("rad/s", 0.0, machine.yaw_rate, -2.0, 2.0),
        "pitch": ("slope", 0.0, 1.0, -2.0, 2.0),
        "roll": ("slope", 0.0, 1.0, -2.0, 2.0),
        "load": ("m3", 0.0, full_blade, 0.0, 5.0),
        "goal_distance": ("m", 0.0, 2.0 * hypot(half_x, half_y), 0.0, 1.0),
        "remaining": ("share of the soil", 0.0, 1.0, 0.0, 2.0),
        "time_left": ("share of the time", 0.0, 1.0, 0.0, 1.0),
    }
    unit_vector = ("-", 0.0, 1.0, -1.0, 1.0)
    return tuple(PoseEntry(name, *scales.get(name, unit_vector)) for name in POSE_ENTRIES)


def read_pose(pose: np.ndarray, table: tuple[PoseEntry, ...]) -> dict[str, float]:
    """The pose vector in physical units, by name; `heading` [rad] is added."""
    named = {entry.name: float(value) * entry.scale + entry.offset for entry, value in zip(table, pose, strict=True)}
    named["heading"] = float(np.arctan2(named["sin_heading"], named["cos_heading"]))
    return named


def make_view(
    table: tuple[PoseEntry, ...],
    grid: Grid,
    resolution: float,
    ahead: float,
    limit: float,
    beyond: float,
    doubt: float,
    channels: tuple[str, ...],
) -> View:
    """Constants of the observation; the squares of the overview together are as wide as the site's longer side."""
    columns = {name: np.array([getattr(entry, name) for entry in table]) for name in ("offset", "scale", "low", "high")}
    side = max(grid.rows, grid.cols) * grid.cell
    beyond = min(max(beyond, -limit), limit)
    places = np.array(list(map(CHANNELS.index, channels)))
    return View(resolution, ahead, limit, beyond, side / OVERVIEW, doubt, places, **columns)


def bounds(
    grid: Grid,
    table: tuple[PoseEntry, ...],
    size: int,
    channels: tuple[str, ...],
    limit: float,
    walls: bool,
    overview: bool,
    site_map: bool,
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Lowest and highest value of every array of an observation, by name; f4.

    `channels` are the patch's; heights end at `limit` [m] either way; with `walls`, the map has a channel for them.
    """
    ends = {"height": (-limit, limit), "todo": (-limit, limit), "walls": (0.0, 1.0)}
    squares, site = [(0.0, 4.0), (0.0, 1.0)], [(-MAP_LIMIT, MAP_LIMIT), ends["todo"]]
    found = {
        "patch": _stack([ends[name] for name in channels], (size, size)),
        "pose": tuple(np.array([getattr(entry, end) for entry in table], np.float32) for end in ("low", "high")),
    }
    if overview:
        found["overview"] = _stack(squares, (OVERVIEW, OVERVIEW))
    if site_map:
        found["map"] = _stack(site + [ends["walls"]] * walls, (grid.rows, grid.cols))
    return found


def _stack(channels: list[tuple[float, float]], shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of an image with one (low, high) for each channel."""
    low, high = np.array(channels, np.float32).T
    full = (len(channels), *shape)
    return tuple(np.broadcast_to(end[:, None, None], full).copy() for end in (low, high))


@entry
def observe(height, job: Job, machine, cell, view: View, remaining, time_left, sight: Sight):
    """Fill the arrays of `sight` from height[rows, cols] and the machine's record; shares `remaining`, `time_left`."""
    ground, pose = measured_ground(height, sight.noise), measured_machine(machine, height, cell, sight.noise)[0]
    facing = facing_of(pose.heading)
    fill_patch(ground, job, pose, facing, cell, view, sight.patch)
    _fill_pose(job, pose, facing, view, remaining, time_left, sight.pose)
    fill_overview(ground, job, pose, cell, view, sight.overview)
    fill_map(ground, job, sight.map)


@kernel
def measured_ground(height, noise):
    """The ground as the machine measures it; without noise the very same array."""
    if noise is None:
        return height
    for r in range(height.shape[0]):
        for c in range(height.shape[1]):
            noise.ground[r, c] = height[r, c] + noise.height[r, c]
    return noise.ground


@kernel
def measured_machine(machine, height, cell, noise):
    """The machine's record as it measures itself, never outside the site; without noise the very same."""
    if noise is None:
        return machine
    noise.machine[0] = machine[0]
    rows, cols = height.shape
    pose = noise.machine[0]
    pose.x = min(max(pose.x + noise.pose[0], 0.0), cols * cell)
    pose.y = min(max(pose.y + noise.pose[1], 0.0), rows * cell)
    pose.heading += noise.pose[2]
    return noise.machine


@kernel
def _fill_pose(job, pose, facing, view, remaining, time_left, out):
    """Write the entries in the order of POSE_ENTRIES, scaled and clipped."""
    distance, east, north = _to_goal(job.centers, pose.x, pose.y)
    ahead, left = facing
    values = (
        pose.x,
        pose.y,
        left,
        ahead,
        pose.edge,
        pose.speed,
        pose.yaw_rate,
        pose.pitch,
        pose.roll,
        pose.load,
        east * ahead + north * left,
        north * ahead - east * left,
        distance,
        remaining,
        time_left,
    )
    for i in range(len(values)):
        out[i] = min(max((values[i] - view.offset[i]) / view.scale[i], view.low[i]), view.high[i])


@kernel
def _to_goal(centers, x, y):
    """Distance [m] and direction (unit vector east, north) to the nearest goal's centre; no direction at distance 0."""
    nearest = 0
    for i in range(1, centers.shape[0]):
        if hypot(centers[i, 0] - x, centers[i, 1] - y) < hypot(centers[nearest, 0] - x, centers[nearest, 1] - y):
            nearest = i
    east, north = centers[nearest, 0] - x, centers[nearest, 1] - y
    distance = hypot(east, north)
    share = 1.0 / distance if distance > 0.0 else 0.0
    return distance, east * share, north * share
