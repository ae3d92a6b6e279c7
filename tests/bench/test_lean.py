"""What a scene leaves out changes nothing: lean equals full with the feature neutral, to the last bit."""

import numpy as np
import pytest

from dirt_env.bench.lean import ACTIONS, FEATURES, empty_design, measure, rows, started, table
from dirt_env.sim.advance import advance, settle
from dirt_env.sim.params import Command, Grid, Soil
from dirt_env.sim.slump import settle_window
from dirt_env.sim.state import make_world
from dirt_env.sim.voxel import update, update_all
from dirt_env.sim.voxel_state import Rules, make_voxels
from dirt_env.task.goal import Gauge
from tests.sim.worlds import line_at, sweep_blade

STATE = ("height", "machine", "tally", "changed", "pending")


def begun():
    """An environment with its machine in the middle of a site."""
    env = started(layout={"heaps": 2, "volume": [4.0, 6.0], "haul": [8.0, 12.0]})
    env.reset(seed=1, options={"pose": (16.0, 16.0, 0.3)})
    return env


def look(env):
    """The observation of what is there now."""
    return env._worlds.look(0)[0]


def driven(steps=200, neutral=None):
    """The world after random driving and digging in the middle of a site; `neutral` are fields put in at the start."""
    env = begun()
    world, config = env.episode.world, env.config
    if neutral is not None:
        world = world._replace(**neutral(world))
    rng = np.random.default_rng(4)
    for speed, yaw_rate, edge in rng.uniform((-1, -0.6, -0.25), (1, 0.6, 0.1), (steps, 3)):
        # It circles about the middle: on an open border a machine may go where a wall would hold it.
        advance(world, config.grid, config.soil, config.blade, config.machine, Command(speed, yaw_rate, edge), 0.5)
    return world, env


def assert_same(a, b, fields=STATE):
    for name in fields:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)


def test_obstacles_that_are_nowhere_change_nothing():
    lean, env = driven()
    full, _ = driven(neutral=lambda world: {"solid": np.zeros(world.height.shape, bool)})
    assert lean.solid is None
    assert np.abs(lean.height - env.episode.layout.height).max() > 0.1
    assert_same(lean, full)


def test_an_open_border_that_no_soil_comes_near_changes_nothing():
    lean, _ = driven()
    full, _ = driven(neutral=lambda world: {"outside": world.height.copy()})
    assert lean.outside is None
    assert full.outside is not None
    assert full.tally[0].lost == 0.0
    assert_same(lean, full)


def test_a_design_surface_without_a_cell_changes_nothing():
    world, env = driven()
    lean, full, cell = env.episode.job, empty_design(begun()), env.config.grid.cell
    assert (lean.design_cells, full.design_cells) == (0.0, 1.0)
    measured = [Gauge(job, cell).measure(world.height) for job in (lean, full)]
    assert measured[0] == measured[1]
    assert measured[0].potential > 0
    seen = look(env)
    env.put(env.episode._replace(job=full))
    np.testing.assert_array_equal(look(env)["patch"], seen["patch"])


def test_solid_cells_that_are_none_leave_the_rest_of_the_patch_alone():
    env = started(level=1)
    lean = look(env)
    walls = started(layout={"obstacles": [0, 1]})
    walls.put(env.episode)
    full = look(walls)
    assert full["patch"].shape[0] == lean["patch"].shape[0] + 1
    np.testing.assert_array_equal(full["patch"][:2], lean["patch"])
    np.testing.assert_array_equal(full["pose"], lean["pose"])


@pytest.mark.parametrize("more", ["overview", "map"])
def test_pictures_of_the_whole_site_change_nothing_else(more):
    lean, full = started(level=2), started(level=2, observation={more: True})
    for action in ACTIONS * 3:
        a, b = lean.step(action), full.step(action)
        assert set(b[0]) - set(a[0]) == {more}
        for name in a[0]:
            np.testing.assert_array_equal(a[0][name], b[0][name])
        assert a[1:] == b[1:]


def test_rendering_changes_nothing():
    lean, full = started(level=2), started(level=2, render_mode="rgb_array")
    for action in ACTIONS * 2:
        lean.step(action)
        full.step(action)
        full.render()
    assert lean.get_state() == full.get_state()


def test_a_lifted_blade_is_no_blade():
    """Machines with blades of any shape leave settled ground alone while they are lifted; nothing is swept."""
    for blade in ({}, {"width": 5.0, "height": 2.0}):
        env = started(blade=blade)
        before = env.episode.world.height.copy()
        for steering in (-1.0, 0.0, 1.0):
            env.step([steering, 1.0, 1.0])
            assert env.episode.world.tally[0].sweeps == 0
            assert env.episode.world.changed[1] <= env.episode.world.changed[0]
        np.testing.assert_array_equal(env.episode.world.height, before)


def test_a_barrier_that_closes_no_link_changes_nothing():
    ground = np.random.default_rng(0).normal(0.0, 1.0, (40, 40))
    lean, full = (make_world(ground, Grid(40, 40, 0.5)) for _ in range(2))
    soil, grid = Soil(), Grid(40, 40, 0.5)
    settle(lean, grid, soil, "explicit")
    away = line_at(10.0, 10.0, 0.0, width=0.01, edge=-50.0, height=0.001)  # between two cells' centres, deep down
    while full.pending[1] > full.pending[0]:
        sweep_blade(full, grid, [away, away])
    np.testing.assert_array_equal(lean.height, full.height)


def test_sweeping_settled_ground_changes_nothing():
    world, env = driven()
    grid, soil = env.config.grid, env.config.soil
    env.episode.world.height[:] = world.height
    settle(world, grid, soil)
    before = world.height.copy()
    assert world.pending[1] <= world.pending[0]
    world.pending[:] = 0, grid.rows, 0, grid.cols
    settle_window(world, grid, soil)
    np.testing.assert_array_equal(world.height, before)


def test_cells_at_rest_and_a_life_that_no_constraint_has_change_nothing():
    ground = np.random.default_rng(1).uniform(0.5, 3.0, (14, 11))
    lean, whole = (make_voxels(ground, Grid(14, 11, 1.0), 1.0, 0.0, 5) for _ in range(2))
    update(lean, Rules(0.5, life=0), 60)
    update_all(whole, Rules(0.5, life=100), 60)
    np.testing.assert_array_equal(lean.fill, whole.fill)
    np.testing.assert_array_equal(lean.incoming, whole.incoming)


def test_what_a_scene_does_not_need_is_not_allocated():
    env = started(level=1)
    world, batch = env.episode.world, env._worlds.batch
    assert (world.solid, world.outside, batch.solid, batch.outside, env.episode.layout.design) == (None,) * 5
    assert set(look(env)) == {"patch", "pose"}
    assert env._picture is None


def test_the_table_has_a_row_for_each_feature():
    found = rows(FEATURES[4:7], batches=1, seconds=0.005)
    assert [row.feature for row in found] == ["obstacles", "open border", "design surface"]
    assert all(row.full_us > 0 < row.lean_us for row in found)
    lines = table(found).splitlines()
    assert len(lines) == 5
    assert "no cell is solid" in lines[2]


@pytest.mark.slow
@pytest.mark.parametrize("feature", [f for f in FEATURES if f.name != "rendering"], ids=lambda f: f.name)
def test_every_feature_can_be_measured(feature):
    row = measure(feature, batches=1, seconds=0.005)
    assert row.ratio >= 0
