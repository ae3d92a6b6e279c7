"""The recorder: what is kept, what the files contain, and what happens when something goes wrong."""

import base64
import json
import re
import zlib

import numpy as np
import pytest

from dirt_env.render.cell_track import Cells
from dirt_env.render.replay import Recorder


def record(site, make_pose, frames=12, **options):
    """A recording of a heap that moves east, and the heights that went in."""
    recorder = Recorder("Demo", "a heap", site.cell, site.blade, site.machine, **options)
    recorder.begin("first", start=site.start, goal=site.goal, solid=site.solid, target=site.target)
    heights = [np.roll(site.height, step, axis=1) for step in range(frames)]
    for step, height in enumerate(heights):
        pose = make_pose(x=2 + step / 2, y=6, heading=0.1 * step, edge=-0.1)
        recorder.add(height, pose, 0.5 * step, {"share_in_goal": step / frames, "load_m3": 1.5})
    return recorder, heights


def payload(page):
    return json.loads(re.search(r'<script type="application/json" id="replay">(.*?)</script>', page, re.S)[1])


def numbers(text, dtype):
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype)


def decoded_heights(episode):
    """The heights as a reader would get them who has only the description of the format."""
    cells = episode["rows"] * episode["cols"]
    stream = numbers(episode["heights"], np.uint8)
    now = stream[: 4 * cells].view("<i4").astype(int)
    frames = [now]
    for change in stream[4 * cells :].reshape(-1, 2, cells).astype(int):
        step = change[0] + 256 * change[1]
        now = now + np.where(step > 32767, step - 65536, step)
        frames.append(now)
    return np.array(frames).reshape(-1, episode["rows"], episode["cols"]) * episode["unit"]


def test_html_carries_the_heights_to_half_a_millimetre(site, make_pose, tmp_path):
    recorder, heights = record(site, make_pose)
    recorder.write_html(tmp_path / "replay.html")
    episode = payload((tmp_path / "replay.html").read_text("utf-8"))["episodes"][0]
    assert episode["frames"] == 12
    assert decoded_heights(episode) == pytest.approx(np.array(heights), abs=0.5001e-3)


def test_html_carries_poses_times_statistics_and_regions(site, make_pose, tmp_path):
    recorder, _ = record(site, make_pose)
    recorder.write_html(tmp_path / "replay.html")
    replay = payload((tmp_path / "replay.html").read_text("utf-8"))
    episode = replay["episodes"][0]
    assert (replay["title"], replay["description"], episode["label"]) == ("Demo", "a heap", "first")
    assert replay["blade"]["width"] == site.blade.width
    assert numbers(episode["poses"], "<f4").reshape(10, 12)[0] == pytest.approx(2 + np.arange(12) / 2)
    assert numbers(episode["times"], "<f4") == pytest.approx(np.arange(12) / 2)
    assert episode["stat_names"] == ["share_in_goal", "load_m3"]
    assert numbers(episode["stats"], "<f4").reshape(2, 12)[0] == pytest.approx(np.arange(12) / 12)
    mask = numbers(episode["mask"], np.uint8).reshape(site.start.shape)
    for bit, region in ((1, site.start), (2, site.goal), (8, site.solid)):
        assert np.array_equal(mask & bit > 0, region)


def test_html_asks_no_other_host(site, make_pose, tmp_path):
    record(site, make_pose)[0].write_html(tmp_path / "replay.html")
    page = (tmp_path / "replay.html").read_text("utf-8")
    assert not re.search(
        r"https?:|//[a-z0-9-]+\.[a-z]|@import|url\(|\bsrc=|<link(?! rel=\"icon\" href=\"data:,\")", page
    )
    assert "{{" not in page


def test_text_cannot_become_markup(site, make_pose, tmp_path):
    evil = "</script><script>alert(1)</script><!-- {{DATA}} \u2028 &"
    recorder = Recorder(evil, evil, site.cell, site.blade, site.machine)
    recorder.begin(evil, start=site.start, goal=site.goal, target=site.target)
    recorder.add(site.height, make_pose(), 0.0, {evil: 1.0})
    recorder.write_html(tmp_path / "replay.html")
    page = (tmp_path / "replay.html").read_text("utf-8")
    assert "alert(1)</script>" not in page
    assert page.count("<script") == 2
    replay = payload(page)
    assert replay["title"] == replay["episodes"][0]["label"] == replay["episodes"][0]["stat_names"][0] == evil


