"""Worlds and their episodes in the arrays of one batch: put in, stepped, shown, taken out. No Gymnasium in it."""

from collections.abc import Callable, Sequence
from math import radians
from typing import Any, NamedTuple

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.config.terrain import HeightField
from dirt_env.crew import cores
from dirt_env.episode import Episode
from dirt_env.observer import Observer
from dirt_env.scene.layout import Layout
from dirt_env.sim.jit import compile_aside, machine_code
from dirt_env.sim.params import Command
from dirt_env.sim.state import POSE, World, work_space
from dirt_env.sim.voxel_advance import VoxelWorld, advance_voxels
from dirt_env.task.actions import command_of, read_action
from dirt_env.task.batch import COLUMNS, SCENE, Batch, Scratch, Totals, make_batch
from dirt_env.task.goal import Remaining
from dirt_env.task.job import Job
from dirt_env.task.observation import Noise, Sight, View
from dirt_env.task.reward import TERMS, scale_of
from dirt_env.task.step import ADVANCE, BOOK, FIGURES, SHOW, step_worlds, take_up
from dirt_env.terrain import AnyWorld

UNREACHED_ERROR, UNREACHED_SHARE = -1.0, np.inf  # of a scene that does not go by it
# What of a batch is no array, or not of an episode.
APART = ("job", "scenes", "channels", "pulls", "grade", "soils", "zone_pulls", "sums")
BUSY = np.zeros(1, bool)  # one world that is not idle
ALONE = np.zeros(2, np.int64), 0  # turns of one thread, and its number


