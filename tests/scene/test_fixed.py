"""Fixed layouts: volumes, targets, obstacles, poses; what does not fit is said with numbers."""

import warnings
from math import pi

import numpy as np
import pytest

from dirt_env.config import load
from dirt_env.scene import fixed
from dirt_env.scene.design import Design
from dirt_env.scene.fixed import Goal, Hollow, Start
from dirt_env.scene.ground import Flat, Ridge, Rough
from dirt_env.scene.layout import Setting
from dirt_env.scene.obstacles import Block, Post, Wall, solid_cells
from dirt_env.scene.regions import Circle, Polygon, Rectangle
from dirt_env.scene.survey import HeightFile
from dirt_env.sim.params import Blade, Grid, Machine, Soil

GRID = Grid(48, 64, 0.5)  # 32 m east, 24 m north
SETTING = Setting(GRID, Soil().slope, Blade(), Machine())
AREA = GRID.cell**2
PIT = Rectangle((8.0, 12.0), (6.0, 4.0))
HEAP = Circle((8.0, 12.0), 3.0)
HEAP_ASIDE = Circle((14.0, 18.0), 2.5)
GOAL = Goal(Circle((22.0, 12.0), 3.5))


def plan(starts=(), goals=(GOAL,), ground=None, design=None, obstacles=(), anywhere=False):
    return fixed.plan(SETTING, ground or Flat(), tuple(starts), tuple(goals), design, tuple(obstacles), anywhere)


def lay_out(starts=(), goals=(GOAL,), pose="behind", seed=0, **rest):
    return fixed.lay_out(plan(starts, goals, **rest), pose, np.random.default_rng(seed))


def test_heap_lies_on_the_ground_and_the_target_is_the_ground():
    ground = Rough((0.4, 0.4), 5.0, seed=3)
    layout = lay_out([Start(HEAP, volume=(10.0, 10.0))], ground=ground)
    assert layout.soil == pytest.approx(10.0, rel=1e-12)
    bare = ground.make(GRID, SETTING.slope, np.random.default_rng(3))
    np.testing.assert_array_equal(layout.target, bare)
    assert (layout.height >= bare).all()
    assert layout.design is None
    assert layout.solid is None


def test_layer_and_pit_have_their_volumes():
    layer = lay_out([Start(PIT, depth=(0.3, 0.3))])
    assert layer.soil == pytest.approx(0.3 * 24.0)
    assert not layer.target.any()
    pit = lay_out([Start(PIT, dig=(0.25, 0.25))])
    assert pit.soil == pytest.approx(0.25 * 24.0)
    assert not pit.height.any()
    np.testing.assert_array_equal(pit.target, np.where(pit.start, -0.25, 0.0))


def test_a_range_draws_another_amount_in_every_episode():
    soils = [lay_out([Start(HEAP, volume=(4.0, 9.0))], seed=seed).soil for seed in range(20)]
    assert min(soils) >= 4.0
    assert max(soils) <= 9.0
    assert len({round(soil, 6) for soil in soils}) == 20


def test_layouts_share_no_memory():
    plan_ = plan([Start(HEAP, volume=(5.0, 5.0))], obstacles=[Post((15.0, 5.0))])
    first, second = (fixed.lay_out(plan_, "behind", np.random.default_rng(0)) for _ in range(2))
    for name in ("height", "target", "start", "goal", "solid"):
        assert not np.shares_memory(getattr(first, name), getattr(second, name))
        getattr(first, name)[:] = 1
        assert not np.array_equal(getattr(first, name), getattr(second, name))
    assert first.height is not first.target


def test_machine_begins_behind_the_soil_and_faces_the_goal():
    x, y, heading = lay_out([Start(HEAP, volume=(5.0, 5.0))]).pose
    assert (x, y, heading) == pytest.approx((2.25, 12.0, 0.0))
    turned = lay_out([Start(Circle((22.0, 12.0), 3.0), volume=(5.0, 5.0))], [Goal(HEAP)]).pose
    assert turned == pytest.approx((27.75, 12.0, pi), abs=1e-9)


def test_given_and_random_poses():
    starts = [Start(HEAP, volume=(5.0, 5.0))]
    assert lay_out(starts, pose=(4.0, 5.0, 90.0)).pose == pytest.approx((4.0, 5.0, pi / 2))
    layout = lay_out(starts, pose="random", anywhere=True, obstacles=[Post((15.0, 5.0))])
    taken = np.argwhere(layout.start | layout.goal | layout.solid)
    poses = [
        lay_out(starts, pose="random", anywhere=True, obstacles=[Post((15.0, 5.0))], seed=i).pose for i in range(50)
    ]
    for x, y, _ in poses:
        assert np.hypot(*((taken + 0.5) * GRID.cell - (y, x)).T).min() > SETTING.radius
        assert SETTING.radius <= x <= 32 - SETTING.radius
    assert len(set(poses)) > 40


