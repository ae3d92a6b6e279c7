"""`python -m dirt_env.bench.jobs --out DIR`: a picture of every shipped job, before and after a scripted behaviour.

One PNG for each job: the site from above at the beginning and at the end of an episode. Needs pillow.
"""

import argparse
import sys
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np

from dirt_env.config import scene_names
from dirt_env.env import DirtPushEnv
from dirt_env.policy import load_policy
from dirt_env.render.atomic import write_atomically
from dirt_env.render.film import palette_of
from dirt_env.render.picture import Picture
from dirt_env.rollout import play
from dirt_env.scene.raster import require
from dirt_env.terminal import end, writable

LEVEL, LAYOUT = 1, 10_000
WIDTH = 280  # px of each of the two pictures
COLOURS = 96
BEHAVIOURS = {"slot": "slot"}  # where there is a goal and it is not the adaptive push


def behaviour(env: DirtPushEnv) -> str:
    """Name of the behaviour that a job is shown with."""
    if env.config.design is not None:
        return "grade"
    return BEHAVIOURS.get(env.config.name, "adaptive_push")


def before_and_after(scene: str, level: int = LEVEL, layout: int = LAYOUT, width_px: int = WIDTH) -> np.ndarray:
    """The site at the start and at the end of an episode side by side, uint8 (h, w, 3)."""
    env = DirtPushEnv(scene=scene, level=level, observation={"map": True})
    config = env.config
    frames: list[np.ndarray] = []
    pictures: list[Picture] = []

    def watch(env: DirtPushEnv, info: dict) -> None:
        world, one = env.episode.world, env.episode.layout
        if not pictures:
            regions = one.start, one.goal, one.design, one.solid, one.target
            pictures.append(Picture(config.grid.cell, *regions, config.blade, config.machine, width_px))
            frames.append(pictures[0].frame(world.height, world.machine[0], f"{config.name}, level {level}"))
        frames[1:] = [pictures[0].frame(world.height, world.machine[0], caption(env, info))]

    play(env, load_policy(behaviour(env), config), layout, config.steps, watch)
    return np.concatenate(frames, axis=1)


def caption(env: DirtPushEnv, info: dict) -> str:
    """What was reached when; short, for the strip under a picture has little room beside the scale."""
    reached = f"{info['share_in_goal']:.0%} in the goal"
    if env.config.design is not None:
        reached = f"error {info['grade_error_m']:.2f} m"
    return f"{info['time_s']:.0f} s: {reached}"


def write_png(path: Path, image: np.ndarray) -> None:
    """Write uint8 (h, w, 3) as a PNG with a palette of few colours, those of outlines and machine among them."""
    pillow = require("PIL.Image", "pillow")
    content = BytesIO()
    few = pillow.fromarray(image).quantize(palette=palette_of(image, COLOURS), dither=pillow.Dither.NONE)
    few.save(content, "PNG", optimize=True)
    write_atomically(path, content.getvalue())


def main(arguments: list[str] | None = None) -> int:
    """Write the pictures and say where they are."""
    parser = argparse.ArgumentParser("jobs", description="Pictures of the shipped jobs, before and after.")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the pictures")
    parser.add_argument("--job", action="append", choices=scene_names(), help="this one only (may be repeated)")
    options = parser.parse_args(arguments)
    return end("jobs", lambda: _draw(options.job or scene_names(), options.out))


def _draw(names: Sequence[str], folder: Path) -> int:
    out = writable(folder)
    for name in names:
        path = out / f"{name}.png"
        write_png(path, before_and_after(name))
        sys.stdout.write(f"wrote {path}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
