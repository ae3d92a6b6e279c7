"""The tables of a scene file: their keys, units and ranges. Defaults stand in the classes that the tables build.

docs/scenes.md is the same for people.
"""

from dataclasses import dataclass

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
)
from dirt_env.config.soils import SOIL, Angle, zone_table
from dirt_env.config.terrain import HeightField, VoxelGrid
from dirt_env.scene.design import Design
from dirt_env.scene.fixed import Goal, Hollow, Start
from dirt_env.scene.ground import Flat, Mounds, Ridge, Rough
from dirt_env.scene.obstacles import Block, Post, Wall
from dirt_env.scene.regions import Circle, Mask, Polygon, Rectangle
from dirt_env.scene.sampling import LEVELS, Sampler
from dirt_env.scene.survey import HeightFile
from dirt_env.scene.vary import Vary
from dirt_env.sim.params import Blade, Machine, Traction
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
READING = {  # keys that say how a file of heights is read
    "first_row": Choice(("north", "south")),
    "array": Text(),
    "band": Number(1, whole=True),
    "nodata_value": Number(),
    "scale": Number(0, unit="m", above=True),
    "offset": HEIGHT,
}
SHARE = Number(0, 1, above=True)
WEIGHT = Number(-1e9, 1e9)


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
                "pixel": METRES,
                **READING,
            },
            ("path",),
        ),
    },
    default="flat",
)

SITE = Table(Site, {"size": Vector(2, METRES), "cell": METRES, "border": Choice(("wall", "open"))})

ZONE = zone_table(REGION)

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
        **READING,
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
    "zone": Many(ZONE),
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
