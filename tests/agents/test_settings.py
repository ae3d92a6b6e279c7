"""Settings of training runs: what is shipped is good, and what is wrong is said with what is allowed."""

from pathlib import Path

import numpy as np
import pytest
from dirt_env.agents.loading import load_settings
from dirt_env.agents.settings import NO_TEACHER, Teacher

SHIPPED = sorted((Path(__file__).resolve().parents[2] / "configs" / "train").glob("*.toml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_settings_are_read_and_written_back(path, tmp_path):
    settings = load_settings(path, {})
    assert settings.name == path.stem
    plain = settings.to_dict()
    copy = tmp_path / path.name
    copy.write_text("")
    assert load_settings(copy, {key: value for key, value in plain.items() if key != "name"}) == settings


def shipped(name):
    return next(path for path in SHIPPED if path.stem == name)


def test_overrides_are_laid_over_the_file():
    settings = load_settings(shipped("ppo_heap"), {"ppo": {"gamma": 0.5}, "seed": 7})
    assert (settings.ppo.gamma, settings.seed) == (0.5, 7)
    assert settings.ppo.n_steps == load_settings(shipped("ppo_heap"), {}).ppo.n_steps


def test_a_teacher_can_be_taken_away():
    assert load_settings(shipped("ppo_heap"), {}).teacher != Teacher()
    assert load_settings(shipped("ppo_heap"), {"teacher": {"policy": NO_TEACHER}}).teacher == Teacher()


@pytest.mark.parametrize(
    ("overrides", "complaint"),
    [
        ({"ppo": {"gama": 0.9}}, "ppo.gama is not known, did you mean gamma.* known: n_steps, batch_size"),
        ({"speed": 1}, "speed is not known.* known: description, steps, seed"),
        ({"ppo": {"gamma": 1.5}}, "ppo.gamma is 1.5; allowed: >= 0 and <= 1"),
        ({"ppo": {"batch_size": 3000}}, "ppo.batch_size is 3000; allowed: what divides worlds.count x ppo.n_steps"),
        ({"steps": 0}, "steps is 0; allowed: a whole number >= 1"),
        ({"network": {"filters": [8]}}, "network.filters, kernels and strides have 1, 2 and 2 numbers"),
        (
            {"network": {"roots": True}, "worlds": {"set": {"observation": {"channels": ["height"]}}}},
            r"network.roots is True with the channels \['height'\] of the scene's observation; allowed: with \"todo\"",
        ),
        ({"network": {"kernels": [40, 3]}}, "network.kernels has 40 over 16 pixels"),
        ({"stage": [{"levels": [0]}, {"levels": [1]}]}, r"stage\[0\] never ends; allowed"),
        ({"stage": [{"levels": [0], "success": 0.5}]}, r"stage\[0\] ends; allowed"),
        ({"worlds": {"set": {"observation": {"map": True}}}}, "observation.map is True; allowed: False, with patch"),
        ({"stage": [{"levels": [9]}]}, "layout.level is 9; allowed"),
        ({"stage": []}, r"stage is empty; allowed: one \[\[stage\]\] or more"),
        ({"worlds": {"set": {"soil": {"repos": 30}}}}, "soil.repos is not known, did you mean repose"),
        ({"worlds": {"scene": "heep"}}, "^scene is 'heep'"),
        ({"record": {"layouts": 3000}}, "record.layouts is 3000; allowed: .* <= 2000"),
        ({"worlds": {"count": 9000}}, "worlds.count is 9000; allowed: .* <= 8000"),
        ({"worlds": {"count": 3, "variants": [{}, {}]}, "ppo": {"batch_size": 96}}, r"worlds.count is 3; .* least 10"),
        ({"worlds": {"variants": [{}, {"soil": {"repos": 30}}]}}, r"worlds.variants\[1\]: soil.repos is not known"),
        ({"worlds": {"variants": [{"level": 2}]}}, r"worlds.variants\[0\].level is 2; allowed: levels in .* alone"),
        (
            {"worlds": {"variants": [{"observation": {"noise": {"height": 0.01}}}]}},
            r"worlds.variants\[0\] has observation.noise True, and the scene as it is has False",
        ),
        ({"worlds": {"variants": {"soil": {}}}}, "worlds.variants is .*; allowed: an array of tables"),
        (
            {"worlds": {"variants": [{"observation": {"ahead": 0.9, "noise": {}}}]}},
            r"worlds.variants\[0\].observation has ahead; allowed: noise alone",
        ),
        ({"worlds": {"variants": [{"scene": "dig"}]}}, r"worlds.variants\[0\].scene is 'dig'; allowed: worlds.scene"),
        ({"worlds": {"set": {"scene": "dig"}}}, "worlds.set.scene is 'dig'; allowed: worlds.scene alone"),
        ({"worlds": {"set": {"level": 1}}}, "worlds.set.level is 1; allowed: levels in .* alone"),
        ({"worlds": {"threads": 10**6}}, "worlds.threads is 1000000; allowed: .* <= 512"),
        ({"seed": 2**32}, "seed is 4294967296; allowed: a whole number >= 0 and <= 4.29497e"),
        (
            {"teacher": {"worlds": 2}},
            "teacher.worlds is 2; allowed: at least 5, a world for each level of the",
        ),
        ({"teacher": {"policy": ""}}, "teacher.policy is ''; allowed: a scripted behaviour, or 'none'"),
        ({"record": {"levels": [7]}}, "record.levels has 7: layout.level is 7; allowed: .* or no levels"),
        ({"device": "gpu"}, 'device is \'gpu\'; allowed: "cpu", "cuda", "auto"'),
    ],
)
def test_what_is_wrong_is_said(overrides, complaint):
    with pytest.raises(ValueError, match=complaint):
        load_settings(shipped("ppo_heap"), overrides)


@pytest.mark.parametrize(
    ("overrides", "complaint"),
    [
        ({"algorithm": "ppo"}, 'sac is a table for another algorithm than ppo; .* or algorithm = "sac"'),
        ({"ppo": {"gamma": 0.9}}, 'ppo is a table for another algorithm than sac; .* or algorithm = "ppo"'),
        (
            {"teacher": {"policy": "adaptive_push"}},
            'teacher.policy is .adaptive_push. with algorithm "sac".*: no teacher',
        ),
        ({"sac": {"buffer_size": 10**6}}, r"1000000, which takes 3.34 GB \(3,344 bytes a step\); .* most 598086 in"),
        ({"sac": {"buffer_size": 60}}, "sac.buffer_size is 60; allowed: at least 256, a batch and"),
        ({"sac": {"learning_starts": 10**8}}, "sac.learning_starts is 100000000; allowed: less than steps = "),
        ({"sac": {"ent_coef": "none"}}, 'sac.ent_coef is .none.; allowed: "auto" or a number >= 0'),
        ({"sac": {"n_steps": 3}}, "sac.n_steps is not known"),
        ({"worlds": {"frames": 17}}, "worlds.frames is 17; allowed: .* <= 16"),
    ],
)
def test_what_is_wrong_of_sac_is_said(overrides, complaint):
    with pytest.raises(ValueError, match=complaint):
        load_settings(shipped("sac_heap"), overrides)


def test_a_run_has_the_table_of_its_algorithm_alone(tmp_path):
    (tmp_path / "empty.toml").write_text("")
    by_ppo, by_sac = (load_settings(tmp_path / "empty.toml", {"algorithm": name}) for name in ("ppo", "sac"))
    assert by_ppo.sac is None
    assert by_sac.ppo is None
    assert (by_ppo.learner.n_steps, by_sac.learner.tau) == (32, 0.005)


def test_a_shipped_file_goes_by_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_settings(Path("ppo_heap"), {}) == load_settings(shipped("ppo_heap"), {})


def test_a_scene_of_ones_own_is_looked_for_from_the_current_folder(tmp_path, monkeypatch):
    scene = shipped("ppo_heap").parents[1] / "scene" / "posts.toml"
    (tmp_path / "mine.toml").write_text(scene.read_text())
    monkeypatch.chdir(tmp_path)
    own = {"worlds": {"scene": "mine.toml"}, "stage": [{}], "record": {"levels": []}}
    assert load_settings(shipped("ppo_heap"), own).worlds.scene == str(tmp_path / "mine.toml")


def test_a_height_map_is_looked_for_from_where_its_name_is_written(tmp_path, monkeypatch):
    ground, other = {"kind": "file", "path": "map.npy", "pixel": 0.5}, tmp_path / "other"
    other.mkdir()
    for folder in (tmp_path, other):
        np.save(folder / "map.npy", np.zeros((64, 64)))
    text = '[worlds.set.ground]\nkind = "file"\npath = "map.npy"\npixel = 0.5\n[[stage]]\nlevels = [1]\n'
    (tmp_path / "mine.toml").write_text(text + "[record]\nlevels = [1]\n")
    monkeypatch.chdir(other)
    assert load_settings(tmp_path / "mine.toml", {}).worlds.set["ground"]["path"] == str(tmp_path / "map.npy")
    own = load_settings(tmp_path / "mine.toml", {"worlds": {"set": {"ground": ground}}})
    assert own.worlds.set["ground"]["path"] == str(other / "map.npy")


def test_a_file_that_is_none(tmp_path):
    with pytest.raises(ValueError, match="is no file; allowed: a TOML file"):
        load_settings(tmp_path / "none.toml", {})
    (tmp_path / "bad.toml").write_text("steps = ")
    with pytest.raises(ValueError, match="is no TOML"):
        load_settings(tmp_path / "bad.toml", {})
