"""From a name, a TOML file or a mapping to a checked scene."""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches
from math import floor
from pathlib import Path
from typing import Any

from dirt_env.config import consistency, episode
from dirt_env.config.rules import Rule, join, known_keys
from dirt_env.config.scene import FIELDS, SceneConfig
from dirt_env.config.soils import SOIL
from dirt_env.config.tables import POSE, SCENE, Action, Observation, Reward, Site, Task
from dirt_env.config.terrain import HeightField
from dirt_env.scene import survey
from dirt_env.scene.ground import Flat
from dirt_env.scene.sampling import LEVELS
from dirt_env.scene.survey import HeightFile
from dirt_env.sim.params import Blade, Machine

PACKAGE = Path(__file__).resolve().parents[1]
TOP_LEVEL = (*SCENE, "level", "levels")
FIXED = ("start", "goal", "design", "obstacle", "hollow", "vary")


def load(scene: str | Path | Mapping[str, Any] = "heap", **overrides: Any) -> SceneConfig:
    """A checked scene: the name of a shipped one, path of a TOML file, or mapping; `overrides` are merged over it.

    Tables are merged key by key, lists and tables of another `kind` are replaced, and None takes a key out. A relative
    `path` begins in the file's folder if it is written there, in the current folder if it is in `overrides`. Starts,
    goals, hollows, a design, obstacles or `vary` in `overrides` take the place of a random layout. Raises ValueError
    that names the key, its value and what is allowed; keys and values of levels that are not asked for count, too.
    """
    _check_taken_out(overrides, {**dict.fromkeys(TOP_LEVEL), **SCENE})
    overrides = paths_from(Path.cwd(), overrides)
    name, folder, written = _written(scene)
    survey.forget()  # a file may have changed since it was last loaded
    episode.plan.cache_clear()
    if written.get("levels"):
        written, overrides = _at_level(name, folder, written, overrides)
    elif any(overrides.get(key) for key in FIXED):  # own regions take the place of a random layout
        written = {key: value for key, value in written.items() if key not in ("level", "layout")}
    config = _build(name, folder, _with_level(merge(written, overrides)))
    consistency.check(config)
    return replace(config, task=replace(config.task, time=config.task.time or consistency.nominal_time(config)))


def scene_names() -> tuple[str, ...]:
    """Names of the shipped scenes."""
    return tuple(sorted(path.stem for path in scene_folder().glob("*.toml")))


def scene_folder() -> Path:
    """Where the shipped scenes are: inside the installed package, or in the checkout it lies in."""
    installed = PACKAGE / "configs" / "scene"
    return installed if installed.is_dir() else PACKAGE.parent / "configs" / "scene"


def paths_from(folder: Path, written: Any) -> Any:
    """The same plain values with all paths absolute, relative ones, under a key `path`, from the folder on."""
    if isinstance(written, Mapping):
        return {
            key: str(folder / Path(value).expanduser())
            if key == "path" and isinstance(value, str | Path) and str(value)
            else paths_from(folder, value)
            for key, value in written.items()
        }
    return [paths_from(folder, value) for value in written] if isinstance(written, list) else written


def merge(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """`above` laid over `below`: tables key by key, unless their `kind` differs or there is another `preset`.

    None takes a key out.
    """
    result = dict(below)
    for key, value in above.items():
        old = result.get(key)
        if isinstance(value, Mapping) and key == "terrain" and isinstance(old, str):
            old = {"kind": old}
        if value is None:
            result.pop(key, None)
        elif (
            isinstance(value, Mapping)
            and isinstance(old, Mapping)
            and not (key == "soil" and value.get("preset"))
            and value.get("kind", old.get("kind")) == old.get("kind")
        ):
            result[key] = merge(old, value)
        else:
            result[key] = value
    return result


def _written(scene: str | Path | Mapping[str, Any]) -> tuple[str, Path, Mapping[str, Any]]:
    """Name, folder for relative paths, and the tables as written."""
    if isinstance(scene, Mapping):
        return "custom", Path.cwd(), scene
    if not isinstance(scene, str | Path):
        raise ValueError(f"scene is {scene!r}; allowed: a name, a path of a TOML file, or a mapping")
    path = Path(scene).expanduser()
    if isinstance(scene, str) and path.suffix != ".toml":
        if scene not in scene_names():
            close = get_close_matches(scene, scene_names(), n=1)
            hint = f" (did you mean {close[0]}?)" if close else ""
            raise ValueError(
                f"scene is {scene!r}{hint}; allowed: {', '.join(scene_names())}, or the path of a .toml file"
            )
        path = scene_folder() / f"{scene}.toml"
    if not path.is_file():
        raise ValueError(
            f"scene {path} is no file; allowed: the path of a .toml file, or one of {', '.join(scene_names())}"
        )
    try:
        written = tomllib.loads(path.read_text(encoding="utf-8"))
        known_keys(written, "", dict.fromkeys(TOP_LEVEL))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"scene {path} is no TOML: {error}") from None
    except ValueError as error:
        raise ValueError(f"scene {path}: {error}") from None
    return path.stem, path.resolve().parent, written


