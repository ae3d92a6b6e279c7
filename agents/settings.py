"""The settings of a training run, the rules of their keys, and how they are written back as plain data."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from dirt_env.config.loading import paths_from
from dirt_env.config.rules import Choice, FilePath, Flag, Many, Number, Rule, Table, Text, Vector, join, refuse
from dirt_env.split import SELECTION
from dirt_env.split import TRAINING as TRAINING_LAYOUTS

from .hyperparameters import ALGORITHMS, FROM_ONE, POSITIVE, RATE, SHARE, Ppo, Sac

OVERVIEW_GAIN = 5.0  # of the overview before the network: shares of all soil in a square are small numbers
ROOT_GAIN = 0.5  # of square roots of shares in the overview, before that
LEAST_LEFT = 1e-3  # of all soil: so much counts as left at least, that roots of shares of it stay small
NO_TEACHER = "none"  # the policy of a teacher that is not there
MOST_FINENESS = 10.0  # of the blade: near 0 it moves in steps 1100 times as fine then
# Keys that settings written before there were any mean without saying.
SINCE = {
    "algorithm": "ppo",
    "network.roots": False,
    "ppo.optimizer": "adam",
    "ppo.share_features": True,
    "worlds.fineness": 0.0,
    "worlds.frames": 1,
    "worlds.mirror": False,
    "worlds.variants": [],
}

FRAMES = Number(1, 16, whole=True)
SEED = Number(0, 2**32 - 1, whole=True)
THREADS = Number(1, 512, whole=True)
WORLDS = Number(1, len(TRAINING_LAYOUTS), whole=True)  # each starts from a layout of its own


@dataclass(frozen=True)
class Worlds:
    """`count` worlds of a scene, with keys of the scene `set` anew, for some worlds by `variants`; `threads` step them.

    Episodes are cut off after `steps` control steps; None is what the longest job of a stage takes. The network sees
    the last `frames` patches and poses side by side, with `mirror` turned over where the goal lies to the right, and
    with a `fineness` it moves the blade in finer steps near 0 (agents/fineness.py).
    """

    count: int = 256
    scene: str = "heap"
    set: Mapping[str, Any] = field(default_factory=dict)
    variants: tuple[Mapping[str, Any], ...] = ()
    threads: int = 1
    steps: int | None = None
    frames: int = 1
    mirror: bool = False
    fineness: float = 0.0


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
    """Convolutions over the patch, then dense layers over their output and the pose: of the actor and of the critic.

    With `roots` they see thin remnants: of the patch the channel sign(todo) sqrt(|todo|) too, and in the overview the
    square root of each square's share of the soil that is left, in place of its share of all there was.
    """

    filters: tuple[int, ...] = (8, 16)
    kernels: tuple[int, ...] = (4, 3)
    strides: tuple[int, ...] = (2, 2)
    features: int = 128
    hidden: tuple[int, ...] = (128,)
    roots: bool = False


@dataclass(frozen=True)
class Teacher:
    """A scripted behaviour to begin from; without a `policy`, or with "none", training begins from nothing.

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
    """One training run by PPO or SAC, with the table of that alone. `load_settings` makes and checks it."""

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
        return paths_from(folder, value)

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
        "seed": SEED,
        "device": Choice(("cpu", "cuda", "auto")),
        "algorithm": Choice(tuple(ALGORITHMS)),
        "worlds": Table(
            Worlds,
            {
                "count": WORLDS,
                "scene": SceneName(),
                "set": SceneKeys(),
                "variants": Many(SceneKeys()),
                "threads": THREADS,
                "steps": FROM_ONE,
                "frames": FRAMES,
                "mirror": Flag(),
                "fineness": Number(0, MOST_FINENESS),
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
                "roots": Flag(),
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
                "learning_rate": RATE,
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


def overrides_of(settings: Settings, level: int | None) -> dict[str, Any]:
    """What makes the environment at a level: the scene's keys that are set anew, and the level."""
    return {**settings.worlds.set, **at_level(level)}


def at_level(level: int | None) -> dict[str, Any]:
    """The key of a scene that says the level, if it has any."""
    return {} if level is None else {"level": level}


def flattened(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings as `to_dict` has them, those of an older version too: each value by its dotted key."""
    return {**SINCE, **dict(_leaves(settings))}


def _leaves(tree: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """The leaves of nested mappings by dotted key."""
    if not isinstance(tree, Mapping):
        yield key, tree
        return
    for name, part in tree.items():
        yield from _leaves(part, join(key, name))
