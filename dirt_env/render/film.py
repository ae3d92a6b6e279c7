"""An animated GIF of a recorded episode: some of its frames as pictures with one palette. Needs pillow."""

from collections.abc import Mapping
from io import BytesIO
from types import ModuleType
from typing import Any

import numpy as np

from dirt_env.render.picture import SIGNS, Picture
from dirt_env.render.track import DESIGN, GOAL, POSE_FIELDS, SOLID, START, UNIT, Frame, Track
from dirt_env.sim.params import Blade, Machine

_POSE = np.dtype([(name, "f8") for name in POSE_FIELDS])
_COLORS = 120
_LARGEST = 3_500_000  # bytes
_HOLD = 1.5  # s the last picture stays


def caption(time_s: float, stats: Mapping[str, float]) -> str:
    """One line about a moment: grade error, or else the share in the goal; time, load; whichever are known."""
    words = []
    if "grade_error_m" in stats:
        words.append(f"grade error {stats['grade_error_m']:.3f} m")
    elif "share_in_goal" in stats:
        words.append(f"share in goal {100 * stats['share_in_goal']:.0f} %")
    words.append(f"time {time_s:.0f} s")
    if "load_m3" in stats:
        words.append(f"load {stats['load_m3']:.1f} m³")
    return "   ".join(words)


def picture_of(track: Track, blade: Blade, machine: Machine, width_px: int) -> Picture:
    """The picture that fits a recorded episode."""
    start, goal, design, solid = ((track.mask & bit) > 0 for bit in (START, GOAL, DESIGN, SOLID))
    return Picture(
        track.cell,
        start,
        goal,
        design if design.any() else None,
        solid if solid.any() else None,
        track.target * UNIT,
        blade,
        machine,
        width_px=width_px,
    )


def chosen(count: int, pictures: int) -> list[int]:
    """At most `pictures` of `count` frames, evenly spread, the first and the last among them."""
    return sorted({round(index) for index in np.linspace(0, count - 1, min(count, max(2, pictures)))})


def gif(track: Track, blade: Blade, machine: Machine, seconds: float, fps: float, width_px: int) -> bytes:
    """The GIF's bytes. Shorter episodes are not stretched: they have as many pictures as frames.

    What would be a very large file gets half the pictures.
    """
    image = _pillow()
    picture = picture_of(track, blade, machine, width_px)
    wanted = set(chosen(len(track), round(seconds * fps)))
    shots = [_shot(picture, frame) for index, frame in enumerate(track.frames()) if index in wanted]
    some = np.concatenate([shots[index] for index in chosen(len(shots), 5)])
    palette = palette_of(some, _COLORS)
    film = [image.fromarray(shot).quantize(palette=palette, dither=image.Dither.NONE) for shot in shots]
    packed = _packed(film, 1000 / fps)
    while len(packed) > _LARGEST and len(film) > 2:
        fps *= (len(film) + 1) // 2 / len(film)
        film = [film[index] for index in chosen(len(film), (len(film) + 1) // 2)]
        packed = _packed(film, 1000 / fps)
    return packed


def _packed(film: list[Any], pause: float) -> bytes:
    """The pictures as one file; each is shown for `pause` milliseconds, the last one longer."""
    lasting = [round(pause)] * len(film)
    lasting[-1] += round(1000 * _HOLD)
    out = BytesIO()
    film[0].save(out, "GIF", save_all=True, append_images=film[1:], duration=lasting, loop=0, optimize=False)
    return out.getvalue()


def _shot(picture: Picture, frame: Frame) -> np.ndarray:
    pose = np.zeros((), _POSE)
    for name, value in zip(POSE_FIELDS, frame.pose, strict=True):
        pose[name] = value
    return picture.frame(frame.height, pose[()], caption(frame.time_s, frame.stats))


def palette_of(shot: np.ndarray, colors: int) -> Any:
    """A pillow image with the `colors` common colours of uint8 (h, w, 3), and the rare ones that mean something."""
    image = _pillow()
    common = image.fromarray(shot).quantize(colors, method=image.Quantize.MEDIANCUT).getpalette()[: 3 * colors]
    palette = image.new("P", (1, 1))
    palette.putpalette(common + [value for color in SIGNS for value in color])
    return palette


def _pillow() -> ModuleType:
    try:
        from PIL import Image
    except ImportError as error:
        raise ImportError('an animated picture needs pillow: pip install ".[render]" in the checkout') from error
    return Image
