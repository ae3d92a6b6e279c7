"""The settings of a training run: read from a TOML file, checked key by key, and written back as plain data."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from dirt_env.config import SceneConfig, load
from dirt_env.config.loading import merge, scene_folder
from dirt_env.config.rules import Choice, FilePath, Flag, Many, Number, Rule, Table, Text, Vector, known_keys, refuse
from dirt_env.policy import load_policy, needed
from dirt_env.split import SELECTION
from dirt_env.split import TRAINING as TRAINING_LAYOUTS
from dirt_env.task.observation import POSE_ENTRIES
from dirt_env.task.site_map import OVERVIEW

from .hyperparameters import ALGORITHMS, FROM_ONE, POSITIVE, SHARE, Ppo, Sac

OVERVIEW_GAIN = 5.0  # of the overview before the network: shares of all soil in a square are small numbers

FRAMES = Number(1, 16, whole=True)
WORLDS = Number(1, len(TRAINING_LAYOUTS), whole=True)  # each starts from a layout of its own


@dataclass(frozen=True)
class Worlds:
    """`count` worlds of a scene, with keys of the scene `set` anew; `threads` step them.

    Episodes are cut off after `steps` control steps; None is what the longest job of a stage takes. The network sees
    the last `frames` patches and poses side by side.
    """

    count: int = 256
    scene: str = "heap"
    set: Mapping[str, Any] = field(default_factory=dict)
    threads: int = 1
    steps: int | None = None
    frames: int = 1


@dataclass(frozen=True)
class Stage:
    """A stage of the curriculum: the worlds have these `levels` in turn, or the scene as it is where there are none.

    It ends when of each level's last episodes the share `success` did the whole job, or after `steps` of the
    environment; the last stage lasts to the end.
    """

    levels: tuple[int, ...] = ()
    success: float | None = None
    steps: int | None = None


@dataclass(frozen=True)
class Network:
    """Convolutions over the patch, then dense layers over their output and the pose; actor and critic share them."""

    filters: tuple[int, ...] = (8, 16)
    kernels: tuple[int, ...] = (4, 3)
    strides: tuple[int, ...] = (2, 2)
    features: int = 128
    hidden: tuple[int, ...] = (128,)


@dataclass(frozen=True)
class Teacher:
    """A scripted behaviour to begin from; without a `policy`, training begins from nothing.

    It plays `worlds` worlds of the last stage for `steps` steps in all, with normal errors of spread `noise` on its
    actions; the actor imitates it for `epochs` passes over that. Then PPO begins, for `critic_steps` steps with the
    critic alone, which knows nothing yet.
    """

    policy: str = ""
    worlds: int = 96
    steps: int = 250_000
    noise: float = 0.15
    epochs: int = 5
    batch_size: int = 512
    learning_rate: float = 1e-3
    critic_steps: int = 100_000


@dataclass(frozen=True)
class Normalise:
    """Whether pose entries and returns are divided by their running spread, and where they are clipped then."""

    pose: bool = True
    returns: bool = True
    clip: float = 10.0


@dataclass(frozen=True)
class Record:
    """How often, in steps of the environment, to evaluate and to save; `layouts` of selection for each of `levels`."""

    evaluate_every: int = 500_000
    levels: tuple[int, ...] = ()
    layouts: int = 16
    save_every: int = 250_000


@dataclass(frozen=True)
class Settings:
    """One training run by PPO or SAC, with the table of that alone. Made by `load_settings`, which checks it."""

    name: str = "training"
    description: str = ""
    steps: int = 10_000_000
    seed: int = 0
    device: str = "cpu"
    algorithm: str = "ppo"
    worlds: Worlds = Worlds()
    stages: tuple[Stage, ...] = (Stage(),)
    network: Network = Network()
    teacher: Teacher = Teacher()
    ppo: Ppo | None = None
    sac: Sac | None = None
    normalise: Normalise = Normalise()
    record: Record = Record()

    @property
    def learner(self) -> Ppo | Sac:
        """The hyperparameters of the algorithm."""
        return getattr(self, self.algorithm)

    @property
    def rollout(self) -> int:
        """Steps of the environment from one update to the next."""
        return self.worlds.count * self.learner.steps_of_a_world

    def to_dict(self) -> dict[str, Any]:
        """Plain data (numbers, texts, lists, dicts), as a file has it."""
        return {"name": self.name, **TRAINING.write(self)}


@dataclass(frozen=True)
class Whole(Rule):
    """A list of whole numbers."""

    number: Number
    shortest: int = 1

    def read(self, value, key, folder):
        if not isinstance(value, list | tuple) or len(value) < self.shortest:
            raise refuse(key, value, f"a list of {self.shortest} or more of: {self.number.allowed()}")
        return Vector(len(value), self.number).read(value, key, folder)


@dataclass(frozen=True)
class SceneName(Rule):
    """The name of a shipped scene, or the path of a TOML file from the folder of the settings; kept absolute."""

    def read(self, value, key, folder):
        name = Text().read(value, key, folder)
        return FilePath().read(name, key, folder) if name.endswith(".toml") else name


@dataclass(frozen=True)
class SceneKeys(Rule):
    """Tables and keys of a scene, which the scene itself checks."""

    def read(self, value, key, folder):
        if not isinstance(value, Mapping):
            raise refuse(key, value, "a table with keys of a scene")
        return dict(value)

    def write(self, value):
        return dict(value)


LEVELS = Whole(Number(0, whole=True), 0)
LAYOUTS = Number(1, len(SELECTION), whole=True)
STAGE = Table(Stage, {"levels": LEVELS, "success": SHARE, "steps": FROM_ONE})
TRAINING = Table(
    Settings,
    {
        "description": Text(),
        "steps": FROM_ONE,
        "seed": Number(0, whole=True),
        "device": Choice(("cpu", "cuda", "auto")),
        "algorithm": Choice(tuple(ALGORITHMS)),
        "worlds": Table(
            Worlds,
            {
                "count": WORLDS,
                "scene": SceneName(),
                "set": SceneKeys(),
                "threads": FROM_ONE,
                "steps": FROM_ONE,
                "frames": FRAMES,
            },
        ),
        "stage": Many(STAGE),
        "network": Table(
            Network,
            {
                "filters": Whole(FROM_ONE),
                "kernels": Whole(FROM_ONE),
                "strides": Whole(FROM_ONE),
                "features": FROM_ONE,
                "hidden": Whole(FROM_ONE, 0),
            },
        ),
        "teacher": Table(
            Teacher,
            {
                "policy": Text(),
                "worlds": WORLDS,
                "steps": FROM_ONE,
                "noise": Number(0, 1),
                "epochs": FROM_ONE,
                "batch_size": FROM_ONE,
                "learning_rate": POSITIVE,
                "critic_steps": Number(0, whole=True),
            },
        ),
        **ALGORITHMS,
        "normalise": Table(Normalise, {"pose": Flag(), "returns": Flag(), "clip": POSITIVE}),
        "record": Table(
            Record, {"evaluate_every": FROM_ONE, "levels": LEVELS, "layouts": LAYOUTS, "save_every": FROM_ONE}
        ),
    },
    fields={"stage": "stages"},
)


def load_settings(path: Path, overrides: Mapping[str, Any]) -> Settings:
    """The checked settings of a file, or of a shipped one by its name, with `overrides` merged over it.

    Raises ValueError that names the key, its value and what is allowed.
    """
    path = settings_file(path, "train")
    written = read_file(path, from_here(overrides))
    known_keys(written, "", TRAINING.rules)
    settings = replace(_completed(TRAINING.read(written, "", path.parent)), name=path.stem)
    _check(settings)
    return settings


def from_here(overrides: Mapping[str, Any]) -> Mapping[str, Any]:
    """Overrides whose scene file, if there is one, is looked for from the current folder, not from the settings'."""
    worlds = overrides.get("worlds")
    scene = worlds.get("scene") if isinstance(worlds, Mapping) else None
    if not isinstance(scene, str) or not scene.endswith(".toml"):
        return overrides
    return {**overrides, "worlds": {**worlds, "scene": str(Path(scene).expanduser().absolute())}}


