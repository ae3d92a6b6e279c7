"""What a policy is shown: pixels, entries and squares at known places."""

import numpy as np
import pytest

from dirt_env.sim.params import Blade, Grid, Machine
from dirt_env.sim.state import POSE
from dirt_env.task.job import make_job
from dirt_env.task.observation import (
    POSE_ENTRIES,
    Sight,
    bounds,
    make_view,
    observe,
    pose_table,
    read_pose,
)
from dirt_env.task.patch import CHANNELS
from tests import naive
from tests.task.sites import CELL, heaped, site

GRID = Grid(20, 30, CELL)
BLADE, MACHINE = Blade(), Machine()
TABLE = pose_table(GRID, BLADE, MACHINE)
LIMIT = 4.0


def look(place, height=None, size=8, ahead=0.5, resolution=CELL, channels=None, doubt=0.0, **pose):
    """Everything there is to see for a machine with that record."""
    walls = place.solid is not None
    channels = channels or (CHANNELS if walls else CHANNELS[:2])
    height = place.height.astype(np.float32) if height is None else height.astype(np.float32)
    job = make_job(place.height.astype(np.float32), place, CELL, goal_depth=1.0, limit=LIMIT)
    spaces = bounds(GRID, TABLE, size, channels, LIMIT, walls, True, True)
    sight = Sight(**{name: np.full(low.shape, np.nan, np.float32) for name, (low, _) in spaces.items()})
    machine = np.zeros(1, POSE)
    for name, value in pose.items():
        machine[name] = value
    view = make_view(TABLE, GRID, resolution, ahead, LIMIT, BLADE.height, doubt, channels)
    observe(height, job, machine, CELL, view, 0.5, 0.25, sight)
    for name, (low, high) in spaces.items():
        shown = getattr(sight, name)
        assert ((low <= shown) & (shown <= high)).all(), name
    return sight


def test_the_patch_has_its_heading_up_and_left_on_the_left():
    """Soil 1.75 m ahead and 0.75 m to the left of a machine that faces north is 3 rows up and 2 columns left."""
    place = heaped(2.0)
    patch = look(place, heading=np.pi / 2, x=3.5 * CELL + 0.75, y=2.5 * CELL - 1.75).patch
    assert np.argwhere(patch[0] == 2.0).tolist() == [[0, 2]]


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_the_patch_turns_with_the_machine(turns):
    rng = np.random.default_rng(1)
    place = site(height=rng.normal(size=(20, 30)))
    north = look(place, heading=np.pi / 2, x=7.0, y=5.0).patch
    turned = look(place, heading=np.pi / 2 * (1 + turns), x=7.0, y=5.0).patch
    assert np.array_equal(turned, np.rot90(north, -turns, axes=(1, 2)))


def test_the_patch_shows_the_ground_itself():
    rng = np.random.default_rng(1)
    place = site(height=rng.normal(size=(20, 30)))
    patch = look(place, size=6, heading=np.pi / 2, x=10 * CELL, y=8 * CELL, z=0.5).patch
    assert np.array_equal(patch[0], np.flipud(place.height[5:11, 7:13].astype(np.float32)) - np.float32(0.5))


def test_ahead_says_how_much_of_the_patch_is_in_front():
    place = heaped()
    near, far = (look(place, heading=0.0, x=0.25, y=2.5 * CELL, ahead=ahead).patch[0] for ahead in (0.5, 1.0))
    assert np.array_equal(near[0:4], far[4:8])


def test_outside_the_site_is_a_wall_with_nothing_to_do():
    patch = look(heaped(), heading=0.0, x=0.0, y=0.0, z=2.0).patch
    assert (patch[0, 4:] == BLADE.height).all()
    assert (patch[1, 4:] == 0.0).all()


def test_obstacles_have_a_channel():
    solid = np.zeros((20, 30), bool)
    solid[10, 10] = True
    place = heaped()
    place.solid = solid
    sight = look(place, heading=np.pi / 2, x=10 * CELL, y=10 * CELL)
    assert np.argwhere(sight.patch[2]).tolist() == [[3, 4]]
    assert np.array_equal(sight.map[2], solid.astype(np.float32))
    assert (look(place, heading=0.0, x=0.0, y=0.0).patch[2, 4:] == 1.0).all()


def test_what_is_to_do_carries_start_goal_and_design():
    design = np.zeros((20, 30), bool)
    design[5, 5:7] = True
    height = np.zeros((20, 30))
    height[5, 5], height[5, 6], height[8, 8], height[9, 9] = 0.5, -0.5, 0.25, -0.25
    place = site(height=height, target=np.zeros((20, 30)), design=design)
    todo = look(place, x=5.0, y=5.0).map[1]
    assert [todo[5, 5], todo[5, 6], todo[8, 8], todo[9, 9], todo[-1, -1]] == [0.5, -0.5, 0.25, 0.0, -1.0]


def test_the_map_shows_heights_over_the_datum():
    place = heaped(2.0)
    assert np.array_equal(look(place, x=5.0, y=5.0, z=1.0).map[0], place.height.astype(np.float32))


def test_the_pose_is_read_back():
    record = {
        "x": 4.0,
        "y": 3.0,
        "heading": 2.0,
        "edge": -0.2,
        "speed": -1.5,
        "yaw_rate": 0.3,
        "pitch": 0.2,
        "roll": -0.1,
        "load": 1.25,
    }
    found = read_pose(look(heaped(), **record).pose, TABLE)
    for name, value in record.items():
        assert found[name] == pytest.approx(value, abs=1e-5), name
    assert (found["remaining"], found["time_left"]) == (0.5, 0.25)
    assert tuple(entry.name for entry in TABLE) == POSE_ENTRIES


