"""Random layouts: nothing overlaps, there is room to work, the same generator gives the same layout."""

from dataclasses import replace

import numpy as np
import pytest

from dirt_env.scene.ground import Flat
from dirt_env.scene.heaps import capacity
from dirt_env.scene.layout import Setting, centres
from dirt_env.scene.pose import touches, under
from dirt_env.scene.sampling import LEVELS, sample
from dirt_env.sim.advance import fits
from dirt_env.sim.params import Blade, Grid, Machine, Soil
from dirt_env.sim.state import make_world

GRID = Grid()
SETTING = Setting(GRID, Soil().slope, Blade(), Machine())
SEEDS = range(40)


def draw(level: int, seed: int):
    return sample(LEVELS[level], SETTING, Flat(), np.random.default_rng(seed))


@pytest.mark.parametrize("level", range(6))
def test_things_keep_apart_and_volumes_are_as_asked(level):
    sampler = LEVELS[level]
    for seed in SEEDS:
        layout = draw(level, seed)
        machine = under(SETTING, layout.pose)
        heap = layout.height > layout.target
        assert machine.sum() > 10
        assert not (layout.start & layout.goal).any()
        assert not (machine & (layout.start | layout.goal)).any()
        assert not (heap & ~layout.start).any()
        assert layout.soil == pytest.approx((layout.height - layout.target).sum() * 0.25, rel=1e-12)
        assert sampler.heaps[0] * sampler.volume[0] <= layout.soil <= sampler.heaps[1] * sampler.volume[1]
        assert capacity(layout.goal, GRID, SETTING.slope) > 1.4 * layout.soil
        if layout.solid is not None:
            assert not (layout.solid & (layout.start | layout.goal | machine)).any()
    assert (layout.solid is None) == (level < 5)
    assert (np.ptp(layout.target) > 0.1) == (level >= 3)


def test_level_0_begins_behind_a_heap_six_to_seven_metres_from_the_goal():
    x, y = centres(GRID)
    for seed in SEEDS:
        layout = draw(0, seed)
        weight = layout.height - layout.target
        heap = np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()
        goal = np.array([np.broadcast_to(axis, weight.shape)[layout.goal].mean() for axis in (x, y)])
        assert 5.9 <= np.hypot(*(heap - goal)) <= 7.1
        ahead = np.array([np.cos(layout.pose[2]), np.sin(layout.pose[2])])
        assert (heap - layout.pose[:2]) @ ahead == pytest.approx(np.hypot(*(heap - layout.pose[:2])), rel=1e-2)


def test_equal_generators_give_equal_layouts_and_others_differ():
    for level in range(6):
        first, same, other = draw(level, 1), draw(level, 1), draw(level, 2)
        np.testing.assert_array_equal(first.height, same.height)
        assert first.pose == same.pose
        assert first.pose != other.pose


@pytest.mark.parametrize(
    "sampler",
    [
        replace(LEVELS[1], haul=(1.0, 2.0)),
        replace(LEVELS[1], volume=(900.0, 900.0)),
        replace(LEVELS[4], heaps=(60, 60)),
        replace(LEVELS[5], obstacles=(64, 64)),
        replace(LEVELS[1], back_off=50.0),
    ],
)
def test_what_cannot_be_placed_ends_in_an_error(sampler):
    with pytest.raises(ValueError, match=r"no place in 200 attempts on a site of 32 m x 32 m"):
        sample(sampler, SETTING, Flat(), np.random.default_rng(0))


def test_oblong_sites_are_filled_along_their_length():
    setting = SETTING._replace(grid=Grid(40, 160, 0.5))
    goals = [sample(LEVELS[1], setting, Flat(), np.random.default_rng(seed)).goal for seed in SEEDS]
    columns = [np.nonzero(goal)[1].mean() for goal in goals]
    assert min(columns) < 50
    assert max(columns) > 110


def test_the_machine_never_begins_on_a_cell_of_a_post_however_coarse_the_cells_are():
    coarse = SETTING._replace(grid=Grid(32, 32, 1.0))
    for seed in (143, 281, 318, 790, *range(30)):
        layout = sample(LEVELS[5], coarse, Flat(), np.random.default_rng(seed))
        assert not touches(coarse, layout.pose, layout.solid)
        world = make_world(layout.height, coarse.grid, layout.solid)
        assert fits(world, coarse.grid, coarse.blade, coarse.machine, *layout.pose)