def test_balanced_pad_cuts_what_it_fills():
    ridge = Ridge((0.5, 0.5), 8.0, (9.0, 12.0), 90.0)
    layout = lay_out(goals=(), ground=ridge, design=Design(Rectangle((12.0, 12.0), (14.0, 8.0))))
    gap = (layout.height - layout.target)[layout.design]
    assert gap.sum() == pytest.approx(0.0, abs=1e-10)
    assert layout.soil == pytest.approx(np.maximum(gap, 0).sum() * AREA)
    assert np.ptp(layout.target[layout.design]) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_array_equal(layout.target[~layout.design], layout.height[~layout.design])
    assert not layout.start.any()
    assert not layout.goal.any()


def test_design_by_height_slope_and_file(tmp_path):
    region = Rectangle((12.0, 12.0), (8.0, 8.0))
    sloped = lay_out(goals=(), design=Design(region, height=-0.2, slope=(0.02, 0.0)))
    assert sloped.target[sloped.design].mean() == pytest.approx(-0.2)
    assert sloped.target[24, 24] - sloped.target[24, 23] == pytest.approx(0.01)
    wanted = np.full((48, 64), -0.3)
    wanted[:, :20] = np.nan
    np.save(tmp_path / "design.npy", wanted)
    drawn = lay_out(goals=(), design=Design(region, path=str(tmp_path / "design.npy")))
    assert (drawn.target[drawn.design] == -0.3).all()
    assert drawn.design.sum() == 16 * 12  # four of its sixteen columns have no heights
    np.save(tmp_path / "small.npy", wanted[:40])
    with pytest.raises(ValueError, match=r"covers 32 m x 20 m; allowed: the site's 32 m x 24 m"):
        lay_out(goals=(), design=Design(region, path=str(tmp_path / "small.npy")))


def test_a_design_is_read_as_the_ground_is_unless_it_says_otherwise(tmp_path):
    region, ramp = Rectangle((16.0, 12.0), (30.0, 22.0)), np.arange(48.0)[:, None] * 0.01 + np.zeros(64)
    nothing = np.where(np.arange(64) < 32, -9999.0, ramp)
    np.save(tmp_path / "ground.npy", ramp[::-1])
    np.save(tmp_path / "design.npy", nothing[::-1])
    np.save(tmp_path / "south.npy", ramp)
    np.savez(tmp_path / "two.npz", cm=100.0 * ramp[::-1] - 50.0, other=ramp)
    ground = HeightFile(str(tmp_path / "ground.npy"), first_row="north", nodata_value=-9999.0, pixel=0.5)
    likewise = lay_out(goals=(), ground=ground, design=Design(region, path=str(tmp_path / "design.npy")))
    assert np.abs(likewise.target - ramp).max() < 1e-12
    assert likewise.design.sum() == 44 * 30  # the eastern half of the region
    south = Design(region, path=str(tmp_path / "south.npy"), first_row="south")
    assert np.abs(lay_out(goals=(), ground=ground, design=south).target - ramp).max() < 1e-12
    two = str(tmp_path / "two.npz")
    scaled = Design(region, path=two, array="cm", scale=0.01, offset=0.5)
    assert np.abs(lay_out(goals=(), ground=ground, design=scaled).target - ramp).max() < 1e-12
    with pytest.raises(ValueError, match=r"two-dimensional arrays \(cm, other\); say design.array"):
        lay_out(goals=(), ground=ground, design=Design(region, path=two))


def test_a_design_of_another_place_is_refused(tmp_path):
    heights = "\n".join(" ".join(["1.0"] * 64) for _ in range(48))
    for name, west in (("ground", 500000.0), ("near", 500000.1), ("far", 500008.0)):
        text = f"ncols 64\nnrows 48\nxllcorner {west}\nyllcorner 100\ncellsize 0.5\n{heights}\n"
        (tmp_path / f"{name}.asc").write_text(text)
    region, ground = Rectangle((12.0, 12.0), (8.0, 8.0)), HeightFile(str(tmp_path / "ground.asc"))
    lay_out(goals=(), ground=ground, design=Design(region, path=str(tmp_path / "near.asc")))
    with pytest.raises(ValueError, match=r"corner at \(500008, 100\) m; allowed: the ground's \(500000, 100\) m"):
        lay_out(goals=(), ground=ground, design=Design(region, path=str(tmp_path / "far.asc")))