def test_a_jump_of_many_metres_is_caught_up(site, make_pose, tmp_path):
    recorder = Recorder("", "", site.cell, site.blade, site.machine)
    recorder.begin("", start=site.start, goal=site.goal, target=site.target)
    for level in (0.0, 900.0, 900.0, *[-900.0] * 60):
        recorder.add(np.full_like(site.height, level), make_pose(), 0.0, {})
    recorder.write_html(tmp_path / "replay.html")
    heights = decoded_heights(payload((tmp_path / "replay.html").read_text("utf-8"))["episodes"][0])
    assert heights[0].max() == 0
    assert heights[-1] == pytest.approx(-900, abs=1e-3)
    assert [frame.height[0, 0] for frame in recorder.tracks[0].frames()] == pytest.approx(heights[:, 0, 0], abs=1e-3)


@pytest.mark.parametrize(("every", "kept"), [(1, list(range(12))), (5, [0, 5, 10, 11]), (11, [0, 11]), (50, [0, 11])])
def test_every_nth_moment_and_the_last_are_kept(site, make_pose, every, kept, tmp_path):
    recorder, heights = record(site, make_pose, every=every)
    recorder.write_html(tmp_path / "replay.html")
    episode = payload((tmp_path / "replay.html").read_text("utf-8"))["episodes"][0]
    assert numbers(episode["times"], "<f4") == pytest.approx(np.array(kept) / 2)
    assert decoded_heights(episode) == pytest.approx(np.array(heights)[kept], abs=0.5001e-3)


def test_episodes_may_have_their_own_regions_and_recording_may_go_on_after_writing(site, make_pose, tmp_path):
    recorder, _ = record(site, make_pose)
    recorder.write_html(tmp_path / "replay.html")
    recorder.add(site.height, make_pose(), 6.0, {"late": 1.0})
    recorder.begin("second", start=site.goal, goal=site.start, target=site.target + 1, design=site.goal)
    recorder.add(site.height, make_pose(), 0.0, {})
    recorder.begin("empty", start=site.start, goal=site.goal, target=site.target)
    recorder.write_html(tmp_path / "replay.html")
    first, second = payload((tmp_path / "replay.html").read_text("utf-8"))["episodes"]
    assert first["frames"] == 13
    assert np.isnan(numbers(first["stats"], "<f4").reshape(3, 13)[2, :12]).all()
    assert numbers(second["target"], "<i4").max() == 1000
    assert np.array_equal(numbers(second["mask"], np.uint8) & 4 > 0, site.goal.ravel())


def test_large_sites_are_recorded_coarser(site, make_pose, tmp_path):
    shape = (300, 520)
    x = np.broadcast_to(np.arange(520.0), shape)
    wall = x == 7
    recorder = Recorder("", "", 0.5, site.blade, site.machine)
    recorder.begin("", start=x < 90, goal=x > 400, solid=wall, target=np.zeros(shape))
    recorder.add(x, make_pose(), 0.0, {})
    recorder.write_html(tmp_path / "replay.html")
    episode = payload((tmp_path / "replay.html").read_text("utf-8"))["episodes"][0]
    assert (episode["rows"], episode["cols"], episode["cell"]) == (100, 174, 1.5)
    assert decoded_heights(episode)[0, 0, :3] == pytest.approx([1, 4, 7])
    assert (numbers(episode["mask"], np.uint8).reshape(100, 174)[:, 2] & 8).all()


def test_recording_is_small(site, make_pose):
    recorder, _ = record(site, make_pose, frames=300)
    assert len(recorder.tracks[0].heights()) < 300 * site.height.size / 4


def test_keep_forgets_the_later_episodes_and_no_moment_of_the_others(site, make_pose, tmp_path):
    recorder, _ = record(site, make_pose, frames=12, every=5)
    recorder.begin("second", start=site.start, goal=site.goal, target=site.target)
    for step in range(3):
        recorder.add(site.height, make_pose(), 0.5 * step, {})
    recorder.keep(1)
    recorder.write_html(tmp_path / "replay.html")
    episodes = payload((tmp_path / "replay.html").read_text("utf-8"))["episodes"]
    assert [(episode["label"], episode["frames"]) for episode in episodes] == [("first", 4)]


def test_keeping_all_keeps_the_last_moment(site, make_pose):
    recorder, _ = record(site, make_pose, frames=12, every=5)
    recorder.keep(1)
    recorder.begin("second", start=site.start, goal=site.goal, target=site.target)
    assert len(recorder.tracks[0]) == 4


def test_a_title_that_is_no_unicode_is_written(site, make_pose, tmp_path):
    recorder, _ = record(site, make_pose)
    recorder.title = "gr\udcfcn"
    recorder.write_html(tmp_path / "replay.html")
    assert payload((tmp_path / "replay.html").read_text("utf-8"))["title"] == "gr?n"


