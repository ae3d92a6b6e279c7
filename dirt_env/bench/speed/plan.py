"""Which rows are measured: the chosen combinations, not all."""

from collections.abc import Sequence
from itertools import product

from dirt_env.bench.speed import full_load
from dirt_env.bench.speed.cases import ALONE, CASES, ONE_THREAD, has_adapter, need_adapter
from dirt_env.bench.speed.drives import DRIVES
from dirt_env.bench.speed.full_load import Push
from dirt_env.bench.speed.measure import Item

SMALLEST, LARGEST, MOST_WORLDS, MOST_THREADS = 24, 2048, 65536, 64
BASE = {"single": 1, "native": 256, "sync": 16, "sb3": 256, "world": 1}  # worlds where nobody says how many
SIDE = 64  # cells of the default site
FULL_LOAD = "full_load"


FULL = (
    *(Item("single", size, 1, 1, "random") for size in (SIDE, 32, 256, 1024)),
    *(Item("single", SIDE, 1, 1, drive) for drive in ("idle", "adaptive_push")),
    *(Item("native", SIDE, count, 1, "random") for count in (1, 16, 256, 1024, 4096)),
    *(Item("native", SIDE, count, 2, "random") for count in (256, 1024, 4096)),
    *(Item("native", SIDE, 256, threads, drive) for drive in ("idle", "adaptive_push") for threads in (1, 2)),
    *(Item("native", 32, count, threads, "random") for count, threads in ((256, 1), (4096, 1), (4096, 2))),
    *(Item("native", 256, count, threads, "random") for count, threads in ((16, 1), (256, 1), (256, 2))),
    *(Item("native", 1024, count, 1, "random") for count in (1, 16)),
    *(Item("sync", SIDE, count, 1, "random") for count in (16, 256)),
    *(Item("sb3", SIDE, count, threads, "random") for count, threads in ((16, 1), (256, 1), (256, 2))),
    *(Item("world", size, 1, 1, "random") for size in (SIDE, 32, 256, 1024)),
    *(Item("world", SIDE, 1, 1, drive) for drive in ("idle", "adaptive_push")),
    Item("world", SIDE, 256, 1, "random"),
)
FEW = (
    Item("single", SIDE, 1, 1, "random"),
    Item("native", SIDE, 256, 1, "random"),
    Item("native", SIDE, 256, 2, "random"),
    Item("sync", SIDE, 16, 1, "random"),
    Item("sb3", SIDE, 256, 1, "random"),
    Item("world", SIDE, 1, 1, "random"),
    Item("world", SIDE, 1, 1, "idle"),
)


def plan(
    quick: bool = False,
    cases: Sequence[str] = (),
    sizes: Sequence[str] = (),
    counts: Sequence[str] = (),
    threads: Sequence[str] = (),
    drives: Sequence[str] = (),
) -> list[Item | Push]:
    """The rows to measure: a fixed set, or every combination of what was chosen, and the base of all else.

    Raises ValueError that names what is wrong, and ImportError where sb3 is chosen and missing; it is left out where
    nobody chose it.
    """
    _known("--case", cases, tuple(CASES))
    _known("--drive", drives, (*DRIVES, FULL_LOAD))
    chosen_sizes = _numbers("--size", sizes, SMALLEST, LARGEST)
    chosen_counts = _numbers("--num-envs", counts, 1, MOST_WORLDS)
    chosen_threads = _numbers("--threads", threads, 1, MOST_THREADS)
    if not (cases or sizes or counts or threads or drives):
        items, pushes = list(FEW if quick else FULL), list(full_load.FEW if quick else full_load.FULL)
    else:
        driven = [drive for drive in drives if drive != FULL_LOAD] if drives else ["random"]
        worlds, crew = chosen_counts or [None], chosen_threads or [1]
        wanted = product(cases or CASES, chosen_sizes or [SIDE], worlds, crew, driven)
        items = list(dict.fromkeys(_item(*parts) for parts in wanted))
        pushes = _pushes(quick, cases, chosen_sizes) if FULL_LOAD in drives else []
    if "sb3" in cases:
        need_adapter()
    if not has_adapter():
        items = [item for item in items if item.case != "sb3"]
    return [*items, *pushes]


def _pushes(quick: bool, cases: Sequence[str], sizes: Sequence[int]) -> list[Push]:
    """The pushes with a full load; they are of the case `world`."""
    if cases and "world" not in cases:
        raise ValueError(f"--drive is {FULL_LOAD!r} with --case {', '.join(cases)}; allowed: with the case world")
    pushes = full_load.FEW if quick else full_load.FULL
    if not sizes:
        return list(pushes)
    ways = dict.fromkeys((push.yaw, push.tolerance) for push in pushes)
    small = [size for size in sizes if size < full_load.LEAST]
    if small:
        raise ValueError(f"--size is {small[0]} with a full load; allowed: whole numbers from {full_load.LEAST}")
    return [Push(size, *way) for size in sizes for way in ways]


def _item(case: str, size: int, count: int | None, threads: int, drive: str) -> Item:
    """One combination; cases that have but one world or thread keep to it."""
    worlds = 1 if case in ALONE else count or BASE[case]
    return Item(case, size, worlds, 1 if case in ONE_THREAD else threads, drive)


def _known(option: str, names: Sequence[str], allowed: Sequence[str]) -> None:
    for name in names:
        if name not in allowed:
            raise ValueError(f"{option} is {name!r}; allowed: {', '.join(allowed)}")


def _numbers(option: str, texts: Sequence[str], least: int, most: int) -> list[int]:
    """The whole numbers that the texts say."""
    for text in texts:
        if not text.isascii() or not text.isdigit() or not least <= int(text) <= most:
            raise ValueError(f"{option} is {text!r}; allowed: whole numbers from {least} to {most}")
    return [int(text) for text in texts]