def _check_taken_out(overrides: Mapping[str, Any], rules: Mapping[str, Rule | None], key: str = "") -> None:
    """An error for a key that None is to take out, and that no scene has: merging would not miss it."""
    for name, value in overrides.items():
        if value is None:
            known_keys({name: None}, key, rules)
        elif isinstance(value, Mapping) and rules.get(name) is not None:
            pose = {"pose": POSE} if name == "machine" else {}
            _check_taken_out(value, {**rules[name].keys(), **pose}, join(key, name))


def _at_level(
    name: str, folder: Path, written: Mapping[str, Any], overrides: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """A scene with `levels` of its own as it is at the level that is asked for, and the other overrides.

    Keys and values of all levels are checked; what goes together with what, only of the one that is made.
    """
    levels = written["levels"]
    if not isinstance(levels, list) or not all(isinstance(table, Mapping) for table in levels):
        raise ValueError(f"levels is {levels!r}; allowed: an array of tables, [[levels]]")
    for i, table in enumerate(levels):
        known_keys(table, f"levels[{i}]", SCENE)
    level = overrides.get("level", written.get("level", 0))
    if type(level) is not int or not 0 <= level < len(levels):
        raise ValueError(f"level is {level!r}; allowed: 0 to {len(levels) - 1}")
    base = {key: value for key, value in written.items() if key not in ("level", "levels")}
    for i, table in enumerate(levels):
        try:
            _build(name, folder, _with_level(merge(base, table)))
        except ValueError as error:
            raise ValueError(f"levels[{i}]: {error}") from error
    return merge(base, levels[level]), {key: value for key, value in overrides.items() if key != "level"}


def _with_level(written: Mapping[str, Any]) -> dict[str, Any]:
    """`level` at the top is short for `layout.level`; a scene with nothing fixed has a random layout."""
    known_keys(written, "", dict.fromkeys(TOP_LEVEL))
    result = {key: value for key, value in written.items() if key not in ("level", "levels")}
    fixed = [key for key in FIXED if result.get(key)]
    if "level" in written:
        if fixed:
            raise ValueError(
                f"level is {written['level']!r}, but the scene has its own {' and '.join(fixed)}; allowed: levels 0 to "
                f"{len(LEVELS) - 1} for scenes with a random layout, such as heap, or those that a scene lists as "
                "[[levels]]"
            )
        result["layout"] = {**result.get("layout", {}), "level": written["level"]}
    elif not fixed:
        result.setdefault("layout", {})
    return result


def _build(name: str, folder: Path, written: dict[str, Any]) -> SceneConfig:
    """Each table read by its rules; what is left out has its default."""
    machine = written.get("machine", {})
    pose = (
        POSE.read(machine["pose"], "machine.pose", folder)
        if isinstance(machine, Mapping) and "pose" in machine
        else None
    )
    if pose is not None:
        written = {**written, "machine": {key: value for key, value in machine.items() if key != "pose"}}
    read = {FIELDS.get(key, key): SCENE[key].read(value, key, folder) for key, value in written.items()}
    if pose is not None and "layout" in read:
        raise ValueError(f"machine.pose is {pose!r}, but the layout is random; say layout.machine instead")
    defaults = {
        "name": name,
        "description": "",
        "site": Site(),
        "ground": Flat(),
        "terrain": HeightField(),
        **read.pop("earth", SOIL.make())._asdict(),
        "zones": (),
        "blade": Blade(),
        "machine": Machine(),
        "traction": None,
        "pose": pose or "behind",
        "starts": (),
        "goals": (),
        "hollows": (),
        "design": None,
        "obstacles": (),
        "vary": None,
        "layout": None,
        "task": Task(),
        "action": Action(),
        "observation": Observation(),
        "reward": Reward(),
    }
    config = SceneConfig(**{**defaults, **read})
    if isinstance(config.ground, HeightFile):
        config = replace(config, site=_site_of(config.ground, config.site, written.get("site", {})))
    resolution = config.observation.resolution or config.site.cell
    return replace(config, observation=replace(config.observation, resolution=resolution))


def _site_of(ground: HeightFile, site: Site, written: Mapping[str, Any]) -> Site:
    """The site of a ground from a file: its size and cell are those of the file, or of the crop, unless given."""
    x0, y0, x1, y1, pixel = ground.extent(site.cell if "cell" in written else None)
    cell = site.cell if "cell" in written else pixel
    whole = (x1 - x0, y1 - y0)
    if "size" not in written:
        return replace(site, size=tuple(floor(length / cell + 1e-6) * cell for length in whole), cell=cell)
    if any(asked > there + 1e-6 for asked, there in zip(site.size, whole, strict=True)):
        raise ValueError(
            f"{join('site', 'size')} is {list(site.size)} m; allowed: at most {list(whole)} m, what the file covers"
        )
    if ground.crop and any(abs(asked - there) > 1e-6 for asked, there in zip(site.size, whole, strict=True)):
        raise ValueError(
            f"site.size is {list(site.size)} m and ground.crop covers {list(whole)} m; allowed: leave one out"
        )
    return replace(site, cell=cell)
