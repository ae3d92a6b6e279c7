"""The animated picture."""

import builtins

import numpy as np
import pytest

from dirt_env.render import film
from dirt_env.render.film import caption, chosen
from dirt_env.render.replay import Recorder


def record(site, make_pose, frames):
    recorder = Recorder("", "", site.cell, site.blade, site.machine)
    recorder.begin("", start=site.start, goal=site.goal, solid=site.solid, target=site.target)
    for step in range(frames):
        recorder.add(site.height, make_pose(x=2 + 0.2 * step, y=6, edge=-0.1), step, {"share_in_goal": step / frames})
    return recorder


@pytest.mark.parametrize(("frames", "seconds", "pictures"), [(60, 2.0, 20), (5, 2.0, 5), (1, 2.0, 1)])
def test_gif_has_as_many_pictures_as_asked_for_and_no_more_than_frames(
    site, make_pose, tmp_path, frames, seconds, pictures
):
    image = pytest.importorskip("PIL.Image")
    record(site, make_pose, frames).write_gif(tmp_path / "film.gif", seconds=seconds, fps=10, width_px=200)
    with image.open(tmp_path / "film.gif") as shown:
        assert getattr(shown, "n_frames", 1) == pictures
        assert shown.size == (220, 174)


def test_gif_keeps_the_colours_that_mean_something(site, make_pose, tmp_path):
    image = pytest.importorskip("PIL.Image")
    record(site, make_pose, 10).write_gif(tmp_path / "film.gif", seconds=1, fps=10, width_px=300)
    with image.open(tmp_path / "film.gif") as shown:
        shown.seek(5)
        shot = np.asarray(shown.convert("RGB")).astype(int)
    for color in ((213, 60, 0), (20, 120, 220), (255, 200, 60)):
        assert (np.abs(shot - color).sum(axis=2) < 30).sum() > 15


def test_frames_are_spread_evenly():
    assert chosen(100, 4) == [0, 33, 66, 99]
    assert chosen(3, 10) == [0, 1, 2]
    assert chosen(1, 5) == [0]


def test_caption_says_what_is_known():
    assert caption(12.4, {}) == "time 12 s"
    assert caption(12, {"share_in_goal": 0.9, "grade_error_m": 0.0594}) == "grade error 0.059 m   time 12 s"
    assert caption(12, {"share_in_goal": 0.934, "load_m3": 1.25}) == "share in goal 93 %   time 12 s   load 1.2 m³"


def test_without_pillow_the_error_says_what_to_install(site, make_pose, tmp_path, monkeypatch):
    real = builtins.__import__

    def without(name, *args, **options):
        if name == "PIL":
            raise ImportError(name)
        return real(name, *args, **options)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ImportError, match=r'pip install "\.\[render\]" in the checkout'):
        record(site, make_pose, 2).write_gif(tmp_path / "film.gif")
    assert not (tmp_path / "film.gif").exists()


def test_a_large_gif_gets_fewer_pictures_and_lasts_as_long(site, make_pose, tmp_path, monkeypatch):
    image = pytest.importorskip("PIL.Image")
    monkeypatch.setattr(film, "_LARGEST", 20_000)
    record(site, make_pose, 40).write_gif(tmp_path / "film.gif", seconds=4, fps=10, width_px=200)
    with image.open(tmp_path / "film.gif") as shown:
        assert 2 <= shown.n_frames < 40
        lasting = [shown.seek(index) or shown.info["duration"] for index in range(shown.n_frames)]
    assert sum(lasting) == pytest.approx(5500, rel=0.15)
