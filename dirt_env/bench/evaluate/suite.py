"""Suites: which jobs at which levels a policy is judged by. TOML files, shipped in configs/bench."""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dirt_env.config import SceneConfig, load
from dirt_env.config.loading import paths_from, scene_folder

SUITE_KEYS = {"description": str, "include": list, "job": list}
JOB_KEYS = {"name": str, "scene": str, "levels": list, "steps": int, "set": dict, "without": list}


@dataclass(frozen=True)
class Task:
    """One job at one level: what an episode is played in.

    `job`, `level` (None where a scene has no levels) name it; `scene` and `overrides` make the environment; `steps`
    bound an episode, None for the job's nominal time.
    """

    job: str
    level: int | None
    scene: str
    overrides: Mapping[str, Any] = field(default_factory=dict)
    steps: int | None = None

    @property
    def name(self) -> str:
        """The name of the task: a name with the level, as in `heap 2`."""
        return self.job if self.level is None else f"{self.job} {self.level}"

    def config(self) -> SceneConfig:
        """The scene; ValueError where it is no good."""
        return load(self.scene, **self.overrides)

    def written(self) -> dict[str, Any]:
        """Plain values, from which `Task(**written)` is made again."""
        return {**vars(self), "overrides": dict(self.overrides)}


@dataclass(frozen=True)
class Suite:
    """A named, ordered set of tasks."""

    name: str
    description: str
    tasks: tuple[Task, ...]


def suite_names() -> tuple[str, ...]:
    """Names of the shipped suites."""
    return tuple(sorted(path.stem for path in _folder().glob("*.toml")))


def load_suite(name: str | Path, steps: int | None = None) -> Suite:
    """The shipped suite of that name, or a TOML file; `steps` bounds all episodes.

    Raises ValueError that names the key, its value and what is allowed.
    """
    path = _path(name)
    written = _read(path)
    tasks = list(_tasks(path, written, ()))
    names = [task.name for task in tasks]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"suite {path} has the job {', '.join(twice)} twice; allowed: once, or another `name` for it")
    if not tasks:
        raise ValueError(f"suite {path} has no [[job]]; allowed: one or more, or include = [other suites]")
    if steps is not None:
        tasks = [Task(**{**task.written(), "steps": steps}) for task in tasks]
    for task in tasks:
        try:
            task.config()
        except ValueError as error:
            raise ValueError(f"suite {path}, job {task.name}: {error}") from error
    return Suite(path.stem, written.get("description", ""), tuple(tasks))


def _folder() -> Path:
    return scene_folder().parent / "bench"


def _path(name: str | Path) -> Path:
    path = Path(name).expanduser()
    if path.suffix == ".toml":
        if not path.is_file():
            raise ValueError(f"suite {path} is no file; allowed: a .toml file, or one of {', '.join(suite_names())}")
        return path
    if str(name) not in suite_names():
        raise ValueError(f"suite is {str(name)!r}; allowed: {', '.join(suite_names())}, or the path of a .toml file")
    return _folder() / f"{name}.toml"


def _read(path: Path) -> dict[str, Any]:
    try:
        written = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"suite {path} is no TOML: {error}") from None
    _known(written, SUITE_KEYS, f"suite {path}")
    for job in written.get("job", []):
        _known(job, JOB_KEYS, f"suite {path}, job")
        if "scene" not in job:
            raise ValueError(
                f"suite {path}: a job has no `scene`; allowed: the name of a scene or the path of its file"
            )
    return written


def _known(table: Any, keys: Mapping[str, type], where: str) -> None:
    """Raise ValueError for a key or a type of value that is not known."""
    if not isinstance(table, Mapping):
        raise ValueError(f"{where} is {table!r}; allowed: a table with {', '.join(keys)}")
    for key, value in table.items():
        if key not in keys:
            raise ValueError(f"{where} has the key {key!r}; allowed: {', '.join(keys)}")
        if type(value) is not keys[key]:
            raise ValueError(f"{where}: {key} is {value!r}; allowed: a TOML {keys[key].__name__}")


def _tasks(path: Path, written: Mapping[str, Any], above: tuple[Path, ...]) -> Iterator[Task]:
    """Tasks of a suite, those of the suites that it includes first."""
    if path.resolve() in above:
        raise ValueError(f"suite {path} includes itself")
    for other in written.get("include", []):
        found = path.parent / other if str(other).endswith(".toml") else other
        inner = _path(found)
        yield from _tasks(inner, _read(inner), (*above, path.resolve()))
    for job in written.get("job", []):
        yield from _tasks_of(job, path)


def _tasks_of(job: Mapping[str, Any], path: Path) -> Iterator[Task]:
    """A task for each level of a [[job]]."""
    scene, steps = job["scene"], job.get("steps")
    if scene.endswith(".toml"):
        scene = str((path.parent / scene).resolve())
    if steps is not None and steps < 1:
        raise ValueError(f"suite {path}, job: steps is {steps}; allowed: 1 or more")
    levels = job.get("levels", [None])
    if not levels or any(level is not None and type(level) is not int for level in levels):
        raise ValueError(f"suite {path}, job: levels is {levels!r}; allowed: a list of whole numbers")
    overrides = paths_from(path.resolve().parent, _copy(job.get("set", {})))
    for key in job.get("without", []):
        _leave_out(overrides, str(key))
    for level in levels:
        leveled = overrides if level is None else {**overrides, "level": level}
        yield Task(job.get("name", Path(scene).stem), level, scene, leveled, steps)


def _leave_out(overrides: dict[str, Any], key: str) -> None:
    """Say None for a dotted key, which takes it out of the scene."""
    *tables, last = key.split(".")
    for table in tables:
        overrides = overrides.setdefault(table, {})
    overrides[last] = None


def _copy(value: Any) -> Any:
    return {key: _copy(part) for key, part in value.items()} if isinstance(value, dict) else value