def test_the_goal_is_given_in_the_machines_frame():
    """The goal's centre is 3 m north and 4 m west of a machine that faces west."""
    goal = np.zeros((20, 30), bool)
    goal[12, 10] = True
    found = read_pose(look(site(goal=goal), x=5.25 + 4.0, y=6.25 - 3.0, heading=np.pi).pose, TABLE)
    assert found["goal_distance"] == pytest.approx(5.0, abs=1e-5)
    assert (found["goal_ahead"], found["goal_left"]) == (pytest.approx(0.8), pytest.approx(-0.6))


def test_on_the_goals_centre_there_is_no_direction():
    goal = np.zeros((20, 30), bool)
    goal[12, 10] = True
    found = read_pose(look(site(goal=goal), x=5.25, y=6.25).pose, TABLE)
    assert (found["goal_distance"], found["goal_ahead"], found["goal_left"]) == (0.0, 0.0, 0.0)


def test_the_overview_leaves_nothing_out():
    place = heaped(2.0)
    for x, y, heading in ((0.2, 0.2, 0.3), (14.8, 9.8, -2.0), (7.0, 5.0, 1.0)):
        overview = look(place, x=x, y=y, heading=heading).overview
        assert overview[0].sum() == pytest.approx(1.0)
        assert overview[1].sum() == pytest.approx(1.0)


def test_the_overview_has_its_heading_up():
    """The goal is far ahead and to the right of a machine that faces north from the south-west corner."""
    overview = look(heaped(), x=2.0, y=1.0, heading=np.pi / 2).overview[1]
    row, col = np.argwhere(overview).mean(axis=0)
    assert row < 2
    assert col > 9


def everything_at_once(rng):
    """A site with a goal, a design, walls and soil wherever chance has it, and its ground a while later."""
    solid, design = rng.random((20, 30)) < 0.1, np.zeros((20, 30), bool)
    design[3:9, 4:12] = True
    start = (rng.random((20, 30)) < 0.3) * rng.normal(size=(20, 30))
    place = site(height=start, target=np.zeros((20, 30)), design=design, solid=solid, soil=7.0)
    return place, start + (rng.random((20, 30)) < 0.3) * rng.normal(scale=3.0, size=(20, 30))


SINGLE = 2e-5  # m; pixels are placed in single precision


@pytest.mark.parametrize("chosen", [CHANNELS, ("todo",), ("walls", "height"), ("todo", "height")])
def test_every_pixel_is_the_one_that_the_slow_twin_finds(chosen):
    """Anywhere, over the border and beyond it, on cell edges, with headings along the axes and nearly so."""
    rng = np.random.default_rng(4)
    for k in range(60):
        place, height = everything_at_once(rng)
        size, ahead, resolution = rng.integers(4, 24), rng.random(), rng.choice([0.2, CELL, 1.7])
        x, y, heading = rng.uniform(-4, 19), rng.uniform(-4, 14), rng.uniform(-4, 4)
        if k % 3 == 0:
            x, y, heading = round(x * 4) / 4, round(y * 4) / 4, rng.integers(-4, 5) * np.pi / 4
        if k % 6 == 0:
            heading += rng.choice([1e-9, -1e-9, 1e-17])
        z = rng.normal()
        sight = look(place, height, size, ahead, resolution, chosen, x=x, y=y, heading=heading, z=z)
        at = place, height, CELL, size, ahead, resolution
        twins = [
            naive.patch(*at, (x + dx, y + dy, heading, z), 1.0, LIMIT, BLADE.height)
            for dx, dy in ((0.0, 0.0), (SINGLE, SINGLE), (SINGLE, -SINGLE), (-SINGLE, SINGLE), (-SINGLE, -SINGLE))
        ]
        stacks = np.array([[twin[name] for name in chosen] for twin in twins], np.float32)
        assert (np.abs(stacks - sight.patch).max(1) < 1e-5).any(0).all()  # all channels of a pixel those of one cell
        if k % 3 != 0:
            assert (np.abs(stacks[0] - sight.patch) > 1e-5).mean() < 1e-3


def test_the_whole_site_is_what_the_slow_twin_finds():
    rng = np.random.default_rng(6)
    for k in range(20):
        place, height = everything_at_once(rng)
        pose = rng.uniform(0, 15), rng.uniform(0, 10), rng.uniform(-4, 4)
        doubt = 2.0 * (k % 2)
        sight = look(place, height, doubt=doubt, x=pose[0], y=pose[1], heading=pose[2])
        twin = naive.overview(place, height, CELL, 12, 30 * CELL / 12, pose, doubt)
        np.testing.assert_allclose(sight.overview, twin, rtol=1e-6)
        assert np.array_equal(sight.map, naive.site_map(place, height, 1.0, LIMIT))


def test_the_channels_may_be_any_in_any_order():
    place = heaped(0.5)
    record = {"x": 2.0, "y": 1.0, "heading": 0.4}
    height, todo = look(place, **record).patch
    assert np.array_equal(look(place, channels=("todo",), **record).patch, todo[None])
    turned = look(place, channels=("walls", "todo", "height"), **record).patch
    assert np.array_equal(turned[1:], [todo, height])
    assert np.array_equal(turned[0], height == BLADE.height)  # no walls but the border
    assert turned[0].any()


def test_extreme_values_stay_inside_the_bounds():
    place = site(height=np.random.default_rng(2).normal(scale=1e4, size=(20, 30)))
    record = {"edge": 1e9, "speed": -1e9, "yaw_rate": 1e9, "pitch": 1e9, "roll": -1e9, "load": 1e9, "z": -1e5}
    look(place, x=-1e3, y=1e3, heading=1e3, **record)
