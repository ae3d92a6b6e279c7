"""Two recordings of the same layouts side by side on one page, with one clock."""

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from dirt_env.render.atomic import write_atomically
from dirt_env.render.page import build_page
from dirt_env.render.replay import Recorder


def write_pair(path: str | PathLike[str], description: str, recorders: Mapping[str, Recorder]) -> None:
    """Write the page, one file that needs nothing else, of two recordings by what they are headed.

    Raises ValueError for recordings of sites that differ, RuntimeError if nothing was recorded.
    """
    sides = [{**recorder.as_json(), "title": heading} for heading, recorder in recorders.items()]
    for index, (a, b) in enumerate(zip(*(side["episodes"] for side in sides), strict=False), 1):
        if any(a[key] != b[key] for key in ("rows", "cols", "cell", "mask", "target")):
            raise ValueError(f"episode {index} is on another layout on the right; allowed: the same on both sides")
    page = {"title": " and ".join(recorders), "description": description, "sides": sides}
    write_atomically(Path(path), build_page(page, "pair").encode("utf-8", "replace"))