class Worlds:
    """As many worlds as there are `configs`, which have the same features (see `features`).

    `batch` holds their arrays, `layouts` what their episodes started from, None before the first `put`; `noise` what
    they measure wrong, None in scenes without.
    """

    def __init__(self, configs: Sequence[SceneConfig]) -> None:
        first = configs[0]
        self.configs = tuple(configs)
        self.observer = Observer(first)
        self.batch = make_batch(
            len(configs),
            first.grid.rows,
            first.grid.cols,
            walls=first.has_walls,
            open_border=first.site.border == "open",
            channels=self.observer.view.channels,
            traction=first.traction is not None,
            grade_control=first.action.blade == "grade",
            swell=first.soil.swell > 0.0,
            soils=1 + max(len(config.zones) for config in configs),
        )
        views = {config: Observer(config).view for config in dict.fromkeys(configs)}
        for i, config in enumerate(configs):
            _write_scene(self.batch.scenes[i], config, views[config])
            if config.pull is not None:
                self.batch.pulls[i] = tuple(config.pull)
            if config.zones:
                _write_zones(self.batch, i, config)
        self.noise = None if first.observation.noise is None else _make_noise(self.batch.height)
        self.layouts: list[Layout | None] = [None] * len(configs)
        self._cells: list[dict[str, Any]] = [{} for _ in configs]  # what a VoxelWorld has and a World has not
        self._is_field = isinstance(first.terrain, HeightField)
        self._scratch: list[Scratch] = []
        self._codes: dict[Callable, Callable] = {}
        self._is_prepared = False

    def prepare(self) -> None:
        """Have a step compiled on another core, if there is one, while this one compiles what comes before it."""
        if self._is_prepared:
            return
        self._is_prepared = True
        if cores() > 1:
            scratch, (_, sight) = self.scratch(0) if self._is_field else None, self._blank(0)
            figures = np.empty((len(FIGURES), 1))
            compile_aside(
                step_worlds, self.batch, scratch, np.empty((1, 3)), BUSY, sight, figures, 0, 1, 0, ADVANCE, *ALONE
            )

    def run(self, entry: Callable, *arguments: Any) -> Any:
        """Call an entry of `task.step` with the batch and these arguments, whose types are the same in every call."""
        code = self._codes.get(entry)
        if code is None:
            code = self._codes[entry] = machine_code(entry, self.batch, *arguments)
        return code(self.batch, *arguments)

    def scratch(self, thread: int) -> Scratch:
        """The work space of a thread."""
        while len(self._scratch) <= thread:
            self._scratch.append(Scratch(**work_space(self.batch.height[0])))
        return self._scratch[thread]

    def put(self, index: int, episode: Episode) -> None:
        """Copy an episode into the batch; world `index` goes on from there."""
        self._make_room(len(episode.job.centers))
        batch, centers = self.batch, episode.job.centers
        _fill(batch, index, episode.world)
        _fill(batch.job._replace(centers=None), index, episode.job)
        batch.job.centers[index, : len(centers)] = centers
        _write_episode(batch.episodes[index], self.configs[index], episode)
        self.layouts[index] = episode.layout
        if batch.zone is not None:
            batch.zone[index] = episode.layout.zone
        cells = {} if self._is_field else episode.world._asdict()
        self._cells[index] = {name: part for name, part in cells.items() if name not in Batch._fields}
        self.run(take_up, index, index + 1)

    def episode(self, index: int) -> Episode:
        """The episode of world `index`; its arrays are those of the batch, its numbers those of now."""
        batch, record = self.batch, self.batch.episodes[index]
        parts = {name: None if array is None else array[index] for name, array in batch.job._asdict().items()}
        parts["centers"] = parts["centers"][: record["centers"]]
        job = Job(**{name: float(part) if isinstance(part, np.floating) else part for name, part in parts.items()})
        start, totals = Remaining(*record["start"].item()), Totals(*record["totals"].item())
        remaining = Remaining(*batch.sums.result[index].tolist())
        return Episode(self.layouts[index], self._world(index), job, start, totals, remaining)

    def copy(self, sources: Sequence[int], targets: Sequence[int]) -> None:
        """Let worlds `targets` be as worlds `sources` are, one for one; ValueError where their scenes differ."""
        for source, target in zip(sources, targets, strict=True):
            one, other = self.configs[source], self.configs[target]
            if one is not other and one != other:
                raise ValueError(f"worlds {source} and {target} have different scenes; allowed: copies of the same")
        layouts = [self.layouts[source] for source in sources]
        new = [k for k, target in enumerate(targets) if self.layouts[target] is not layouts[k]]
        parts = [(array, sources, targets) for name, array in self.batch._asdict().items() if name not in APART]
        parts += [(array, sources, targets) for array in self.batch.sums]
        parts += [(array, [sources[k] for k in new], [targets[k] for k in new]) for array in self.batch.job]
        for array, wanted, there in parts:
            if array is not None:
                array[there] = array[wanted]
        for target, layout in zip(targets, layouts, strict=True):
            self.layouts[target] = layout

    def perturb(self, index: int, generator: np.random.Generator) -> None:
        """Draw anew what world `index` of a scene with noise measures wrong."""
        size = self.configs[index].observation.noise
        spread = size.position, size.position, radians(size.heading)
        if size.height > 0.0:  # a number for each cell takes longer than all the rest of a step
            self.noise.height[index] = size.height * generator.standard_normal(self.batch.height[0].shape, np.float32)
        self.noise.pose[index] = spread * generator.standard_normal(3)

    def blanks(self) -> tuple[dict[str, np.ndarray], Sight]:
        """New arrays for the observations of all worlds, by name; and the same for the kernels."""
        seen, sight = self.observer.blanks(len(self.configs))
        return seen, sight._replace(noise=self.noise)

    def step(
        self, index: int, action: Any, generator: np.random.Generator | None = None
    ) -> tuple[dict[str, np.ndarray], list[float]]:
        """One control step of one world: observation and FIGURES; ValueError, and nothing changes, for a bad action.

        With a generator, what it measures wrong is drawn anew.
        """
        values = read_action(action)
        if generator is not None:
            self.perturb(index, generator)
        seen, sight = self._blank(index)
        figures = np.empty((len(FIGURES), 1))
        if self._is_field:
            actions = np.empty((1, 3))
            actions[0] = values
            scratch = self.scratch(0)
            self.run(step_worlds, scratch, actions, BUSY, sight, figures, index, index + 1, index, ADVANCE, *ALONE)
        else:
            self._step_cells(index, command_of(*values.tolist(), self.configs[index].machine))
            self.step_from(BOOK, sight, figures, index, index + 1, index)
        return seen, figures[:, 0].tolist()

    def step_from(self, phase: int, sight: Sight, figures: np.ndarray, first: int, last: int, base: int) -> None:
        """`step_worlds` from a phase on that needs no actions: BOOK or SHOW."""
        scratch, count = self.scratch(0) if self._is_field else None, figures.shape[1]
        actions, idle = np.empty((count, 3)), np.zeros(count, bool)
        self.run(step_worlds, scratch, actions, idle, sight, figures, first, last, base, phase, *ALONE)

    def look(self, index: int) -> tuple[dict[str, np.ndarray], list[float]]:
        """Observation and FIGURES of one world as it is."""
        seen, sight = self._blank(index)
        figures = np.empty((len(FIGURES), 1))
        self.step_from(SHOW, sight, figures, index, index + 1, index)
        return seen, figures[:, 0].tolist()

    def _blank(self, index: int) -> tuple[dict[str, np.ndarray], Sight]:
        """New arrays for the observation of one world."""
        seen, sight = self.observer.blank()
        if self.noise is not None:
            sight = sight._replace(noise=Noise(*(part[index : index + 1] for part in self.noise)))
        return seen, sight

    def _step_cells(self, index: int, command: Command) -> None:
        """Advance a world of cells."""
        config = self.configs[index]
        rules, pace = config.terrain.rules_for(config.grid, config.soil), float(config.terrain.updates_per_second)
        constants = config.grid, config.soil, config.blade, config.machine, rules, pace
        advance_voxels(self._world(index), *constants, command, config.task.period)

    def _world(self, index: int) -> AnyWorld:
        """One world; its arrays are those of the batch."""
        batch, solid, outside = self.batch, self.batch.solid, self.batch.outside
        shared = {
            "height": batch.height[index],
            "solid": None if solid is None else solid[index],
            "outside": None if outside is None else outside[index],
            "machine": batch.machine[index : index + 1],
            "tally": batch.tally[index : index + 1],
            "changed": batch.changed[index],
        }
        if not self._is_field:
            return VoxelWorld(**shared, **self._cells[index])
        quantum = float(batch.episodes[index].quantum)
        bank = {} if batch.bank is None else {"bank": batch.bank[index], "natural": batch.natural[index]}
        return World(**shared, pending=batch.pending[index], quantum=quantum, **self.scratch(0)._asdict(), **bank)

    def _make_room(self, centers: int) -> None:
        """Let the jobs have that many goals."""
        job = self.batch.job
        if centers > job.centers.shape[1]:
            wider = np.zeros((len(job.centers), centers, 2))
            wider[:, : job.centers.shape[1]] = job.centers
            self.batch = self.batch._replace(job=job._replace(centers=wider))

    def __getstate__(self) -> dict[str, Any]:
        """What pickle and deepcopy take along: everything but the work space and the machine code."""
        return {**self.__dict__, "_scratch": [], "_codes": {}}