def test_heights_in_other_units_are_asked_about(tmp_path):
    millimetres = 10.0 * np.arange(64.0) + np.zeros((64, 1))
    np.save(tmp_path / "map.npy", millimetres)
    region = {"kind": "circle", "center": [9.0, 16.0], "radius": 3.0}
    scene = {
        "ground": {"kind": "file", "path": str(tmp_path / "map.npy"), "pixel": 0.5},
        "start": [{"region": region, "volume": 5.0}],
        "goal": [{"region": {**region, "center": [21.0, 16.0]}}],
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(ValueError, match=r"; the ground has slopes of up to .*: are its heights in metres"):
            load(scene)


def test_obstacles_have_their_cells():
    post, wall = Post((10.0, 10.0), 1.0), Wall((20.0, 2.0), (20.0, 22.0), 1.0)
    block = Block(Rectangle((5.0, 5.0), (2.0, 2.0)))
    assert solid_cells((post,), GRID).sum() * AREA == pytest.approx(pi, rel=0.05)
    assert solid_cells((wall,), GRID)[4:44, 39:41].all()
    assert solid_cells((block,), GRID).sum() == 16
    assert solid_cells((), GRID) is None
    assert solid_cells((Post((10.1, 10.1), 0.05),), GRID).sum() == 1


@pytest.mark.parametrize("end", [(25.0, 17.3), (3.0, 20.0), (12.0, 23.9)])
def test_a_thin_slanting_wall_has_no_gap(end):
    wall = solid_cells((Wall((11.0, 3.0), end, 0.1),), GRID)
    rows, cols = np.nonzero(wall)
    for row in range(rows.min(), rows.max()):
        below, above = np.nonzero(wall[row])[0], np.nonzero(wall[row + 1])[0]
        assert np.intersect1d(below, above).size
    assert cols.size


def test_walled_nodata_is_solid_and_left_out_of_the_regions(tmp_path):
    height = np.zeros((48, 64))
    height[:, :16] = np.nan
    np.save(tmp_path / "a.npy", height)
    ground = HeightFile(str(tmp_path / "a.npy"), nodata="wall")
    layout = lay_out([Start(Rectangle((8.0, 12.0), (4.0, 4.0)), depth=(0.2, 0.2))], ground=ground)
    assert layout.solid[:, :16].all()
    assert layout.start.sum() == 4 * 8
    assert layout.soil == pytest.approx(0.2 * 8.0)


@pytest.mark.parametrize(
    ("starts", "goals", "rest", "said"),
    [
        (
            [Start(Circle((20.0, 12.0), 3.0), volume=(1, 1))],
            (GOAL,),
            {},
            r"start\[0\].region and goal\[0\].region share \d+",
        ),
        (
            [Start(HEAP, dig=(1, 1)), Start(PIT, dig=(1, 1))],
            (GOAL,),
            {},
            r"start\[1\].region and start\[0\].region share",
        ),
        ([], (GOAL,), {"design": Design(Circle((21.0, 12.0), 2.0))}, r"design.region and goal\[0\].region share"),
        ([Start(HEAP, dig=(1, 1))], (GOAL,), {"design": Design(PIT)}, r"start\[0\].region and design.region share"),
        ([Start(HEAP, dig=(1, 1))], (GOAL,), {"obstacles": [Block(Rectangle((8, 12), (8, 8)))]}, r"all of them solid"),
        ([], (), {"obstacles": [Post((40.0, 3.0))]}, r"obstacle\[0\] is at \(40, 3\) m; allowed: x from 0 to 32 m"),
    ],
)
def test_regions_that_clash_are_errors(starts, goals, rest, said):
    with pytest.raises(ValueError, match=said):
        plan(starts, goals, **rest)


@pytest.mark.parametrize(
    ("start", "pose", "rest", "said"),
    [
        (
            Start(HEAP, volume=(60.0, 60.0)),
            "behind",
            {},
            r"volume is 60 m3.* reaches 4.34 m .*; allowed: at most \d+\.\d\d m3",
        ),
        (Start(HEAP, volume=(5, 5)), (0.5, 12.0, 0.0), {}, r"machine.pose puts the tracks at x = -0.75 to 1.75 m"),
        (Start(HEAP, volume=(5, 5)), (16.0, 5.0, 0.0), {"obstacles": [Post((16, 5))]}, r"on \d+ solid cells"),
        (Start(Circle((8.0, 12.0), 3.0), dig=(0.2, 0.2)), "behind", {"goals": [Goal(Circle((8.0, 20.0), 1.0))]}, None),
    ],
)
def test_what_does_not_fit_is_said(start, pose, rest, said):
    plan_ = plan([start], **rest)
    if said:
        with pytest.raises(ValueError, match=said):
            fixed.check(plan_, pose)
    else:
        with pytest.warns(UserWarning, match=r"the goal holds 1\.\d m3 at repose, but there are 5\.\d m3 to move"):
            fixed.check(plan_, pose)


def test_a_design_that_takes_far_more_soil_than_there_is_warns_with_both_volumes():
    scene = {"start": [{"region": {"kind": "circle", "center": [8, 8], "radius": 3}, "volume": 5.0}]}
    pad = {"kind": "rectangle", "center": [20, 20], "size": [8, 8]}  # 64 m2
    with pytest.warns(UserWarning, match=r"the design takes 19.2 m3 of fill, but there are 5.0 m3 to move"):
        load(**scene, design={"region": pad, "height": 0.3})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load(**scene, design={"region": pad, "height": 0.15})


def test_a_good_scene_warns_of_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fixed.check(plan([Start(HEAP, volume=(10.0, 10.0))]), "behind")


def test_the_heap_of_a_bent_region_stands_inside_it():
    bent = Polygon(((2, 2), (20, 2), (20, 6), (6, 6), (6, 20), (2, 20)))
    mask = bent.mask(GRID)
    x, y = fixed.middle(mask, GRID.cell)
    assert mask[int(y / 0.5), int(x / 0.5)]


def hollowed(start, depth):
    return fixed.plan(SETTING, Flat(), (start,), (GOAL,), None, (), hollows=(Hollow(PIT, (depth, depth)),))


def test_a_hollow_is_in_the_ground_from_the_start_with_sides_at_repose():
    shallow, deep = (
        fixed.lay_out(hollowed(Start(HEAP_ASIDE, volume=(4.0, 4.0)), depth), "behind", np.random.default_rng(0))
        for depth in (0.3, 2.0)
    )
    assert -shallow.target.sum() * AREA == pytest.approx(0.3 * 24.0)
    assert shallow.target.min() == pytest.approx(-0.3)
    assert shallow.soil == pytest.approx(4.0), "the hole itself is nothing to do"
    assert np.abs(np.diff(deep.target, axis=1)).max() <= SETTING.slope * GRID.cell * (1 + 1e-9)


def test_soil_may_not_lie_in_a_hollow():
    with pytest.raises(ValueError, match=r"start\[0\].region and hollow\[0\].region share \d+ cells"):
        hollowed(Start(HEAP, volume=(4.0, 4.0)), 0.3)


def test_a_layer_as_design_lies_over_the_ground_with_its_rim_at_repose():
    ground = Rough((0.4, 0.4), 5.0, seed=3)
    thin, high = (
        fixed.lay_out(
            plan((Start(HEAP_ASIDE, volume=(4.0, 4.0)),), (), ground=ground, design=Design(PIT, layer=depth)),
            (3.0, 3.0, 0.0),
            np.random.default_rng(0),
        )
        for depth in (0.15, 5.0)
    )
    bare = ground.make(GRID, SETTING.slope, np.random.default_rng(3))
    np.testing.assert_allclose((thin.target - bare)[thin.design], 0.15)
    rim = SETTING.slope * GRID.cell
    np.testing.assert_allclose(np.unique(np.round((high.target - bare)[high.design], 9)), rim * np.arange(1, 5))


def test_a_design_as_the_ground_was_asks_for_a_hollow_to_be_filled():
    ground, design = Rough((0.4, 0.4), 5.0, seed=3), Design(PIT, height="ground")
    starts = (Start(HEAP_ASIDE, volume=(4.0, 4.0)),)
    made = fixed.plan(SETTING, ground, starts, (), design, (), hollows=(Hollow(PIT, (0.3, 0.3)),))
    layout = fixed.lay_out(made, (3.0, 3.0, 0.0), np.random.default_rng(0))
    np.testing.assert_array_equal(layout.target, ground.make(GRID, SETTING.slope, np.random.default_rng(3)))
    assert (layout.target - layout.height)[layout.design] == pytest.approx(0.3)
