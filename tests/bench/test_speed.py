"""What `dirt-push speed` counts, refuses and writes; never how long something took."""

import json
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from dirt_env.bench.speed import command
from dirt_env.bench.speed.bare import BareWorlds, bytes_per_world, commands_of, soil_per_step
from dirt_env.bench.speed.drives import config, record, scene, tapes
from dirt_env.bench.speed.measure import Item
from dirt_env.bench.speed.plan import plan
from dirt_env.bench.speed.report import renewed
from dirt_env.cli import main
from dirt_env.env import DirtPushEnv

KEYS = (
    "case", "rows", "cols", "num_envs", "threads", "drive", "observation", "steps_per_s", "cartpole_ratio",
    "sim_s_per_cpu_s", "m3_per_cpu_s", "us_per_step",
)  # fmt: skip
DOCUMENT = Path(__file__).parents[2] / "docs" / "speed.md"


def test_a_tiny_run_writes_its_rows(tmp_path, capsys):
    choice = ["--case", "native", "world", "--size", "32", "--num-envs", "2", "--quick"]
    assert main(["speed", "--out", str(tmp_path), *choice]) == 0
    report = json.loads((tmp_path / "speed.json").read_text())
    assert set(report) >= {"commit", "machine", "versions", "cartpole_steps_per_s"}
    assert [(row["case"], row["observation"]) for row in report["rows"]] == [("native", True), ("world", False)]
    for row in report["rows"]:
        assert set(row) >= set(KEYS)
        assert (row["rows"], row["cols"], row["num_envs"], row["threads"]) == (32, 32, 2, 1)
        assert row["us_per_step"] * row["steps_per_s"] == pytest.approx(1e6)
        assert row["cartpole_ratio"] * row["cartpole_steps_per_s"] == pytest.approx(row["steps_per_s"])
        assert row["m3_per_cpu_s"] > 0
    assert "x CartPole" in capsys.readouterr().out
    assert "**missed**" in renewed(DOCUMENT.read_text(), {**report, "start": [{"cache": "cold", "seconds": 1e3}]})


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--case", "gpu"], "allowed: single, native, sync, sb3, world"),
        (["--size", "8"], "whole numbers from 24"),
        (["--size", "64", "x"], "--size is 'x'"),
        (["--num-envs", "0"], "whole numbers from 1"),
        (["--threads", "-1"], "--threads is '-1'"),
        (["--drive", "fast"], "--drive is 'fast'"),
        (["--case", "single", "--drive", "full_load"], "with the case world"),
        (["--lean", "--quick"], "allowed: alone"),
        (["--renew-docs", "nowhere"], "a folder with speed.md"),
        (["--renew-docs", "docs", "--quick"], "without --quick"),
    ],
)
def test_bad_input_is_one_clear_line(arguments, words, tmp_path, capsys):
    assert main(["speed", "--out", str(tmp_path / "new"), *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("dirt-push: error: ")
    assert captured.err.count("\n") == 1
    assert words in captured.err
    assert not (tmp_path / "new").exists()


def test_without_its_library_the_adapter_is_left_out_unless_it_was_asked_for(monkeypatch):
    every = {item.case for item in plan(quick=True) if isinstance(item, Item)}
    monkeypatch.setattr("dirt_env.bench.speed.cases.find_spec", lambda name: None)
    assert {item.case for item in plan(quick=True) if isinstance(item, Item)} == every - {"sb3"}
    with pytest.raises(ImportError, match="case sb3 needs stable-baselines3"):
        plan(cases=["sb3"])


def test_ctrl_c_keeps_what_was_measured(tmp_path, capsys, monkeypatch):
    def measure(item, effort, cartpole):
        if item.case == "world":
            raise KeyboardInterrupt
        return {**item.named(), "steps_per_s": 1.0}

    monkeypatch.setattr(command, "measure", measure)
    assert main(["speed", "--out", str(tmp_path), "--case", "single", "world"]) == 130
    assert [row["case"] for row in json.loads((tmp_path / "speed.json").read_text())["rows"]] == ["single"]
    assert "interrupted after 1 of 2 rows" in capsys.readouterr().err


def test_a_choice_is_every_combination_once():
    items = plan(cases=["single", "world"], sizes=["32"], counts=["1", "4"], threads=["1", "2"])
    assert items == [Item("single", 32, 1, 1, "random"), *(Item("world", 32, n, 1, "random") for n in (1, 4))]
    assert all(item.threads == 1 for item in plan() if isinstance(item, Item) and item.case in ("sync", "world"))


def test_soil_is_counted_where_the_blade_is_down():
    assert soil_per_step(32, "random", 4, 100) > 0.01
    assert soil_per_step(32, "idle", 1, 20) == 0.0


def test_bytes_of_a_world_are_those_of_its_arrays():
    assert 17 * 64**2 < bytes_per_world(64) < 20 * 64**2


def test_the_physics_alone_does_what_the_environment_does():
    tape, worlds = tapes("random", 32), range(3)
    env = gymnasium.make_vec("DirtPush-v0", num_envs=len(worlds), threads=1, **scene(32))
    env.reset(seed=[tape.seed(world) for world in worlds])
    bare = BareWorlds(config(32), len(worlds))
    bare.begin([tape.seed(world) for world in worlds])
    actions = tape.rows(worlds)[:60]
    bare.drive(commands_of(actions, config(32).machine))
    for row in actions:
        env.step(row)
    for world in worlds:
        np.testing.assert_array_equal(env.envs[world].episode.world.height, bare.worlds.batch.height[world])


def test_recorded_actions_lead_to_the_recorded_world():
    recorded = DirtPushEnv(**scene(64, observation={"map": True}))
    actions = record("adaptive_push", 64, 3, steps=80, env=recorded)
    bare = BareWorlds(config(64), 1)
    bare.begin([3])
    before = bare.worlds.batch.height[0].copy()
    bare.drive(commands_of(actions[:, None], config(64).machine))
    np.testing.assert_array_equal(bare.worlds.batch.height[0], recorded.episode.world.height)
    assert np.abs(bare.worlds.batch.height[0] - before).max() > 0.1
