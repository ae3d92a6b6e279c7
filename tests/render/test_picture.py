"""The picture from above: its shape, and that everything is drawn where it is."""

import subprocess
import sys

import numpy as np
import pytest

from dirt_env.render.dozer import ABOVE, BELOW, LEVEL, blade_color
from dirt_env.render.picture import Picture, round_length

MARGIN = 10


def picture(site, **changes):
    parts = {"start": site.start, "goal": site.goal, "design": None, "solid": site.solid, "target": site.target}
    parts |= {"blade": site.blade, "machine": site.machine, "width_px": 320}
    return Picture(site.cell, **(parts | changes))


def pixel(site, x, y, width_px=320):
    """Row and column of the site's point (x, y) in the picture."""
    scale = width_px / (site.target.shape[1] * site.cell)
    return round(MARGIN + site.target.shape[0] * site.cell * scale - y * scale), round(MARGIN + x * scale)


def test_frame_is_a_uint8_picture_of_constant_shape(site, make_pose):
    drawn = picture(site)
    plain = drawn.frame(site.height, make_pose(x=10, y=6))
    named = drawn.frame(site.height.astype("f4"), make_pose(x=10, y=6), "share in goal 93 %")
    assert plain.dtype == np.uint8
    assert plain.shape == named.shape
    assert plain.shape[1] == 320 + 2 * MARGIN
    assert plain.shape[0] % 2 == plain.shape[1] % 2 == 0
    assert not np.shares_memory(plain, drawn.frame(site.height, make_pose(x=10, y=6)))
    assert not np.array_equal(plain, named)


def test_same_input_same_picture(site, make_pose):
    frames = [picture(site).frame(site.height, make_pose(x=10, y=6, heading=1.0)) for _ in range(2)]
    assert np.array_equal(*frames)


@pytest.mark.parametrize(("rows", "cols"), [(24, 40), (40, 24), (3, 50), (700, 90)])
def test_any_shape_of_site(site, make_pose, rows, cols):
    nothing = np.zeros((rows, cols), bool)
    drawn = picture(site, start=nothing, goal=nothing, solid=None, target=np.zeros((rows, cols)), width_px=300)
    frame = drawn.frame(np.zeros((rows, cols)), make_pose(x=1, y=1))
    assert abs(frame.shape[0] - frame.shape[1]) == pytest.approx(abs(rows - cols) * 300 / max(rows, cols), abs=40)


@pytest.mark.parametrize(("x", "y", "heading"), [(5, 6, 0.0), (14, 3, 2.0), (10, 9, -1.2)])
def test_machine_is_drawn_where_the_pose_says(site, make_pose, x, y, heading):
    drawn = picture(site)
    pose = make_pose(x=x, y=y, heading=heading)
    changed = np.abs(drawn.frame(site.height, pose).astype(int) - drawn.frame(site.height, None)).sum(axis=2) > 30
    middle = np.argwhere(changed).mean(axis=0)
    ahead = 0.35  # m: machine and blade together reach farther ahead of the pivot than behind it
    expected = pixel(site, x + ahead * np.cos(heading), y + ahead * np.sin(heading))
    assert np.hypot(*(middle - expected)) < 0.5 * 320 / 20


@pytest.mark.parametrize("heading", [0.0, 0.8, np.pi / 2, 3.0])
def test_blade_is_at_its_true_place_and_width(site, make_pose, heading):
    pose = make_pose(x=10, y=6, heading=heading, edge=-0.2)
    frame = picture(site, solid=None, width_px=640).frame(site.height, pose).astype(int)
    red = np.argwhere(np.abs(frame - BELOW).sum(axis=2) < 60)
    scale = 640 / 20
    place = (np.array([MARGIN + 12 * scale, MARGIN]) - red) * [1, -1] / scale
    offset = place[:, ::-1] - (10, 6)
    ahead = offset @ (np.cos(heading), np.sin(heading))
    left = offset @ (-np.sin(heading), np.cos(heading))
    assert np.median(ahead) == pytest.approx(site.blade.reach, abs=0.15)
    assert np.ptp(left) == pytest.approx(site.blade.width, abs=0.2)


def test_blade_colour_tells_the_edge_height(site, make_pose):
    assert [blade_color(edge) for edge in (0.3, 0.0, -0.1)] == [ABOVE, LEVEL, BELOW]
    frames = [picture(site).frame(site.height, make_pose(x=10, y=6, edge=edge)).astype(int) for edge in (0.3, 0, -0.1)]
    for frame, color in zip(frames, (ABOVE, LEVEL, BELOW), strict=True):
        assert (np.abs(frame - color).sum(axis=2) < 40).sum() > 20


