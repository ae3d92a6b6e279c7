"""Scenes: names, files, mappings and overrides; defaults; round trips; every refusal with its numbers."""

import json
import pickle
import warnings
from math import radians, tan
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dirt_env.config import SceneConfig, layout, load, scene_names
from dirt_env.config.loading import merge
from dirt_env.config.rules import Kinds, Many, Rule, Table
from dirt_env.config.tables import SCENE
from dirt_env.scene.sampling import LEVELS
from dirt_env.scene.survey import HeightFile
from dirt_env.sim.params import Blade, Grid, Machine, Soil

FIXED = {
    "start": [{"region": {"kind": "circle", "center": [9, 16], "radius": 3}, "volume": 10}],
    "goal": [{"region": {"kind": "circle", "center": [21, 16], "radius": 3.5}}],
}


def fixed(**more):
    """A scene with one start and one goal, and `more` tables merged over it."""
    return load(FIXED, **more)


@pytest.mark.parametrize("name", scene_names())
def test_shipped_scenes_are_sound(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        config = load(name)
        first = layout(config, np.random.default_rng(5))
    assert config.name == name
    assert config.description
    assert first.height.shape == first.target.shape == (config.grid.rows, config.grid.cols)
    assert np.isfinite(first.height).all()
    assert first.soil > 5
    assert (first.solid is not None) == config.has_walls
    assert load(json.loads(json.dumps(config.to_dict()))) == config
    assert pickle.loads(pickle.dumps(config)) == config
    assert hash(load(name)) == hash(config)


def test_the_named_situations_are_shipped():
    assert set(scene_names()) >= {"heap", "several_starts", "several_goals", "uneven", "dig", "posts", "pad"}
    assert load("several_goals").grid == Grid(48, 80, 0.5)
    assert len(load("several_starts").starts) == 3


def test_the_default_scene():
    config = load()
    assert config == load("heap")
    assert (config.grid, config.soil, config.blade, config.machine) == (Grid(), Soil(), Blade(), Machine())
    assert config.layout == LEVELS[1]
    assert (config.task.period, config.task.time, config.task.success) == (0.5, 300.0, 0.95)
    assert config.observation.resolution == 0.5


@pytest.mark.parametrize("level", range(6))
def test_levels_are_presets_whose_numbers_can_be_overridden(level):
    config = load(level=level, layout={"room": 2.5})
    assert config.layout.level == level
    assert config.layout.heaps == LEVELS[level].heaps
    assert config.layout.room == 2.5
    assert load(config.to_dict()) == config


def test_numbers_that_vary_may_be_one_number_or_two():
    assert load(layout={"volume": 9}).layout.volume == (9.0, 9.0)
    assert load(layout={"volume": [7, 9]}).layout.volume == (7.0, 9.0)


@settings(max_examples=30, deadline=None)
@given(
    repose=st.floats(20.0, 50.0),
    volume=st.tuples(st.floats(1.0, 5.0), st.floats(5.0, 6.0)),
    angle=st.floats(-360.0, 360.0),
    weight=st.floats(-1e6, 1e6),
    goal=st.sampled_from(
        [
            {"kind": "rectangle", "center": [22, 16], "size": [6, 5], "angle": 30.0},
            {"kind": "polygon", "points": [[18, 12], [26, 12], [25, 21], [19, 20]]},
        ]
    ),
)
def test_to_dict_comes_back_as_the_same_scene(repose, volume, angle, weight, goal):
    start = {"region": {"kind": "circle", "center": [9, 16], "radius": 4}, "volume": list(volume)}
    config = load(
        {
            "start": [start],
            "goal": [{"region": goal}],
            "obstacle": [{"kind": "wall", "from": [2, 2], "to": [9, 2]}, {"kind": "post", "center": [28, 28]}],
            "soil": {"repose": repose},
            "machine": {"pose": [15, 25, angle]},
            "reward": {"work": weight},
        }
    )
    again = load(json.loads(json.dumps(config.to_dict())))
    assert again == config
    assert isinstance(again, SceneConfig)


def test_friction_follows_repose_unless_it_is_given():
    assert load(soil={"repose": 45}).soil.friction == pytest.approx(1.0)
    assert load(soil={"repose": 45, "friction": 0.5}).soil.friction == 0.5


def test_overrides_are_merged_over_the_scene():
    config = load("dig", site={"border": "open"}, task={"time": 99}, machine={"pose": "random"})
    assert (config.site.border, config.site.cell, config.task.time, config.pose) == ("open", 0.5, 99.0, "random")
    assert load("uneven", ground={"kind": "flat"}).ground.kind == "flat"
    assert load("uneven", ground={"height": 0.2}).ground.length == 5.0
    assert load("dig", task=None).task.period == 0.5
    assert load("heap", **FIXED).layout is None


def test_merging_changes_neither_side():
    below, above = {"a": {"b": 1, "c": [1]}}, {"a": {"b": 2}, "d": None}
    assert merge(below, above) == {"a": {"b": 2, "c": [1]}}
    assert (below, above) == ({"a": {"b": 1, "c": [1]}}, {"a": {"b": 2}, "d": None})


def test_a_scene_from_a_file_finds_its_files_beside_it(tmp_path, monkeypatch):
    np.save(tmp_path / "ground.npy", 100.0 + np.zeros((48, 64)))
    text = (
        'description = "mine"\n[ground]\nkind = "file"\npath = "ground.npy"\npixel = 0.5\n'
        '[[start]]\nregion = {kind = "circle", center = [8, 12], radius = 3}\nvolume = [5, 6]\n'
        '[[goal]]\nregion = {kind = "circle", center = [20, 12], radius = 3}\n'
    )
    (tmp_path / "mine.toml").write_text(text)
    monkeypatch.chdir("/")
    config = load(tmp_path / "mine.toml")
    assert config == load(str(tmp_path / "mine.toml"))
    assert (config.name, config.site.size, config.site.cell) == ("mine", (32.0, 24.0), 0.5)
    assert config.ground == HeightFile(str(tmp_path / "ground.npy"), pixel=0.5)
    assert layout(config, np.random.default_rng(0)).datum == 100.0
    assert load(config.to_dict()) == config


def test_a_file_that_changed_is_read_again(tmp_path):
    path = tmp_path / "ground.npy"
    for datum in (100.0, 200.0):
        np.save(path, np.full((64, 64), datum))
        config = fixed(ground={"kind": "file", "path": str(path), "pixel": 0.5})
        assert layout(config, np.random.default_rng(0)).datum == datum


def test_site_of_a_file_has_its_extent_unless_told(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((35, 36)))
    ground = {"kind": "file", "path": str(tmp_path / "a.npy"), "pixel": 1.0}
    assert fixed(ground=ground).site.size == (36.0, 35.0)
    assert fixed(ground=ground, site={"cell": 0.75}).site.size == (36.0, 34.5)
    assert fixed(ground=ground, site={"size": [30, 32], "cell": 0.5}).grid == Grid(64, 60, 0.5)
    assert fixed(ground={**ground, "crop": [1, 2, 33, 32]}).site.size == (32.0, 30.0)
    with pytest.raises(ValueError, match=r"site.size is \[40.0, 32.0\] m; allowed: at most \[36.0, 35.0\] m"):
        fixed(ground=ground, site={"size": [40, 32]})
    with pytest.raises(ValueError, match=r"ground.crop covers \[32.0, 30.0\] m; allowed: leave one out"):
        fixed(ground={**ground, "crop": [1, 2, 33, 32]}, site={"size": [30, 30]})


def test_missing_heights_need_a_word(tmp_path):
    height = np.zeros((32, 32))
    height[28:, :] = np.nan
    np.save(tmp_path / "a.npy", height)
    ground = {"kind": "file", "path": str(tmp_path / "a.npy"), "pixel": 1.0}
    with pytest.raises(ValueError, match=r"no data in 128 of the site's 1024 cells \(12.5%\).*\"wall\".*\"fill\""):
        fixed(ground=ground)
    walled, filled = (fixed(ground={**ground, "nodata": word}) for word in ("wall", "fill"))
    assert layout(walled, np.random.default_rng(0)).solid.sum() == 128
    assert walled.has_walls
    assert layout(filled, np.random.default_rng(0)).solid is None
    with pytest.raises(ValueError, match=r'ground.nodata is "wall" and the layout is random'):
        load(ground={**ground, "nodata": "wall"}, site={"cell": 1.0})


def test_ground_steeper_than_its_soil_warns(tmp_path):
    height = np.zeros((32, 32))
    height[:, 30:] = 3.0
    np.save(tmp_path / "a.npy", height)
    with pytest.warns(
        UserWarning, match=r"steeper than its soil's repose \(0.70\) at 94 of 1984 cell faces, at most 3:"
    ):
        fixed(ground={"kind": "file", "path": str(tmp_path / "a.npy"), "pixel": 1.0})


def test_a_goal_too_small_warns_with_both_volumes():
    small = [{"region": {"kind": "circle", "center": [21, 16], "radius": 1.5}}]
    with pytest.warns(UserWarning, match=r"the goal holds 4.3 m3 at repose, but there are 10.0 m3 to move"):
        fixed(goal=small)
    with pytest.warns(UserWarning, match=r"layout.room is 0.5"):
        load(layout={"room": 0.5})


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"sitte": {}}, r"sitte is not known, did you mean site\? known: name, description, site"),
        ({"site": {"sise": 3}}, r"site.sise is not known, did you mean size\? known: size, cell, border"),
        ({"site": {"cell": 0.0}}, r"site.cell is 0.0; allowed: > 0 m"),
        ({"site": {"cell": float("nan")}}, r"site.cell is nan; allowed: a finite number > 0 m"),
        ({"site": {"cell": "half"}}, r"site.cell is 'half'; allowed: a number > 0 m"),
        ({"site": {"cell": True}}, r"site.cell is True; allowed: a number > 0 m"),
        ({"site": {"size": [32, float("inf")]}}, r"site.size\[1\] is inf; allowed: a finite number"),
        ({"site": {"size": [32]}}, r"site.size is \[32\]; allowed: a list of 2 numbers > 0 m"),
        ({"site": {"cell": 0.3}}, r"no whole number of cells of site.cell 0.3 m; allowed: for instance 32.1 for 32"),
        ({"site": {"cell": 1e-3}}, r"32000 x 32000 cells; allowed: at most 16777216"),
        ({"site": {"border": "fence"}}, r"site.border is 'fence'; allowed: \"wall\", \"open\""),
        ({"site": 3}, r"site is 3; allowed: a table"),
        ({"soil": {"repose": 90}}, r"soil.repose is 90; allowed: >= 0 and < 90 degrees"),
        ({"soil": {"density": 10**400}}, r"soil.density is 1000"),
        ({"blade": {"width": 0.9}}, r"blade.width is 0.9 m; allowed: >= 1 m, two cells of site.cell 0.5 m"),
        (
            {"machine": {"length": 40}},
            r"machine and blade take 40 m \(machine.length, .*\); allowed: at most the site's 32 m",
        ),
        ({"machine": {"speed": 1e6}}, r"machine.speed 1e\+06 m/s and machine.yaw_rate 0.6 .* times half a cell"),
        ({"blade": {"height": 1e-290}}, r"blade.height is 1e-290; allowed: >= 0.001 and <= 10000 m"),
        ({"reward": {"time": 1e290}}, r"reward.time is 1e\+290; allowed: >= -1e\+09 and <= 1e\+09"),
        ({"machine": {"pose": [1, 2]}}, r"machine.pose is \[1, 2\]; allowed: a list of 3 numbers"),
        ({"machine": {"pose": "there"}}, r"machine.pose is 'there'; allowed: \"behind\", \"random\" or \[x m"),
        ({"machine": {"pose": [0, 0, 0]}}, r"machine.pose puts the tracks at x = -1.25"),
        ({"task": {"period": 0}}, r"task.period is 0; allowed: > 0 and <= 10 s"),
        ({"task": {"success": 1.5}}, r"task.success is 1.5; allowed: > 0 and <= 1"),
        ({"observation": {"size": 2.5}}, r"observation.size is 2.5; allowed: a whole number >= 4 and <= 512 pixels"),
        ({"observation": {"map": 1}}, r"observation.map is 1; allowed: true, false"),
        (
            {"observation": {"channels": "height"}},
            r"channels is 'height'; allowed: a list of different ones of \"height\"",
        ),
        ({"observation": {"channels": []}}, r"channels is \[\]; allowed: a list of different ones"),
        (
            {"observation": {"channels": ["todo", "todo"]}},
            r"channels is \['todo', 'todo'\]; allowed: a list of different",
        ),
        ({"observation": {"channels": ["height", "soil"]}}, r"channels\[1\] is 'soil'; allowed: \"height\", \"todo\""),
        (
            {"machine": {"pose": [30.6, 16, 0]}},
            r"pose is \[30.6, 16.0, 0.0\]: with the pivot .* blade, 3 m wide .* allowed",
        ),
        ({"ground": {"kind": "hill"}}, r"ground.kind is 'hill'; allowed: \"flat\", \"mounds\""),
        ({"ground": {"kind": "ridge", "height": 3}}, r"ground is as steep as 1.178; allowed: at most 0.700"),
        ({"ground": {"kind": "rough", "length": 0.4}}, r"ground.length is 0.4 m; allowed: >= 1 m, two cells"),
        ({"ground": {"kind": "mounds", "height": [2, 1]}}, r"ground.height is \[2, 1\]; allowed: .*least <= most"),
        ({"ground": {"kind": "file"}}, r"ground.path is missing; needed: path"),
        ({"ground": {"kind": "file", "path": "no.tif"}}, r"no.tif is no file"),
        ({"goal": []}, r"the scene has 1 start and 0 goal; allowed: at least one of each, or a design"),
        ({"goal": {}}, r"goal is {}; allowed: an array of tables, \[\[goal\]\]"),
        ({"goal": [{}]}, r"goal\[0\].region is missing; needed: region"),
        ({"goal": [{"region": {"center": [1, 1]}}]}, r"goal\[0\].region.kind is missing; allowed: \"circle\""),
        (
            {"goal": [{"region": {"kind": "polygon", "points": [[1, 1]]}}]},
            r"points is \[\[1, 1\]\]; allowed: at least three",
        ),
        ({"level": 2}, r"level is 2, but the scene has its own start and goal; allowed: levels 0 to 5 for scenes"),
        ({"layout": {}}, r"layout is random and start, goal, design, obstacle, hollow or vary are given"),
    ],
)
def test_bad_input_names_the_key_the_value_and_what_is_allowed(tables, said):
    with pytest.raises(ValueError, match=said):
        load(merge(FIXED, tables))


