"""Pictures of the jobs: before and after side by side, the same ones each time, small on disk."""

import sys

import numpy as np
import pytest

from dirt_env.bench import draft, jobs, paper
from dirt_env.bench.jobs import before_and_after, behaviour, caption, write_png
from dirt_env.config import scene_names
from dirt_env.env import DirtPushEnv
from dirt_env.policy import policy_names
from dirt_env.render.lettering import text
from dirt_env.render.overlay import START


def test_every_job_is_shown_with_a_behaviour_that_can_play_it():
    for name in scene_names():
        env = DirtPushEnv(scene=name)
        assert behaviour(env) in policy_names()
        assert (behaviour(env) == "grade") == (env.config.design is not None)


@pytest.mark.parametrize(("scene", "words"), [("heap", "720 s: 100% in the goal"), ("pad", "720 s: error 0.12 m")])
def test_captions_have_units_and_fit(scene, words):
    shown = caption(DirtPushEnv(scene=scene), {"time_s": 720.0, "share_in_goal": 1.0, "grade_error_m": 0.12})
    assert shown == words
    assert text(shown, 7).shape[1] <= 120, "px beside a scale of 10 m under a map of 280 px"


@pytest.mark.slow
def test_a_picture_shows_the_start_and_the_end(tmp_path):
    pillow = pytest.importorskip("PIL.Image")
    image = before_and_after("ramp", 0, 8000, width_px=200)
    assert image.dtype == np.uint8
    before, after = np.split(image, 2, axis=1)
    assert (before != after).any()
    assert np.array_equal(image, before_and_after("ramp", 0, 8000, width_px=200))
    write_png(tmp_path / "ramp.png", image)
    assert pillow.open(tmp_path / "ramp.png").size == image.shape[1::-1]
    assert (tmp_path / "ramp.png").stat().st_size < 100_000


def test_thin_outlines_keep_their_colours(tmp_path):
    pillow = pytest.importorskip("PIL.Image")
    image = np.random.default_rng(0).integers((90, 60, 20), (170, 150, 120), (120, 120, 3), dtype=np.uint8)
    image[5, 5:25] = START
    write_png(tmp_path / "it.png", image)
    shown = np.asarray(pillow.open(tmp_path / "it.png").convert("RGB"))
    assert (shown[5, 5:25] == START).all()


@pytest.mark.parametrize("report", [draft, jobs, paper])
def test_an_out_that_is_no_folder_is_one_clear_line(report, tmp_path, monkeypatch, capsys):
    (tmp_path / "file").write_text("mine")
    monkeypatch.setattr(sys, "argv", ["it", "--out", str(tmp_path / "file")])
    assert report.main() == 2
    said = capsys.readouterr().err
    assert said.startswith(f"{report.__name__.rpartition('.')[2]}: error: --out is {tmp_path / 'file'}")
    assert said.count("\n") == 1