def settings_file(path: Path, shelf: str) -> Path:
    """The file, or the one of that name that is shipped in configs/`shelf`; ValueError if there is neither."""
    folder = scene_folder().parent / shelf
    shipped = {found.stem: found for found in sorted(folder.glob("*.toml"))}
    if not path.is_file() and str(path) not in shipped:
        raise ValueError(f"config {path} is no file; allowed: a TOML file, or a shipped one: {', '.join(shipped)}")
    return path if path.is_file() else shipped[str(path)]


def read_file(path: Path, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """What a settings file says, with `overrides` merged over it; ValueError if it is none."""
    try:
        written = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"config {path} is no TOML: {error}") from None
    return merge(written, overrides)


def overrides_of(settings: Settings, level: int | None) -> dict[str, Any]:
    """What makes the environment at a level: the scene's keys that are set anew, and the level."""
    return {**settings.worlds.set, **({} if level is None else {"level": level})}


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


def _check(settings: Settings) -> None:
    """Raise ValueError where values do not go together."""
    ppo = settings.ppo
    if ppo is not None and settings.rollout % ppo.batch_size:
        raise ValueError(
            f"ppo.batch_size is {ppo.batch_size}; allowed: what divides worlds.count x ppo.n_steps = {settings.rollout}"
        )
    _check_stages(settings)
    played = [*settings.stages, settings.record]
    levels = {level for one in played for level in one.levels or (None,)}
    configs = [load(settings.worlds.scene, **overrides_of(settings, level)) for level in levels]
    for config in configs:
        if config.observation.map:
            raise ValueError("worlds.set.observation.map is True; allowed: False, with patch, pose and overview")
        check_network(settings.network, config.observation.size)
    _check_teacher(settings)
    if settings.sac is not None:
        _check_sac(settings, settings.sac, step_bytes(configs[0], settings.worlds.frames))