def test_machine_outside_the_picture_is_no_error(site, make_pose):
    drawn = picture(site)
    assert np.array_equal(drawn.frame(site.height, make_pose(x=-90, y=400)), drawn.frame(site.height, None))
    drawn.frame(site.height, make_pose(x=0, y=12))


def test_goal_is_blue_and_start_is_yellow_where_their_masks_are(site):
    frame = picture(site).frame(np.zeros_like(site.target), None).astype(int)
    bare = frame[pixel(site, 10, 11)]
    inside = frame[pixel(site, 15, 8)]
    assert inside[2] - inside[0] > bare[2] - bare[0] + 15
    edge = frame[pixel(site, 15, 5.5)[0] - 2 : pixel(site, 15, 5.5)[0] + 3, pixel(site, 15, 5.5)[1]]
    assert (edge[:, 2] - edge[:, 0]).max() > 120
    row, col = pixel(site, 8, 6)
    edge = frame[row, col - 4 : col + 5]
    assert (edge[:, 0] - edge[:, 2]).max() > 120


def test_regions_and_obstacles_change_only_their_surroundings(site):
    flat = np.zeros_like(site.target)
    nothing = np.zeros_like(site.goal)
    empty = picture(site, start=nothing, goal=nothing, solid=None).frame(flat, None).astype(int)
    solid = picture(site, start=nothing, goal=nothing).frame(flat, None).astype(int)
    changed = np.argwhere(np.abs(solid - empty).sum(axis=2) > 0)
    low, high = pixel(site, 9.5, 3), pixel(site, 10.5 + 0.5, 0)
    assert (changed >= np.array(low) - 3).all()
    assert (changed <= np.array(high) + 3).all()
    assert solid[pixel(site, 10, 1.5)].sum() < empty[pixel(site, 10, 1.5)].sum() / 2


@pytest.mark.parametrize("depth", [0.03, -0.03])
def test_a_film_or_rut_of_three_centimetres_is_seen(site, depth):
    drawn = picture(site)
    flat = np.zeros_like(site.target)
    film = flat.copy()
    film[18:22, 20:30] = depth
    before, after = (drawn.frame(height, None).astype(int)[pixel(site, 11, 10)] for height in (flat, film))
    assert np.abs(after - before).sum() > 25


def test_design_region_shows_what_is_missing_in_another_colour(site):
    nothing = np.zeros_like(site.goal)
    hole = np.full_like(site.target, -0.5)
    outside = picture(site, start=nothing, goal=nothing).frame(hole, None).astype(int)[pixel(site, 15, 8)]
    inside = picture(site, start=nothing, goal=nothing, design=site.goal).frame(hole, None).astype(int)
    assert inside[pixel(site, 15, 8)][2] > outside[2] + 15


def test_small_pictures_have_no_strip(site, make_pose):
    assert picture(site, width_px=100).frame(site.height, make_pose(x=10, y=6), "caption").shape == (60, 100, 3)


def test_a_long_caption_is_cut(site):
    drawn = picture(site)
    long = drawn.frame(site.height, None, "word " * 60)
    assert np.array_equal(long[:-34], drawn.frame(site.height, None)[:-34])


def test_width_is_checked(site):
    with pytest.raises(ValueError, match="width_px is 3; allowed: >= 16"):
        picture(site, width_px=3)


@pytest.mark.parametrize(("metres", "bar"), [(1.0, 1.0), (0.99, 0.5), (4.9, 2.0), (5.0, 5.0), (73.0, 50.0)])
def test_scale_bar_is_a_round_length(metres, bar):
    assert round_length(metres) == pytest.approx(bar)


def test_picture_needs_no_other_library():
    check = (
        "import sys, dirt_env.render.picture; print([m for m in ('pygame', 'PIL', 'matplotlib') if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_a_machine_too_small_to_see_gets_a_ring(site, make_pose):
    nothing = np.zeros((400, 400), bool)
    drawn = picture(site, start=nothing, goal=nothing, solid=None, target=np.zeros(nothing.shape), width_px=400)
    pose = make_pose(x=100, y=100)
    changed = (
        np.abs(drawn.frame(np.zeros(nothing.shape), pose).astype(int) - drawn.frame(nothing, None)).sum(axis=2) > 99
    )
    assert np.ptp(np.argwhere(changed), axis=0).min() >= 22
