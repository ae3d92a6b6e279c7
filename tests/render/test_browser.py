"""The replay in a real browser: it draws, with and without a graphics card, and says nothing on the console."""

import re
import shutil
import subprocess
import tempfile

import numpy as np
import pytest

from dirt_env.render.cell_track import Cells
from dirt_env.render.pair import write_pair
from dirt_env.render.replay import Recorder

CHROMIUM = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None
)
FLAGS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--window-size=1000,700"),
    *("--enable-logging=stderr", "--virtual-time-budget=2000"),
]

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the PATH"),
]


@pytest.fixture
def replay(site, make_pose, tmp_path):
    path = tmp_path / "replay.html"
    recorder = Recorder("Heap </script>", "a <b>site</b>", site.cell, site.blade, site.machine)
    for label in ("one", "two"):
        recorder.begin(label, start=site.start, goal=site.goal, solid=site.solid, target=site.target)
        for step in range(80):
            pose = make_pose(x=2 + 0.2 * step, y=6, heading=0.02 * step, edge=-0.1)
            recorder.add(np.roll(site.height, step // 4, axis=1), pose, 0.5 * step, {"share_in_goal": step / 79})
    recorder.write_html(path)
    return path


@pytest.fixture
def cells(site, make_pose, tmp_path):
    """A replay of level ground of cells over which, after a while, some hang in the air."""
    path = tmp_path / "cells.html"
    recorder = Recorder("Cells", "", site.cell, site.blade, site.machine)
    nothing = np.zeros_like(site.goal)
    recorder.begin("", start=nothing, goal=nothing, solid=site.solid, target=site.target)
    for step in range(80):
        fill = np.zeros((*site.target.shape, 6))
        fill[:, :, :2] = 1.0
        fill[10:12, 18:24, 2] = 0.5
        fill[10:12, 18:24, 5] = 1.0 if step > 40 else 0.0
        recorder.add(site.target, make_pose(x=2, y=6), 0.5 * step, {}, Cells(fill, -1.0, 0.5))
    recorder.write_html(path)
    return path


def browse(path, hash_, folder, *flags):
    """The page after its scripts ran, and what was said on the console."""
    profile = tempfile.mkdtemp(prefix="profile", dir=folder)  # one that the browser before still holds makes it wait
    command = [CHROMIUM, *FLAGS, f"--user-data-dir={profile}", *flags, f"{path.as_uri()}#{hash_}"]
    done = subprocess.run(command, capture_output=True, timeout=120, check=True)
    said = re.findall(r':CONSOLE[:(]\d+\)?\] "(.*)"', done.stderr.decode("utf-8", "replace"))
    return done.stdout.decode("utf-8"), [line for line in said if "GL Driver Message" not in line]


@pytest.mark.parametrize(
    ("renderer", "flags"), [("webgl2", []), ("canvas", ["--disable-3d-apis"])], ids=["webgl2", "canvas"]
)
def test_replay_draws_without_a_word(replay, tmp_path, renderer, flags):
    page, said = browse(replay, "at=20&episode=1&camera=follow", tmp_path, "--dump-dom", *flags)
    assert said == []
    assert re.search(rf'<html[^>]*data-renderer="{renderer}"[^>]*data-state="ready"', page)
    assert "0:20 / 0:39" in page
    assert re.search(r"<dt[^>]*>share in goal</dt><dd[^>]*>50.6 %</dd>", page)
    assert '<h1 id="title">Heap &lt;/script&gt;</h1>' in page


@pytest.mark.parametrize("renderer", ["webgl2", "canvas"])
def test_the_ground_is_seen(replay, tmp_path, renderer):
    image = pytest.importorskip("PIL.Image")
    shot = tmp_path / "shot.png"
    browse(replay, f"at=10&camera=top&renderer={renderer}", tmp_path, f"--screenshot={shot}")
    with image.open(shot) as picture:
        middle = np.asarray(picture.convert("RGB")).astype(int)[150:550, 200:800]
    assert ((middle[..., 0] - middle[..., 2]) > 25).mean() > 0.5, "earth in the middle"
    assert ((middle[..., 2] - middle[..., 0]) > 60).sum() > 100, "the goal's blue outline"
    assert ((middle[..., 0] > 180) & (middle[..., 2] < 90)).sum() > 100, "yellow: start and machine"


@pytest.mark.parametrize(
    ("renderer", "flags"), [("webgl2", []), ("canvas", ["--disable-3d-apis"])], ids=["webgl2", "canvas"]
)
def test_the_cells_are_seen_with_the_soil_that_hangs_over_them(cells, tmp_path, renderer, flags):
    image = pytest.importorskip("PIL.Image")

    def shot(name, hash_):
        path = tmp_path / f"{name}.png"
        _, said = browse(cells, hash_, tmp_path, f"--screenshot={path}", *flags)
        assert said == []
        with image.open(path) as picture:
            return np.asarray(picture.convert("RGB")).astype(int)[90:550, 150:730]

    surface, early, late = (
        shot(name, hash_)
        for name, hash_ in (("surface", "at=5"), ("early", "at=5&ground=cells"), ("late", "at=30&ground=cells"))
    )
    steps = [(np.abs(np.diff(picture.sum(axis=2), axis=0)) > 60).sum() for picture in (surface, early)]
    assert steps[1] > 2 * steps[0], "the cells' outlines"
    changed = np.abs(late - early).sum(axis=2) > 60
    assert 300 < changed.sum() < 20000, "soil hangs in the air"


def test_the_switch_is_there_where_cells_were_recorded(cells, replay, tmp_path):
    page, said = browse(cells, "at=5&ground=cells", tmp_path, "--dump-dom")
    assert said == []
    assert re.search(r'<span class="group" id="grounds" role="group" aria-label="ground">', page)
    assert re.search(r'<button data-ground="cells"[^>]*class="on"', page)
    page, said = browse(replay, "at=5&ground=cells", tmp_path, "--dump-dom")
    assert said == []
    assert re.search(r'<span class="group" id="grounds"[^>]*hidden', page)


def test_a_job_with_a_design_shows_its_grade_error(site, make_pose, tmp_path):
    recorders = {}
    for name, last in (("left", 0.1), ("right", 0.3)):
        recorders[name] = recorder = Recorder(name, "", site.cell, site.blade, site.machine)
        recorder.begin("", start=site.start, goal=site.goal, solid=site.solid, target=site.target)
        for error in (0.5, last):
            stats = {"share_in_goal": 0.5, "grade_error_m": error}
            recorder.add(site.height, make_pose(x=2, y=6), 10.0 * (error != 0.5), stats)
    recorders["left"].write_html(tmp_path / "one.html")
    write_pair(tmp_path / "two.html", "", recorders)
    page, said = browse(tmp_path / "one.html", "at=10", tmp_path, "--dump-dom")
    assert said == []
    assert re.search(r'<dt class="main">grade error</dt><dd class="main">0.10 m</dd><dt>share in goal', page)
    page, said = browse(tmp_path / "two.html", "at=10", tmp_path, "--dump-dom")
    assert said == []
    assert re.findall(r'<dt class="main">grade error</dt><dd class="main">([\d.]+) m</dd>', page) == ["0.10", "0.30"]


@pytest.fixture
def pair(site, make_pose, tmp_path):
    """The page of two recordings; that on the right ends earlier and with more in the goal."""
    recorders = {}
    for name, steps, share in (("slow </script>", 80, 0.4), ("my_rules:Fast", 40, 0.9)):
        recorders[name] = recorder = Recorder(name, "a site", site.cell, site.blade, site.machine)
        recorder.begin("one", start=site.start, goal=site.goal, solid=site.solid, target=site.target)
        for step in range(steps):
            pose = make_pose(x=2 + 0.2 * step, y=6, edge=-0.1)
            recorder.add(site.height, pose, 0.5 * step, {"share_in_goal": share * step / (steps - 1)})
    write_pair(tmp_path / "pair.html", "a <b>site</b>", recorders)
    return tmp_path / "pair.html"


@pytest.mark.parametrize(
    ("renderer", "flags"), [("webgl2", []), ("canvas", ["--disable-3d-apis"])], ids=["webgl2", "canvas"]
)
def test_two_policies_share_one_clock(pair, tmp_path, renderer, flags):
    page, said = browse(pair, "at=30&camera=top", tmp_path, "--dump-dom", *flags)
    assert said == []
    assert re.search(rf'<html[^>]*data-renderer="{renderer}"[^>]*data-state="ready"', page)
    assert "0:30 / 0:39" in page
    sides = re.findall(r"<section.*?</section>", page, re.S)
    assert ["<h1>slow &lt;/script&gt;</h1>" in sides[0], "<h1>my_rules:Fast</h1>" in sides[1]] == [True, True]
    shares = [re.search(r"share in goal</dt><dd[^>]*>([\d.]+) %", side)[1] for side in sides]
    assert shares == ["30.4", "90.0"]
    assert [re.search(r"ends at</dt><dd>([\d:]+)<", side)[1] for side in sides] == ["0:39", "0:19"]
