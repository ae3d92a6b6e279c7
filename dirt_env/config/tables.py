"""The tables of a scene file: their keys, units and ranges. Defaults stand in the classes that the tables build.

docs/scenes.md is the same for people.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan, degrees, radians, tan
from typing import Any, NamedTuple

from dirt_env.config.presets import PRESETS
from dirt_env.config.rules import (
    Choice,
    Either,
    FilePath,
    Flag,
    Kinds,
    Many,
    Named,
    Number,
    Points,
    Rule,
    Several,
    Span,
    Table,
    Text,
    Vector,
    join,
)
from dirt_env.config.terrain import HeightField, VoxelGrid
from dirt_env.scene.design import Design
from dirt_env.scene.fixed import Goal, Hollow, Start
from dirt_env.scene.ground import Flat, Mounds, Ridge, Rough
from dirt_env.scene.obstacles import Block, Post, Wall
from dirt_env.scene.regions import Circle, Mask, Polygon, Rectangle
from dirt_env.scene.sampling import LEVELS, Sampler
from dirt_env.scene.survey import HeightFile
from dirt_env.scene.vary import Vary
from dirt_env.sim.params import Blade, Machine, Soil, Strength, Traction
from dirt_env.sim.voxel_state import FOOTINGS, LARGEST_LIFE
from dirt_env.task.patch import CHANNELS


@dataclass(frozen=True)
class Site:
    """The site: `size` [east, north] m, square cells of `cell` m, and what its border does with soil."""

    size: tuple[float, float] = (32.0, 32.0)
    cell: float = 0.5
    border: str = "wall"


@dataclass(frozen=True)
class Task:
    """The job: control step `period` s, nominal `time` s, and the share in the goal that counts as `success`."""

    period: float = 0.5
    time: float | None = None
    success: float = 0.95


@dataclass(frozen=True)
class Noise:
    """Standard deviations of what the machine measures anew in every step: the `height` of each cell [m], its own
    `position` in x and in y [m], and its `heading` [degrees].
    """

    height: float = 0.0
    position: float = 0.0
    heading: float = 0.0


@dataclass(frozen=True)
class Observation:
    """What the machine sees: patches of `size` x `size` pixels of `resolution` m, the share `ahead` of it in front.

    `channels` of them (None: what the scene can have); heights in them end at `height_limit` m either way; `overview`
    and `map` add pictures of the whole site; `noise` blurs it all (None: it does not).
    """

    size: int = 32
    resolution: float | None = None
    ahead: float = 0.7
    channels: tuple[str, ...] | None = None
    height_limit: float = 4.0
    overview: bool = False
    map: bool = False
    noise: Noise | None = None


@dataclass(frozen=True)
class Action:
    """What the action `blade` means: the edge's height over the "tracks", or under automatic "grade" control."""

    blade: str = "tracks"


@dataclass(frozen=True)
class Reward:
    """Weights of the reward's terms."""

    work: float = 10.0
    energy: float = 0.2
    time: float = 1.0
    spill: float = 5.0
    success: float = 1.0
    log_work: float = 0.0


METRES = Number(0, unit="m", above=True)
# With ends far from those of floats, so that no product or quotient of them overflows.
LENGTH = Number(1e-3, 1e4, "m")
VOLUME = Number(1e-6, 1e12, "m3")
TIME = Number(1e-3, 1e9, "s")
HEIGHT = Number(unit="m")
DEGREES = Number(unit="degrees")
SEED = Number(0, whole=True)
SHARE = Number(0, 1, above=True)
WEIGHT = Number(-1e9, 1e9)


class Repose(Number):
    """An angle of repose in degrees, kept as its tangent; 12 decimals count, so that it survives being written back."""

    def read(self, value, key, folder) -> float:
        return tan(radians(round(super().read(value, key, folder), 12)))

    def write(self, value) -> float:
        return round(degrees(atan(value)), 12)


class Angle(Number):
    """An angle in degrees, kept in radians; 12 decimals count, so that it survives being written back."""

    def read(self, value, key, folder) -> float:
        return radians(round(super().read(value, key, folder), 12))

    def write(self, value) -> float:
        return round(degrees(value), 12)


def _rounded(angle: float) -> float:
    """The angle [rad] that comes back when it is written in degrees."""
    return radians(round(degrees(angle), 12))


class Earth(NamedTuple):
    """All that the table `soil` says: the loose soil, and what it stands before it gives way."""

    soil: Soil
    strength: Strength


