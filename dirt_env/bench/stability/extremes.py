"""Every number of a scene at the ends of what is allowed: refused with its key, or 20 sound steps in bounded work."""

from time import process_time

import numpy as np

from dirt_env.bench.stability.driving import sound
from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import grown, total
from dirt_env.config.rules import Number, Span, Table
from dirt_env.config.tables import BLADE, LAYOUT, MACHINE, OBSERVATION, REWARD, SITE, SOIL, TASK, TERRAIN
from dirt_env.env import DirtPushEnv

TINY, SMALL, LARGE, HUGE = 1e-290, 1e-6, 1e6, 1e290
PATIENCE = 60.0  # s of processor time for one value: reset and 20 steps


def _try(options, key) -> str:
    """ "refused", "sound", or what is wrong."""
    begin = process_time()
    try:
        env = (
            DirtPushEnv(level=0, site={"size": [16.0, 16.0]}, **options)
            if "site" not in options
            else DirtPushEnv(level=0, **options)
        )
        seen, info = env.reset(seed=0)
        before, good = _kept(env), env.observation_space.contains(seen)
        rng = np.random.default_rng(0)
        for _ in range(20):
            seen, reward, _, _, info = env.step([rng.uniform(-1, 1), rng.choice([-1.0, 1.0]), rng.uniform(-1, 0.5)])
            good &= sound(env, seen, reward, info)
        if "terrain" not in options and _kept(env) != before:
            return "volume changed"
    except ValueError as error:
        return "refused" if key in str(error) or "allowed" in str(error) else f"refused without its key: {error}"
    except Exception as error:
        return type(error).__name__
    if process_time() - begin > PATIENCE:
        return f"took {process_time() - begin:.0f} s"
    return "sound" if good else "not sound"


def _kept(env: DirtPushEnv) -> float:
    """What no step may change: the sum of heights without what soil has grown by as it loosened [m of one cell]."""
    world = env.episode.world
    return total(world) if env.config.terrain.kind == "voxel" else total(world) - grown(world, env.config.soil)


def _vary(name: str, table: Table, base: dict | None = None) -> tuple[str, bool]:
    """Every number of a table at very small and very large values."""
    counts, wrong = {"refused": 0, "sound": 0}, []
    for key, rule in table.rules.items():
        number = rule.number if isinstance(rule, Span) else rule
        if not isinstance(number, Number):
            continue
        ends = (
            [number.low, number.high]
            if not number.whole
            else [int(x) for x in (number.low, number.high) if abs(x) < 1e9]
        )
        for value in {x for x in (*ends, TINY, SMALL, LARGE, HUGE) if abs(x) < 1e300}:
            value = int(value) if number.whole and abs(value) > 1 else value
            found = _try({name: {**(base or {}), key: value}}, key)
            counts[found] = counts.get(found, 0) + 1
            if found not in ("refused", "sound"):
                wrong.append(f"{name}.{key} = {value:g}: {found}")
    text = f"{counts['refused']} refused, {counts['sound']} sound"
    return text + ("; " + "; ".join(wrong) if wrong else ""), not wrong


@case("soil: every number at 0, 1e-290, 1e-6, 1e6, 1e290 and its ends: refused, or sound", limit=300.0)
def extremes_of_soil():
    return _vary("soil", SOIL)


@case("blade: the same", limit=300.0)
def extremes_of_the_blade():
    return _vary("blade", BLADE)


@case("machine: the same", limit=300.0)
def extremes_of_the_machine():
    return _vary("machine", MACHINE)


@case("site: cells from 1e-290 to 1e290 m: refused, or sound", limit=300.0)
def extremes_of_the_site():
    return _vary("site", SITE, {"size": [16.0, 16.0]})


@case("task: the same", limit=300.0)
def extremes_of_the_task():
    return _vary("task", TASK)


@case("observation: the same", limit=300.0)
def extremes_of_the_observation():
    return _vary("observation", OBSERVATION)


@case("reward: weights from 1e-290 to 1e290: rewards finite", limit=300.0)
def extremes_of_the_reward():
    return _vary("reward", REWARD)


@case("layout: the same", limit=300.0)
def extremes_of_the_layout():
    return _vary("layout", LAYOUT)


@case("cells (terrain voxel): the same", limit=600.0)
def extremes_of_the_cells():
    return _vary("terrain", TERRAIN.tables["voxel"], {"kind": "voxel"})


@case("four numbers at a time at such values, 60 scenes: refused, or sound", limit=300.0)
def extremes_together():
    tables = {
        "soil": SOIL,
        "blade": BLADE,
        "machine": MACHINE,
        "task": TASK,
        "reward": REWARD,
        "observation": OBSERVATION,
    }
    keys = [(n, k, r) for n, table in tables.items() for k, r in table.rules.items() if isinstance(r, Number)]
    rng, counts, wrong = np.random.default_rng(0), {"refused": 0, "sound": 0}, []
    while sum(counts.values()) < 60:
        options = {}
        for pick in rng.choice(len(keys), 4, replace=False):
            name, key, rule = keys[pick]
            inside = [x for x in (0.0, TINY, SMALL, 1e-3, 1.0, 89.0, LARGE, HUGE) if _allowed(rule, x)]
            if inside and not rule.whole:
                options.setdefault(name, {})[key] = float(rng.choice(inside))
        found = _try(options, "")
        counts[found] = counts.get(found, 0) + 1
        if found not in ("refused", "sound"):
            wrong.append(f"{options}: {found}")
    return f"{counts['refused']} refused, {counts['sound']} sound" + (
        "; " + "; ".join(wrong) if wrong else ""
    ), not wrong


def _allowed(rule, value):
    try:
        rule.read(value, "", None)
    except ValueError:
        return False
    return True