@pytest.mark.parametrize(
    ("start", "said"),
    [
        ({"center": [40, 16], "radius": 3}, r"start\[0\].region reaches from x = 37 to 43 m .* x from 0 to 32 m"),
        ({"center": [19, 16], "radius": 3}, r"start\[0\].region and goal\[0\].region share 80 cells \(20 m2\)"),
        (
            {"center": [9, 16], "radius": 2},
            r"volume is 10 m3, .* reaches 2.39 m from \(9.00, 16.00\); allowed: at most 7.27 m3",
        ),
        ({"center": [9, 16]}, r"start\[0\].region.radius is missing; needed: center, radius"),
    ],
)
def test_starts_that_do_not_fit(start, said):
    with pytest.raises(ValueError, match=said):
        fixed(start=[{"region": {"kind": "circle", **start}, "volume": 10}])


@pytest.mark.parametrize(("amount", "said"), [({}, "no amount"), ({"volume": 1, "dig": 1}, "volume and dig")])
def test_a_start_has_exactly_one_amount(amount, said):
    with pytest.raises(ValueError, match=rf"start\[0\] has {said}; allowed: one of volume m3, depth m, dig m"):
        fixed(start=[{"region": FIXED["start"][0]["region"], **amount}])


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        ("hepa", r"scene is 'hepa' \(did you mean heap\?\); allowed: bay, berm, dig, heap"),
        (
            "nowhere/x.toml",
            r"nowhere/x.toml is no file; allowed: the path of a .toml file, or one of bay, berm, dig",
        ),
        (3, r"scene is 3; allowed: a name, a path of a TOML file, or a mapping"),
        ({"level": 9}, r"layout.level is 9; allowed: a whole number >= 0 and <= 5"),
        ({"machine": {"pose": [5, 5, 0]}}, r"machine.pose is \(5.0, 5.0, 0.0\), but the layout is random"),
        ({"layout": {"haul": [1, 2]}}, r"no place in 200 attempts"),
        ({"layout": {"rough_length": 0.1}}, r"layout.rough_length is 0.1 m; allowed: >= 1 m"),
        (
            {"site": {"size": [2, 2]}},
            r"machine and blade take 3 m \(.*blade.width.*\); allowed: at most the site's 2 m",
        ),
    ],
)
def test_scenes_that_cannot_be(scene, said):
    with pytest.raises(ValueError, match=said):
        load(scene)