def _earth(slope: float = Soil().slope, friction: float | None = None, **rest: float) -> Earth:
    """Soil whose friction on itself and inside is that of its repose, if nothing else is said; on steel 2/3 of it."""
    of_soil = {name: rest.pop(name) for name in Soil._fields if name in rest}
    internal = rest.pop("internal_friction", _rounded(atan(slope)))
    external = rest.pop("external_friction", _rounded(internal * 2 / 3))
    soil = Soil(slope=slope, friction=slope if friction is None else friction, **of_soil)
    return Earth(soil, Strength(internal_friction=internal, external_friction=external, **rest))


class SoilTable(Table):
    """The table `soil`; its `preset` gives the keys that are not there themselves."""

    def read(self, value, key, folder) -> Earth:
        if not isinstance(value, Mapping) or "preset" not in value:
            return super().read(value, key, folder)
        preset = self.rules["preset"].read(value["preset"], join(key, "preset"), folder)
        return super().read({**PRESETS[preset], **{k: v for k, v in value.items() if k != "preset"}}, key, folder)

    def write(self, value) -> dict[str, Any]:
        numbers = {**value.soil._asdict(), **value.strength._asdict()}
        return {name: rule.write(numbers[self.field(name)]) for name, rule in self.rules.items() if name != "preset"}


def _sampler(level: int = 1, **numbers) -> Sampler:
    """A level's preset, with the given numbers in place of its own."""
    return Sampler(**{**vars(LEVELS[level]), **numbers})


REGION = Kinds(
    {
        "circle": Table(Circle, {"center": Vector(2), "radius": METRES}, ("center", "radius")),
        "rectangle": Table(
            Rectangle, {"center": Vector(2), "size": Vector(2, METRES), "angle": DEGREES}, ("center", "size")
        ),
        "polygon": Table(Polygon, {"points": Points()}, ("points",)),
        "mask": Table(Mask, {"path": FilePath()}, ("path",)),
    }
)

RANDOM_HEIGHT = Span(Number(0, unit="m"))
GROUND = Kinds(
    {
        "flat": Table(Flat, {}),
        "mounds": Table(
            Mounds,
            {"count": Span(Number(0, 1000, whole=True)), "height": RANDOM_HEIGHT, "radius": Span(METRES), "seed": SEED},
        ),
        "ridge": Table(
            Ridge, {"height": RANDOM_HEIGHT, "width": METRES, "center": Vector(2), "angle": DEGREES, "seed": SEED}
        ),
        "rough": Table(Rough, {"height": RANDOM_HEIGHT, "length": METRES, "seed": SEED}),
        "file": Table(
            HeightFile,
            {
                "path": FilePath(),
                "crop": Vector(4),
                "nodata": Choice(("wall", "fill")),
                "nodata_value": Number(),
                "scale": Number(),
                "offset": HEIGHT,
                "first_row": Choice(("north", "south")),
                "pixel": METRES,
                "array": Text(),
                "band": Number(1, whole=True),
            },
            ("path",),
        ),
    },
    default="flat",
)

SITE = Table(Site, {"size": Vector(2, METRES), "cell": METRES, "border": Choice(("wall", "open"))})

SOIL = SoilTable(
    _earth,
    {
        "preset": Choice(tuple(PRESETS)),
        "repose": Repose(0, 90, "degrees", below=True),
        "density": Number(0, 1e9, "kg/m3", above=True),
        "friction": Number(0, 1e6),
        "tolerance": Number(0, 0.1, above=True),
        "cohesion": Number(0, 1e9, "Pa"),
        "internal_friction": Angle(0, 90, "degrees", below=True),
        "adhesion": Number(0, 1e9, "Pa"),
        "external_friction": Angle(0, 90, "degrees", below=True),
        "shear_deformation": Number(0, 10, "m"),
    },
    fields={"repose": "slope"},
)

BLADE = Table(Blade, {"width": LENGTH, "height": LENGTH, "reach": Number(0, 1e4, "m")})

MACHINE = Table(
    Machine,
    {
        "length": LENGTH,
        "width": LENGTH,
        "speed": Number(0, unit="m/s", above=True),
        "yaw_rate": Number(0, unit="rad/s", above=True),
        "cut": Number(0, 1e4, "m"),
        "lift": LENGTH,
        "edge_rate": Number(0, unit="m/s", above=True),
    },
)

TRACTION = Table(
    Traction,
    {
        "mass": Number(0, 1e9, "kg", above=True),
        "power": Number(0, 1e12, "W", above=True),
        "efficiency": SHARE,
        "track_width": LENGTH,
        "rolling_resistance": Number(0, 1),
        "rake": Angle(10, 120, "degrees"),
    },
)

