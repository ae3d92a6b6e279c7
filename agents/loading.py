"""From a TOML file, or the name of a shipped one, to the checked settings of a training run."""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from dirt_env.config.loading import merge, paths_from, scene_folder
from dirt_env.config.rules import known_keys

from .consistency import check
from .hyperparameters import ALGORITHMS
from .settings import NO_TEACHER, TRAINING, Settings, Teacher


def load_settings(path: Path, overrides: Mapping[str, Any]) -> Settings:
    """The checked settings of a file, or of a shipped one by its name, with `overrides` merged over it.

    Raises ValueError that names the key, its value and what is allowed.
    """
    path = settings_file(path, "train")
    written = read_file(path, overrides)
    known_keys(written, "", TRAINING.rules)
    settings = replace(_completed(TRAINING.read(written, "", path.parent)), name=path.stem)
    if settings.teacher.policy == NO_TEACHER:
        settings = replace(settings, teacher=Teacher())
    check(settings)
    return settings


def _from_here(overrides: Mapping[str, Any]) -> Mapping[str, Any]:
    """Overrides whose files, a scene's or those that it names, are looked for from here, not from the settings'."""
    worlds = overrides.get("worlds")
    if not isinstance(worlds, Mapping):
        return overrides
    worlds, scene = paths_from(Path.cwd(), worlds), worlds.get("scene")
    if isinstance(scene, str) and scene.endswith(".toml"):
        worlds["scene"] = str(Path(scene).expanduser().absolute())
    return {**overrides, "worlds": worlds}


def settings_file(path: Path, shelf: str) -> Path:
    """The file, or the one of that name that is shipped in configs/`shelf`; ValueError if there is neither."""
    if path.is_file():
        return path
    shipped = {found.stem: found for found in sorted((scene_folder().parent / shelf).glob("*.toml"))}
    if str(path) not in shipped:
        raise ValueError(f"config {path} is no file; allowed: a TOML file, or a shipped one: {', '.join(shipped)}")
    return shipped[str(path)]


def read_file(path: Path, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """What a settings file says, with `overrides` merged over it; ValueError if it is no TOML."""
    try:
        written = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"config {path} is no TOML: {error}") from None
    return merge(written, _from_here(overrides))


def _completed(settings: Settings) -> Settings:
    """With the table of the algorithm, all defaults if it was left out; ValueError if another one's is there."""
    name = settings.algorithm
    for other in ALGORITHMS:
        if other != name and getattr(settings, other) is not None:
            raise ValueError(
                f"{other} is a table for another algorithm than {name}; allowed: a table {name} (or none), "
                f'or algorithm = "{other}"'
            )
    return replace(settings, **{name: getattr(settings, name) or ALGORITHMS[name].make()})