def test_broken_toml_is_named(tmp_path):
    (tmp_path / "x.toml").write_text("a = = 3")
    with pytest.raises(ValueError, match=r"x.toml is no TOML"):
        load(tmp_path / "x.toml")


def test_a_file_that_is_no_scene_is_named(tmp_path):
    (tmp_path / "x.toml").write_text("[ppo]\nn_steps = 3")
    with pytest.raises(ValueError, match=r"x.toml: ppo is not known; known: name, "):
        load(tmp_path / "x.toml")


def keys(rule: Rule, name: str):
    """Table and key of everything a scene may say."""
    if isinstance(rule, Many):
        yield from keys(rule.table, name)
    elif isinstance(rule, Kinds):
        for kind, table in rule.tables.items():
            yield f'"{kind}"'
            yield from keys(table, name)
    elif isinstance(rule, Table):
        for key, inner in rule.rules.items():
            yield f"`{key}`"
            yield from keys(inner, key)


def test_the_manual_names_every_key_and_kind():
    manual = (Path(__file__).parents[1] / "docs" / "scenes.md").read_text(encoding="utf-8")
    for name, rule in SCENE.items():
        assert f"[{name}]" in manual or f"`{name}`" in manual
        for key in keys(rule, name):
            assert key in manual, f"{name}: {key}"