SHIFT = Vector(2, Number(0, unit="m"))

POSE = Either(Choice(("behind", "random")), Vector(3, Number()), "[x m, y m, heading in degrees]")

START = Table(
    Start,
    {
        "region": REGION,
        "volume": Span(VOLUME),
        "depth": Span(METRES),
        "dig": Span(METRES),
        "shift": SHIFT,
    },
    ("region",),
)

GOAL = Table(Goal, {"region": REGION, "shift": SHIFT}, ("region",))

HOLLOW = Table(Hollow, {"region": REGION, "depth": Span(METRES)}, ("region", "depth"))

VARY = Table(Vary, {"shift": SHIFT, "mirror": Flag()})

DESIGN = Table(
    Design,
    {
        "region": REGION,
        "height": Either(Choice(("balance", "ground")), HEIGHT, "a number of metres"),
        "slope": Vector(2, Number()),
        "layer": METRES,
        "path": FilePath(),
        "tolerance": METRES,
    },
    ("region",),
)

OBSTACLE = Kinds(
    {
        "post": Table(Post, {"center": Vector(2), "radius": METRES}, ("center",)),
        "wall": Table(
            Wall,
            {"from": Vector(2), "to": Vector(2), "width": METRES},
            ("from", "to"),
            {"from": "start", "to": "end"},
        ),
        "region": Table(Block, {"region": REGION}, ("region",)),
    }
)

LAYOUT = Table(
    _sampler,
    {
        "level": Number(0, len(LEVELS) - 1, whole=True),
        "heaps": Span(Number(1, 64, whole=True)),
        "volume": Span(VOLUME),
        "haul": Span(METRES),
        "machine": Choice(("behind", "anywhere")),
        "rough": Span(Number(0, unit="m")),
        "rough_length": METRES,
        "obstacles": Span(Number(0, 64, whole=True)),
        "obstacle_radius": Span(METRES),
        "goal_radius": Span(METRES),
        "room": Number(0, above=True),
        "back_off": Number(0, unit="m"),
        "lane": Number(0, unit="m"),
    },
)

TASK = Table(Task, {"period": Number(0, 10, "s", above=True), "time": TIME, "success": SHARE})

ACTION = Table(Action, {"blade": Choice(("tracks", "grade"))})

NOISE = Table(
    Noise, {"height": Number(0, 100, "m"), "position": Number(0, 1e4, "m"), "heading": Number(0, 180, "degrees")}
)

OBSERVATION = Table(
    Observation,
    {
        "size": Number(4, 512, "pixels", whole=True),
        "resolution": METRES,
        "ahead": Number(0, 1),
        "channels": Several(Choice(CHANNELS)),
        "height_limit": LENGTH,
        "overview": Flag(),
        "map": Flag(),
        "noise": NOISE,
    },
)

REWARD = Table(Reward, dict.fromkeys(("work", "energy", "time", "spill", "success", "log_work"), WEIGHT))

TERRAIN = Named(
    {
        "heightfield": Table(HeightField, {}),
        "voxel": Table(
            VoxelGrid,
            {
                "dy": METRES,
                "depth": Number(0, unit="m"),
                "headroom": Number(0, unit="m"),
                "updates_per_second": Number(0, 10000),
                "required_difference": Number(0),
                "transfer_rate": Number(0, 1),
                "life": Number(0, LARGEST_LIFE, "updates", whole=True),
                "exact": Flag(),
                "neighbours": Choice((4, 8)),
                "reads": Choice(("snapshot", "in place")),
                "sinking": Choice(("at once", "in transit")),
                "rise_into_constraint": Flag(),
                "footing": Choice(FOOTINGS),
            },
        ),
    },
    default="heightfield",
)

SCENE: dict[str, Rule] = {
    "name": Text(),
    "description": Text(),
    "site": SITE,
    "ground": GROUND,
    "terrain": TERRAIN,
    "soil": SOIL,
    "blade": BLADE,
    "machine": MACHINE,
    "traction": TRACTION,
    "start": Many(START),
    "goal": Many(GOAL),
    "hollow": Many(HOLLOW),
    "design": DESIGN,
    "obstacle": Many(OBSTACLE),
    "vary": VARY,
    "layout": LAYOUT,
    "task": TASK,
    "action": ACTION,
    "observation": OBSERVATION,
    "reward": REWARD,
}