def _check_sac(settings: Settings, sac: Sac, size: int) -> None:
    """Raise ValueError where SAC cannot do what is asked for; `size` is that of a step in the buffer [bytes]."""
    if settings.teacher.policy:
        raise ValueError(
            f'teacher.policy is {settings.teacher.policy!r} with algorithm "sac", which begins from nothing; '
            'allowed: no teacher, or algorithm = "ppo"'
        )
    taken, room = sac.buffer_size * size / 1e9, int(sac.memory * 1e9 / size)
    if taken > sac.memory:
        raise ValueError(
            f"sac.buffer_size is {sac.buffer_size}, which takes {taken:.2f} GB ({size:,} bytes a step); allowed: at "
            f"most {room} in sac.memory = {sac.memory:g} GB, or more memory"
        )
    least = max(settings.rollout, sac.batch_size)
    if sac.buffer_size < least:
        raise ValueError(
            f"sac.buffer_size is {sac.buffer_size}; allowed: at least {least}, a batch and "
            "worlds.count x sac.train_freq"
        )
    if sac.learning_starts >= settings.steps:
        raise ValueError(f"sac.learning_starts is {sac.learning_starts}; allowed: less than steps = {settings.steps}")


def step_bytes(config: SceneConfig, frames: int) -> int:
    """What a step takes in the buffer of SAC: what was seen before and after it, action, reward, two marks."""
    seen = config.observation
    pictures = frames * len(config.channels) * seen.size**2 + (2 * OVERVIEW**2 if seen.overview else 0)
    return 2 * (2 * pictures + 4 * frames * len(POSE_ENTRIES)) + 4 * (3 + 1 + 2)


def _check_teacher(settings: Settings) -> None:
    """Raise ValueError where the teacher cannot play what is trained on, or leaves nothing to learn."""
    teacher = settings.teacher
    if not teacher.policy:
        if teacher != Teacher():
            raise ValueError("teacher.policy is ''; allowed: a scripted behaviour, or no other keys of [teacher]")
        return
    level = (settings.stages[-1].levels or (None,))[0]
    try:
        policy = load_policy(teacher.policy, load(settings.worlds.scene, **overrides_of(settings, level)))
    except (ValueError, ImportError) as error:
        raise ValueError(f"teacher.policy is {teacher.policy!r}: {error}") from error
    if needed(policy) not in ({}, {"observation": {"map": True}}):
        raise ValueError(f"teacher.policy is {teacher.policy!r}, which needs {needed(policy)}; allowed: the map alone")
    if teacher.critic_steps >= settings.steps:
        raise ValueError(f"teacher.critic_steps is {teacher.critic_steps}; allowed: less than steps {settings.steps}")


def _check_stages(settings: Settings) -> None:
    """Raise ValueError where a stage but the last never ends, or the last one does."""
    if not settings.stages:
        raise ValueError("stage is empty; allowed: one [[stage]] or more")
    for number, stage in enumerate(settings.stages):
        ends, last = stage.success is not None or stage.steps is not None, number == len(settings.stages) - 1
        if ends == last:
            said = "ends" if ends else "never ends"
            raise ValueError(
                f"stage[{number}] {said}; allowed: `success` or `steps` in every stage but the last, which has neither"
            )
        if len(stage.levels) > settings.worlds.count:
            raise ValueError(
                f"stage[{number}].levels are {len(stage.levels)}; allowed: at most worlds.count {settings.worlds.count}"
            )


def check_network(network: Network, size: int) -> None:
    """Raise ValueError where the lists of convolutions differ in length, or one is larger than what is left to see."""
    if not len(network.filters) == len(network.kernels) == len(network.strides):
        raise ValueError(
            f"network.filters, kernels and strides have {len(network.filters)}, {len(network.kernels)} and "
            f"{len(network.strides)} numbers; allowed: as many each, one for each convolution"
        )
    for kernel, stride in zip(network.kernels, network.strides, strict=True):
        if kernel > size:
            raise ValueError(f"network.kernels has {kernel} over {size} pixels; allowed: at most as many")
        size = (size - kernel) // stride + 1