def test_the_steps_of_a_scene_are_its_nominal_time_in_control_steps():
    assert load("heap").steps == 600
    assert load("dig", task={"time": 10.1, "period": 0.5}).steps == 21


def pad(**design):
    """A level pad on a ridge of 0.5 m."""
    region = {"kind": "rectangle", "center": [12.0, 10.0], "size": [14.0, 8.0]}
    ridge = {"kind": "ridge", "height": 0.5, "width": 8.0, "center": [9.0, 10.0]}
    return {"site": {"size": [24.0, 20.0]}, "ground": ridge, "design": {"region": region, **design}}


def test_a_design_that_is_there_already_warns():
    with pytest.warns(
        UserWarning, match=r"design.tolerance is 0.5 m .* within 0.182 m .*: the first step ends the job"
    ):
        load(pad(tolerance=0.5))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load(pad(tolerance=0.17))


def test_the_channels_are_those_of_the_scene_or_as_asked():
    assert load("heap").channels == ("height", "todo")
    assert load("posts").channels == ("height", "todo", "walls")
    asked = load("heap", observation={"channels": ["walls", "height"]})
    assert asked.channels == ("walls", "height")
    assert load(asked.to_dict()) == asked


def test_relief_beyond_what_can_be_kept_exactly_is_an_error_of_the_scene(tmp_path):
    """5 km of relief in cells of half a metre."""
    height = np.zeros((64, 64))
    height[40:] = 5000.0
    np.save(tmp_path / "high.npy", height)
    tables = {**FIXED, "ground": {"kind": "file", "path": str(tmp_path / "high.npy"), "pixel": 0.5}}
    with (
        pytest.warns(UserWarning, match="steeper than its soil's repose"),
        pytest.raises(ValueError, match=r"ground heights reach 5000 m from the datum; allowed with cells of 0.5 m"),
    ):
        load(tables)


