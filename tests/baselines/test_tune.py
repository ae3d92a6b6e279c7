"""Tuning writes its numbers as a file that a policy's name can name."""

from dataclasses import replace

import pytest
from dirt_env.baselines.pushing import tune
from dirt_env.baselines.pushing.numbers import shipped
from dirt_env.baselines.pushing.parameters import GreedyParameters

from dirt_env.config import load
from dirt_env.policy import load_policy


def test_what_was_found_is_written_and_can_be_driven_with(tmp_path, monkeypatch, capsys):
    found = shipped(GreedyParameters, carried=2.5)
    monkeypatch.setattr(tune, "search", lambda *arguments, **options: found)
    out = tmp_path / "mine.toml"
    assert tune.main(["--policy", "greedy", "--out", str(out)]) == 0
    assert capsys.readouterr().out == f"carried = 2.5 (was 1.5)\nwrote {out}\n"
    assert load_policy(f"greedy@{out}", load()).parameters == found


def test_what_was_found_leaves_the_shipped_numbers_for_traction_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(tune, "search", lambda *arguments, **options: shipped(GreedyParameters, carried=2.5, layer=3.0))
    out = tmp_path / "mine.toml"
    assert tune.main(["--policy", "greedy", "--out", str(out)]) == 0
    pulled = load(traction={})
    before, after = (load_policy(name, pulled).parameters for name in ("greedy", f"greedy@{out}"))
    assert after == replace(before, carried=2.5)
    assert after.layer == 2.0


@pytest.mark.parametrize("name", ["idle", "ppo"])
def test_a_policy_without_numbers_is_refused(name, tmp_path, capsys):
    assert tune.main(["--policy", name, "--out", str(tmp_path / "mine.toml")]) == 2
    said = f"tune: error: --policy is {name}, which has no numbers; allowed: adaptive_push, greedy, planner, slot, or"
    assert capsys.readouterr().err.startswith(said)


@pytest.mark.parametrize("option", ["--trials", "--episodes"])
def test_a_search_of_nothing_is_refused(option, tmp_path, capsys):
    with pytest.raises(SystemExit):
        tune.main([option, "-3", "--out", str(tmp_path / "mine.toml")])
    assert f"argument {option}: is '-3'; allowed: whole numbers >= 1" in capsys.readouterr().err


def test_numbers_that_are_tried_reach_all_of_a_planner(monkeypatch):
    driven = []
    monkeypatch.setattr(tune, "JOBS", ({"level": 0},))
    monkeypatch.setattr(tune, "cost", lambda env, policy, seed: driven.append(policy) or 1.0)
    tune.search(2, 1, 0, say=lambda text: None, policy="planner")
    assert len({policy.parameters for policy in driven}) == 3
    assert all(policy._rehearsal.parameters == policy.parameters for policy in driven)


@pytest.mark.parametrize("name", ["nowhere/mine.toml", "mine.txt"])
def test_a_place_that_cannot_be_is_refused_before_it_searches(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tune, "search", None)
    assert tune.main(["--out", name]) == 2
    assert capsys.readouterr().err == f"tune: error: --out is {name}; allowed: a .toml file in a folder that is there\n"
