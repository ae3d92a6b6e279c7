"""Numbers of behaviours as TOML: the shipped ones in `configs/policy`, and files of somebody's own.

A file has a number a line, `name = value`. Tables `[voxel]`, `[traction]` and `[noise]` are laid over them in scenes
with that terrain, with traction, or whose observations have noise. A file of one's own may leave out whatever is to be
as shipped. Later ones count: shipped numbers, shipped tables, numbers of one's own, tables of one's own.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import Field, fields
from pathlib import Path
from typing import Any, TypeVar

from dirt_env.config import SceneConfig
from dirt_env.config.loading import scene_folder

from .parameters import (
    GradeParameters,
    GreedyParameters,
    Parameters,
    PassPlannerParameters,
    PlannerParameters,
    Pushing,
    SlotParameters,
    range_of,
    unit_of,
)

Kind = TypeVar("Kind", bound=Pushing)
FILES: dict[type[Pushing], str] = {
    Parameters: "adaptive_push",
    GreedyParameters: "greedy",
    GradeParameters: "grade",
    SlotParameters: "slot",
    PlannerParameters: "planner",
    PassPlannerParameters: "planner_passes",
}
WHEN = {
    "voxel": lambda config: config.terrain.kind == "voxel",
    "traction": lambda config: config.traction is not None,
    "noise": lambda config: config.observation.noise is not None,
}


def shipped(kind: type[Kind], **changes: float) -> Kind:
    """The shipped numbers of a kind for a scene without anything special, with some changed."""
    return kind(**{**_written(_file(kind), kind)[0], **changes})


def numbers_for(kind: type[Kind], config: SceneConfig, own: str | Path | None = None) -> Kind:
    """The numbers of a kind for a scene: as shipped, with those of a file of one's `own` laid over them.

    Raises ValueError with the file, the name, the value and what is allowed.
    """
    found: dict[str, Any] = {}
    for path in [_file(kind), *([] if own is None else [_path(own)])]:
        always, special = _written(path, kind)
        found |= always
        for name, holds in WHEN.items():
            if holds(config):
                found |= special.get(name, {})
        try:
            numbers = kind(**found)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
    return numbers


def write(numbers: Pushing, about: str, own: str | Path | None = None) -> str:
    """A file of one's own, as TOML, after which the numbers are these in scenes without anything special.

    It has what differs from the shipped numbers or is written in the file `own` that they began from. What tables say
    still counts: those of `own` are kept, and so is what the shipped ones say of a number that is written and was not
    in `own`. `about` says in a line where the numbers come from.
    """
    kind = type(numbers)
    always, special = _written(_file(kind), kind)
    before, before_special = ({}, {}) if own is None else _written(_path(own), kind)
    entries = {entry.name: entry for entry in fields(kind)}
    named = [name for name in entries if name in before or getattr(numbers, name) != always[name]]
    lines = [f"# {about}", *(line_of(entries[name], getattr(numbers, name)) for name in named)]
    for table in WHEN:
        kept = {name: value for name, value in special.get(table, {}).items() if name in named and name not in before}
        if kept := kept | before_special.get(table, {}):
            lines += ["", f"[{table}]", *(line_of(entries[name], value) for name, value in kept.items())]
    return "\n".join(lines) + "\n"


def line_of(entry: Field, value: float) -> str:
    """A number as a line of TOML, with its unit and range."""
    least, most = range_of(entry)
    unit = f"{unit_of(entry)}, " if unit_of(entry) else ""
    return f"{entry.name} = {float(value)!r}  # {unit}{least:g} to {most:g}"


def numbers_folder() -> Path:
    """Where the shipped numbers are."""
    return scene_folder().with_name("policy")


def _file(kind: type[Pushing]) -> Path:
    return numbers_folder() / f"{FILES[kind]}.toml"


def _path(own: str | Path) -> Path:
    return Path(own).expanduser()


def _written(path: Path, kind: type[Pushing]) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Numbers of a file, and its tables; ValueError for what is no number of that kind."""
    if not path.is_file():
        raise ValueError(f"{path} is no file; allowed: a .toml file with numbers, such as those in {numbers_folder()}")
    try:
        written = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is no TOML: {error}") from None
    special = {name: table for name, table in written.items() if name in WHEN}
    always = {name: value for name, value in written.items() if name not in WHEN}
    for where, table in {"": always, **special}.items():
        _check_names(path, where, table, kind)
    return always, special


def _check_names(path: Path, where: str, table: Any, kind: type[Pushing]) -> None:
    """Raise ValueError for a table that is none, or that has a name which is no parameter of the kind."""
    if not isinstance(table, Mapping):
        raise ValueError(f"{path}: {where} is {table!r}; allowed: a table of numbers, [{where}]")
    names = [entry.name for entry in fields(kind)]
    for name in table:
        if name not in names:
            at = f"{where}.{name}" if where else name
            tables = ", ".join(f"[{other}]" for other in WHEN)
            able = [f"{file}.toml" for other, file in FILES.items() if name in (entry.name for entry in fields(other))]
            hint = f" (it is a number of {', '.join(able)})" if able else ""
            raise ValueError(f"{path}: unknown {at}{hint}; allowed: {', '.join(names)}; tables {tables}")