LEVELLED = {
    "task": {"time": 100.0},
    "start": [{"region": {"kind": "circle", "center": [8.0, 16.0], "radius": 3.0}, "volume": 5.0}],
    "goal": [{"region": {"kind": "circle", "center": [22.0, 16.0], "radius": 3.0}}],
    "levels": [{"task": {"time": 50.0}, "soil": {"repose": 30.0}}, {}, {"task": {"time": 200.0}}],
}


def test_a_written_scene_has_levels_of_its_own():
    assert [load(LEVELLED, level=level).task.time for level in range(3)] == [50.0, 100.0, 200.0]
    assert load(LEVELLED).task.time == 50.0, "the lowest, unless the scene says another"
    assert load({**LEVELLED, "level": 2}).task.time == 200.0
    assert load(LEVELLED, level=1) == load({key: value for key, value in LEVELLED.items() if key != "levels"})


def test_overrides_lie_over_the_level():
    config = load(LEVELLED, level=0, task={"time": 70.0}, soil={"density": 1000.0})
    assert config.task.time == 70.0
    assert config.soil.slope == pytest.approx(tan(radians(30.0)))
    assert load("bay", level=2, goal=LEVELLED["goal"], obstacle=None).goals != load("bay", level=2).goals


@pytest.mark.parametrize(
    "keys",
    [
        {"layer": 0.2, "path": "plan.npy"},
        {"layer": 0.2, "height": 0.3},
        {"layer": 0.2, "height": "balance"},
        {"layer": 0.2, "height": "ground"},
        {"layer": 0.2, "slope": [0.0, 0.02]},
        {"path": "plan.npy", "height": 0.3},
        {"path": "plan.npy", "slope": [0.0, 0.02]},
        {"height": "ground", "slope": [0.0, 0.02]},
    ],
)
def test_a_design_is_one_of_a_plane_a_layer_a_file_and_the_ground(keys):
    design = {"region": {"kind": "circle", "center": [16.0, 16.0], "radius": 4.0}, **keys}
    with pytest.raises(ValueError, match=f"design has {' and '.join(keys)}; allowed: one of"):
        load({"design": design, "start": LEVELLED["start"]})


