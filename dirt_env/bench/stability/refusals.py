"""What is refused at the boundary: every bad value with its key, what it was, and what is allowed."""

import tempfile
from math import inf, nan
from pathlib import Path

import numpy as np

from dirt_env.bench.stability.driving import PUSH, started
from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import BLADE, MACHINE, SOIL, world_of
from dirt_env.config import load
from dirt_env.env import DirtPushEnv
from dirt_env.sim.advance import place

BAD = (nan, inf, -inf, 1e300, -1e300, True, None, "much", [1.0], {})


def _refused(make, pairs) -> tuple[str, bool]:
    """How many of the (key, value) pairs are refused with a ValueError that names the key's last part."""
    missed = []
    for key, value in pairs:
        try:
            make(key, value)
        except ValueError as error:
            if key.rpartition(".")[2] not in str(error):
                missed.append(f"{key}: {error}")
        except Exception as error:  # any other error is not meant for a user
            missed.append(f"{key} = {value!r}: {type(error).__name__}")
        else:
            missed.append(f"{key} = {value!r} accepted")
    text = f"{len(pairs) - len(missed)} of {len(pairs)} refused"
    return text + ("; not " + "; ".join(missed[:3]) if missed else ""), not missed


def _load(key, value):
    table, _, name = key.partition(".")
    return load("heap", **({table: {name: value}} if name else {table: value}))


def _bad(*keys, values=BAD):
    none_is_absent = [value for value in values if value is not None]
    return [(key, value) for key in keys for value in none_is_absent]


@case("NaN, infinity, 1e300, true, text, lists for every number of soil, blade and machine: refused with the key")
def numbers_of_soil_blade_and_machine():
    soil = ("soil.repose", "soil.density", "soil.friction", "soil.tolerance")
    blade = ("blade.width", "blade.height", "blade.reach")
    machine = [f"machine.{name}" for name in ("length", "width", "speed", "yaw_rate", "cut", "lift", "edge_rate")]
    return _refused(_load, _bad(*soil, *blade, *machine))


@case("the same for site, task, observation and layout")
def numbers_of_the_rest():
    names = ("site.cell", "task.period", "task.time", "task.success", "observation.resolution", "observation.ahead")
    more = ("observation.height_limit", "observation.size", "layout.room", "layout.rough_length", "layout.back_off")
    values = [value for value in BAD if not isinstance(value, list)]
    return _refused(
        _load, [*_bad(*names, *more, values=values), *_bad("site.size", values=(nan, 0.0, "big", [1.0], [0, 5]))]
    )


@case("0, negative and too large lengths where they make no sense: refused with the key")
def lengths_that_are_none():
    pairs = [
        *_bad("blade.width", "blade.height", "machine.length", "machine.width", "site.cell", values=(0.0, -1.0)),
        *_bad("machine.speed", "machine.yaw_rate", "machine.edge_rate", "task.period", "task.time", values=(0, -1)),
        *_bad("soil.density", "soil.tolerance", values=(0.0, -1.0)),
        *_bad("blade.width", values=(0.9, 40.0)),
        ("soil.tolerance", 0.2),
        ("task.period", 11.0),
        ("observation.size", 3),
        ("observation.size", 513),
        ("site.cell", 1e-6),
        ("site.cell", 0.3),
    ]
    return _refused(_load, pairs)


@case("repose of 90, 91, -1, NaN, 1e300, text: refused; the rate of the slump is no key at all")
def repose_and_rate():
    pairs = [
        *_bad("soil.repose", values=(90, 91, -1, nan, 1e300, "steep")),
        ("soil.rate", 0.26),
        ("soil.relax_rate", 0.4),
    ]
    return _refused(_load, pairs)


@case("every number of the cells beyond its range: refused with the key")
def numbers_of_the_cells():
    def make(key, value):
        return load("heap", terrain={"kind": "voxel", key: value})

    pairs = [
        *_bad("dy", values=(0.0, -1.0, *BAD)),
        *_bad("depth", "headroom", "required_difference", values=(-0.1, *BAD)),
        *_bad("transfer_rate", values=(-0.1, 1.1, nan, inf)),
        *_bad("life", values=(-1, 32_767, 1.5, nan)),
        *_bad("updates_per_second", values=(-1.0, 10_001.0, nan, inf)),
        *_bad("neighbours", values=(0, 5, 6, "four")),
        *_bad("reads", "sinking", values=("sometimes", 1)),
        *_bad("exact", values=(1, "yes")),
    ]
    return _refused(make, pairs)


@case("cells so flat or so high that the grid would not fit into memory: refused with how many there would be")
def too_many_cells():
    found = []
    for options in (
        {"terrain": {"kind": "voxel", "dy": 1e-9}},
        {"terrain": {"kind": "voxel", "depth": 1e9}},
        {"site": {"cell": 2.0**-9}},
    ):
        try:
            DirtPushEnv(**options).reset(seed=0)
            found.append("accepted")
        except ValueError as error:
            found.append("cells" in str(error))
        except Exception as error:
            found.append(type(error).__name__)
    return f"{found.count(True)} of {len(found)} refused {[f for f in found if f is not True] or ''}", found == [
        True
    ] * 3


