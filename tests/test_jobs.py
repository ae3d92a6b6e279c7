"""Every shipped job at every level: its layouts follow from the seed, leave room, and can be solved in principle."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from dirt_env.config import layout, load, scene_names
from dirt_env.scene.ground import Rough
from dirt_env.scene.heaps import capacity
from dirt_env.scene.layout import Layout
from dirt_env.scene.pose import touches
from dirt_env.sim.params import Grid

JOBS = [(name, level) for name in scene_names() for level in range(6 if name == "heap" else 3)]
SEEDS = range(8000, 8006)
ONE_LAYOUT = {("several_starts", 1), ("several_goals", 1), ("uneven", 1), ("posts", 1), ("dig", 1), ("pad", 1)}

every = pytest.mark.parametrize(("scene", "level"), JOBS)


def layouts(scene: str, level: int) -> list[Layout]:
    config = load(scene, level=level)
    return [layout(config, np.random.default_rng(seed)) for seed in SEEDS]


@every
def test_a_level_loads_without_a_warning_and_says_what_the_job_is(scene, level):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        config = load(scene, level=level)
    assert config.description
    assert config.steps >= 240
    assert load(config.to_dict()) == load(config.to_dict())


@every
def test_a_seed_gives_one_layout_and_seeds_give_different_ones(scene, level):
    first, again = layouts(scene, level), layouts(scene, level)
    for one, other in zip(first, again, strict=True):
        assert one.pose == other.pose
        assert np.array_equal(one.height, other.height)
        assert np.array_equal(one.target, other.target)
    kinds = {(one.height.tobytes(), one.pose) for one in first}
    assert len(kinds) == (1 if (scene, level) in ONE_LAYOUT else len(first))


@every
def test_there_is_soil_to_move_and_room_for_it(scene, level):
    config = load(scene, level=level)
    area = config.grid.cell**2
    for one in layouts(scene, level):
        assert one.soil > 1.0
        lack = float(np.maximum(one.target - one.height, 0.0)[~one.goal].sum()) * area
        room = capacity(one.goal, config.grid, config.soil.slope, one.solid) if one.goal.any() else 0.0
        if config.design is None:
            assert room >= one.soil
        else:
            assert one.soil >= 0.95 * lack
            error = np.sqrt(np.square(one.height - one.target)[one.design].mean())
            assert error > config.design.tolerance


@every
def test_machine_and_regions_are_clear_of_one_another_and_of_obstacles(scene, level):
    config = load(scene, level=level)
    for one in layouts(scene, level):
        assert not (one.start & one.goal).any()
        x, y, _ = one.pose
        assert 0.0 < x < config.site.size[0]
        assert 0.0 < y < config.site.size[1]
        if one.solid is not None:
            assert not (one.solid & (one.start | one.goal)).any()
            assert not touches(config.setting, one.pose, one.solid)


@every
@pytest.mark.filterwarnings("error")
def test_gymnasium_checks_it(scene, level):
    check_env(gymnasium.make("DirtPush-v0", scene=scene, level=level).unwrapped, skip_render_check=True)


@pytest.fixture(scope="module")
def survey(tmp_path_factory):
    """A height map of 60 m x 60 m, gentle enough to stand, 100 m up."""
    path = tmp_path_factory.mktemp("survey") / "hills.npy"
    ground = Rough((0.8, 0.8), 12.0).make(Grid(120, 120, 0.5), 0.7, np.random.default_rng(0))
    np.save(path, ground + 100.0)
    return path


@pytest.mark.parametrize("scene", scene_names())
def test_every_job_can_be_laid_over_a_height_map(scene, survey):
    config = load(scene, level=1, ground={"kind": "file", "path": str(survey), "nodata": "fill"})
    one = layout(config, np.random.default_rng(8000))
    assert one.datum > 100.0 - 1e-6
    assert one.soil > 1.0
    assert np.ptp(one.target) > 0.2