@pytest.mark.parametrize("keys", [{"first_row": "north"}, {"array": "a", "band": 2}, {"scale": 0.01}])
def test_how_a_design_is_read_is_said_of_files_only(keys):
    design = {"region": {"kind": "circle", "center": [16.0, 16.0], "radius": 4.0}, "height": 0.3, **keys}
    with pytest.raises(ValueError, match=f"design has {' and '.join(keys)}; allowed: only beside design.path"):
        load({"design": design, "start": LEVELLED["start"]})


def test_a_path_in_the_file_begins_there_and_one_in_overrides_here(tmp_path, monkeypatch):
    here, there = tmp_path / "here", tmp_path / "there"
    for folder, height in ((here, 0.1), (there, 0.2)):
        folder.mkdir()
        np.save(folder / "map.npy", np.linspace(0.0, height, 64 * 64).reshape(64, 64))
    (there / "site.toml").write_text('level = 1\n[ground]\nkind = "file"\npath = "map.npy"\npixel = 0.5\n')
    monkeypatch.chdir(here)
    assert load("../there/site.toml").ground.path == str(there / "map.npy")
    assert load("../there/site.toml", ground={"path": "map.npy"}).ground.path == str(here / "map.npy")
    assert load(level=1, ground={"kind": "file", "path": "map.npy", "pixel": 0.5}).ground.path == str(here / "map.npy")