def _make_noise(height: np.ndarray) -> Noise:
    """Arrays for what worlds with the ground height[n, rows, cols] measure wrong: nothing yet."""
    return Noise(np.zeros_like(height), np.zeros((len(height), 3)), np.zeros_like(height), np.zeros(len(height), POSE))


def _write_scene(record: np.record, config: SceneConfig, view: View) -> None:
    """Write the constants of a scene into a SCENE record."""
    for name in ("soil", "blade", "machine"):
        record[name] = tuple(getattr(config, name))
    record["eye"] = tuple(getattr(view, name) for name in SCENE["eye"].names)
    record["columns"] = [getattr(view, name) for name in COLUMNS]
    task = config.task
    record["cell"], record["period"], record["time"] = config.grid.cell, task.period, task.time
    by_design = config.design is not None
    record["tolerance"] = config.design.tolerance if by_design else UNREACHED_ERROR
    record["success"] = UNREACHED_SHARE if by_design else task.success
    record["weights"] = [getattr(config.reward, name) for name in TERMS]


def _write_zones(batch: Batch, index: int, config: SceneConfig) -> None:
    """Write the soils of a scene into the tables of a batch; unused rows repeat the scene's own."""
    soils, pulls = config.zone_tables
    batch.soils[index] = soils[0]
    batch.soils[index, : len(soils)] = soils
    if pulls is not None:
        batch.zone_pulls[index] = pulls[0]
        batch.zone_pulls[index, : len(pulls)] = pulls


def _write_episode(record: np.record, config: SceneConfig, episode: Episode) -> None:
    """Write the numbers of an episode into an EPISODE record; `take_up` finds out whether it is finished."""
    task, soil = config.task, episode.job.soil
    record["quantum"] = getattr(episode.world, "quantum", 0.0)
    record["centers"] = len(episode.job.centers)
    record["scale"] = tuple(scale_of(episode.start, config.soil, soil, task.period, task.time))
    record["start"], record["totals"] = tuple(episode.start), tuple(episode.totals)


def _fill(arrays: NamedTuple, index: int, values: NamedTuple) -> None:
    """Copy the values into the arrays of the same names, at that index; what is None on one side counts as zeros."""
    for name, array in arrays._asdict().items():
        if isinstance(array, np.ndarray) and hasattr(values, name):
            value = getattr(values, name)
            array[index : index + 1] = 0 if value is None else value
