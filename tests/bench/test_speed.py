"""The command that measures speed: what it writes, and what it refuses. Not how fast anything is."""

import json

import pytest

from dirt_env.cli import main

ROW = {"case", "rows", "cols", "num_envs", "threads", "drive", "observation", "steps_per_s", "cartpole_ratio"}
ROW |= {"sim_s_per_cpu_s", "m3_per_cpu_s", "us_per_step"}


@pytest.mark.slow
def test_rows_have_the_promised_figures(tmp_path, capsys):
    chosen = ["--case", "single", "--size", "32", "--drive", "idle", "random"]
    assert main(["speed", "--quick", *chosen, "--out", str(tmp_path)]) == 0
    report = json.loads((tmp_path / "speed.json").read_text())
    assert {"commit", "machine", "versions", "cartpole_steps_per_s"} <= set(report)
    idle, random = sorted(report["rows"], key=lambda row: row["drive"])
    assert set(idle) >= ROW
    assert (idle["rows"], idle["cols"], idle["num_envs"], idle["observation"]) == (32, 32, 1, True)
    assert idle["m3_per_cpu_s"] == 0.0 < random["m3_per_cpu_s"]
    assert random["us_per_step"] == pytest.approx(1e6 / random["steps_per_s"])


@pytest.mark.parametrize("wrong", [("--case", "nothing"), ("--size", "-3"), ("--drive", "fly")])
def test_a_wrong_choice_is_one_line(wrong, capsys):
    assert main(["speed", *wrong]) == 2
    error = capsys.readouterr().err
    assert wrong[1] in error
    assert "allowed" in error
    assert error.count("\n") == 1