def test_a_plane_has_a_height_and_a_slope():
    region = {"kind": "circle", "center": [16.0, 16.0], "radius": 4.0}
    design = {"region": region, "height": 0.3, "slope": [0.0, 0.02]}
    config = load({"design": design, "start": LEVELLED["start"]})
    assert (config.design.height, config.design.slope) == (0.3, (0.0, 0.02))
    assert load(config.to_dict()) == config


@pytest.mark.parametrize(
    ("tables", "complaint"),
    [
        ({"level": 3}, "level is 3; allowed: 0 to 2"),
        ({"level": True}, "level is True; allowed: 0 to 2"),
        ({"levels": {"task": {}}}, r"levels is .*allowed: an array of tables, \[\[levels\]\]"),
        ({"levels": [{"tusk": {}}]}, r"levels\[0\].tusk is not known, did you mean task"),
        ({"levels": [{"level": 1}]}, r"levels\[0\].level is not known"),
        ({"levels": [{"task": {"tyme": 3}}, {}], "level": 1}, r"levels\[0\]: task.tyme is not known"),
        ({"levels": [{}, {"soil": {"repose": 95}}], "level": 0}, r"levels\[1\]: soil.repose is 95; allowed: >= 0"),
        ({"levels": [], "level": 1}, r"level is 1, but .*or those that a scene lists as \[\[levels\]\]"),
    ],
)
def test_bad_levels_are_refused(tables, complaint):
    with pytest.raises(ValueError, match=complaint):
        load({**LEVELLED, **tables})


@pytest.mark.parametrize(
    ("overrides", "complaint"),
    [
        ({"ground": {"sed": None}}, "ground.sed is not known, did you mean seed"),
        ({"observation": {"noise": {"hight": None}}}, "observation.noise.hight is not known, did you mean height"),
        ({"machine": {"pos": None}}, "machine.pos is not known, did you mean pose"),
        ({"tusk": None}, "tusk is not known, did you mean task"),
    ],
)
def test_what_is_taken_out_has_to_be_a_key(overrides, complaint):
    with pytest.raises(ValueError, match=complaint):
        load("uneven", **overrides)


def test_any_key_can_be_taken_out():
    assert load("uneven", ground={"seed": None}, terrain=None).ground.seed is None
    assert load("berm", machine={"pose": None}).pose == "behind"


def test_a_hollow_alone_says_what_it_took_the_place_of():
    hollow = {"region": FIXED["goal"][0]["region"], "depth": 0.3}
    with pytest.raises(ValueError, match=r"0 start and 0 goal; .*\(hollow takes the place of a random layout\)"):
        load("heap", hollow=[hollow])


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.float64, np.int8, np.int64])
def test_numbers_may_be_of_numpy(kind):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        config = load(soil={"repose": kind(30)})
    assert config == load(soil={"repose": 30})
    assert type(config.soil.slope) is float


def test_snow_is_one_soil():
    preset, scene = load(soil={"preset": "snow"}), load("snow")
    assert scene.soil.density == preset.soil.density == 300.0
    assert (scene.strength, scene.soil.friction) == (preset.strength, preset.soil.friction)
    assert scene.soil.slope == pytest.approx(tan(radians(40)))