@case("poses outside, on a post, NaN, infinite, 1e300: refused, and the episode and the generator unchanged")
def poses_that_are_none():
    env = started(3, scene="posts")
    state = env.get_state()
    post = np.argwhere(env.episode.layout.solid)[0]
    on_post = [(post[1] + 0.5) * 0.5, (post[0] + 0.5) * 0.5, 0.0]
    bad = [
        [-1, 5, 0],
        [1e6, 5, 0],
        [5, 5, nan],
        [inf, 5, 0],
        [1e300, 1e300, 0],
        [0, 0, 0],
        on_post,
        [1, 2],
        "here",
        3.0,
    ]
    refused = 0
    for pose in bad:
        try:
            env.reset(options={"pose": pose})
        except ValueError:
            refused += 1
    return f"{refused} of {len(bad)} refused", refused == len(bad) and env.get_state() == state


@case("headings of 1e6 and -1e15 rad: wrapped into [-pi, pi)")
def headings_beyond_a_turn():
    world, grid = world_of(np.zeros((40, 40)))
    found = []
    for heading in (1e6, -1e15, 3.2, -3.2):
        place(world, grid, SOIL, BLADE, MACHINE, 10.0, 10.0, heading)
        found.append(float(world.machine[0].heading))
    return f"{', '.join(f'{heading:.3f}' for heading in found)}", all(-np.pi <= heading < np.pi for heading in found)


@case("reset options and seeds that are none: refused; the episode and the generator unchanged")
def reset_options_that_are_none():
    env = started()
    state, refused = env.get_state(), 0
    bad = ({"layout_seed": -1}, {"layout_seed": 1.5}, {"layout_seed": True}, {"layout": 3}, "again", [1], {"pose": []})
    for options in bad:
        try:
            env.reset(options=options)
        except ValueError:
            refused += 1
    return f"{refused} of {len(bad)} refused", refused == len(bad) and env.get_state() == state


@case("states cut short, with a bit flipped, of another scene, of another type: refused; the episode unchanged")
def states_that_are_none():
    env, other = started(), started(scene="pad")
    env.step(PUSH)
    state, refused = env.get_state(), 0
    flipped = [state[:k] + bytes([state[k] ^ 1]) + state[k + 1 :] for k in range(0, len(state), len(state) // 40)]
    bad = [state[: len(state) // 2], b"", b"x" * 100, state + b"x", other.get_state(), "state", None, 5, *flipped]
    for one in bad:
        try:
            env.set_state(one)
        except ValueError:
            refused += 1
    return f"{refused} of {len(bad)} refused", refused == len(bad) and env.get_state() == state


def _from_file(heights, **table):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "ground.npy"
        np.save(path, heights)
        env = DirtPushEnv(
            scene={
                "site": {"cell": 0.5},
                "ground": {"kind": "file", "path": str(path), **table},
                "start": [{"region": {"kind": "circle", "center": [8, 8], "radius": 2}, "depth": 0.3}],
                "goal": [{"region": {"kind": "circle", "center": [16, 8], "radius": 2}}],
            }
        )
        env.reset(seed=0)
        return env


@case("a height file around 1e6 m in float64: a local datum; the same ground, to the last bit, as around 0 m")
def a_million_metres_from_a_file():
    ground = np.round(np.random.default_rng(0).uniform(0, 0.2, (40, 48)) * 1024) / 1024
    near, far = _from_file(ground), _from_file(ground + 1e6)
    for _ in range(20):
        near.step([0.1, 1.0, -0.3])
        far.step([0.1, 1.0, -0.3])
    same = np.array_equal(near.episode.world.height, far.episode.world.height)
    return f"datum {far.episode.layout.datum:g} m, heights equal: {same}", same and abs(
        far.episode.layout.datum - 1e6
    ) < 1


@case(
    "a height file with NaN, infinity or 1e300 in it: refused, or taken for no data where the scene says what that is"
)
def height_files_that_are_none():
    found = []
    for bad in (nan, inf, -inf, 1e300, 1e5):
        ground = np.zeros((40, 48))
        ground[3, 3] = bad
        try:
            _from_file(ground)
            found.append(f"{bad} accepted")
        except ValueError:
            found.append(True)
        except Exception as error:
            found.append(f"{bad}: {type(error).__name__}")
    filled = np.full((40, 48), 0.5)
    filled[3, 3] = nan
    high = float(_from_file(filled, nodata="fill").episode.world.height.max())
    return (
        f"{found.count(True)} of 5 refused {[f for f in found if f is not True] or ''}; filled up to {high:g} m",
        found == [True] * 5 and high < 5.0,
    )