def with_cells(site, make_pose, every=1):
    """A recording of cells that come and go, with some in the air, and the fills that went in."""
    recorder = Recorder("Cells", "", site.cell, site.blade, site.machine, every=every)
    recorder.begin("", start=site.start, goal=site.goal, target=site.target)
    rng = np.random.default_rng(0)
    fill = np.zeros((*site.height.shape, 5))
    fill[:, :, :2] = 1.0
    fills = []
    for step in range(40):
        fill[rng.integers(24, size=30), rng.integers(40, size=30), rng.integers(2, 5, size=30)] = rng.random(30)
        fills.append(fill.copy())
        recorder.add(site.height, make_pose(), 0.5 * step, {}, Cells(fill, -1.0, 0.5))
    return recorder, fills


def decoded_fills(episode):
    """The fills as a reader would get them who has only the description of the format."""
    shape = episode["rows"], episode["cols"], episode["cells"]["levels"]
    stream = numbers(episode["cells"]["fills"], np.uint8)
    now, at = stream[: np.prod(shape)].copy(), int(np.prod(shape))
    frames = [now.copy()]
    while at < len(stream):
        count = int(stream[at : at + 4].view("<u4")[0])
        steps = stream[at + 4 : at + 4 + 4 * count].reshape(4, count).astype(int)
        places = np.cumsum(steps[0] + 256 * steps[1] + 65536 * steps[2] + 16777216 * steps[3])
        now[places] = stream[at + 4 + 4 * count : at + 4 + 5 * count]
        at += 4 + 5 * count
        frames.append(now.copy())
    return np.array(frames).reshape(-1, *shape) / episode["cells"]["per_fill"]


@pytest.mark.parametrize("every", [1, 7])
def test_html_carries_the_cells_to_a_four_hundredth(site, make_pose, tmp_path, every):
    recorder, fills = with_cells(site, make_pose, every)
    recorder.write_html(tmp_path / "replay.html")
    episode = payload((tmp_path / "replay.html").read_text("utf-8"))["episodes"][0]
    kept = sorted({*range(0, 40, every), 39})
    assert episode["cells"].items() >= {"bottom": -1.0, "dy": 0.5, "levels": 5, "per_fill": 200}.items()
    found = decoded_fills(episode)
    assert len(found) == len(kept)
    assert np.abs(found - np.array(fills)[kept]).max() <= 1 / 400 + 1e-12
    assert len(numbers(episode["cells"]["fills"], np.uint8)) < fills[0].size * (1 + len(kept) / 4)


def test_cells_of_large_sites_are_recorded_coarser(site, make_pose, tmp_path):
    recorder = Recorder("", "", 0.5, site.blade, site.machine)
    nothing = np.zeros((300, 520), bool)
    recorder.begin("", start=nothing, goal=nothing, target=np.zeros(nothing.shape))
    fill = np.zeros((300, 520, 2))
    fill[:3, :3, 0], fill[0, :3, 1] = 1.0, 0.75
    recorder.add(np.zeros(nothing.shape), make_pose(), 0.0, {}, Cells(fill, 0.0, 0.5))
    recorder.write_html(tmp_path / "replay.html")
    episode = payload((tmp_path / "replay.html").read_text("utf-8"))["episodes"][0]
    assert decoded_fills(episode)[0, 0, :2].tolist() == [[1.0, 0.25], [0.0, 0.0]]


def test_cells_are_recorded_always_or_never(site, make_pose):
    recorder, _ = record(site, make_pose)
    with pytest.raises(ValueError, match="at every moment of an episode, or at none"):
        recorder.add(site.height, make_pose(), 6.0, {}, Cells(np.zeros((24, 40, 2)), 0.0, 0.5))
    assert len(recorder.tracks[0]) == 12
    recorder, _ = with_cells(site, make_pose)
    with pytest.raises(ValueError, match=r"fill has shape \(24, 40, 3\); allowed: \(24, 40, 5\)"):
        recorder.add(site.height, make_pose(), 20.0, {}, Cells(np.zeros((24, 40, 3)), 0.0, 0.5))
    assert len(recorder.tracks[0]) == 40


def test_misuse_is_named(site, make_pose, tmp_path):
    with pytest.raises(ValueError, match="every is 0; allowed: >= 1"):
        Recorder("", "", 0.5, site.blade, site.machine, every=0)
    recorder = Recorder("", "", 0.5, site.blade, site.machine)
    with pytest.raises(RuntimeError, match="call begin first"):
        recorder.add(site.height, make_pose(), 0.0, {})
    recorder.begin("", start=site.start, goal=site.goal, target=site.target)
    with pytest.raises(RuntimeError, match="nothing was recorded"):
        recorder.write_html(tmp_path / "replay.html")
    with pytest.raises(ValueError, match=r"height has shape \(2, 2\)"):
        recorder.add(np.zeros((2, 2)), make_pose(), 0.0, {})
