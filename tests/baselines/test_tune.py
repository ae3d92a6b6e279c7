"""Tuning writes its numbers as a file that a policy's name can name."""

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


@pytest.mark.parametrize("name", ["nowhere/mine.toml", "mine.txt"])
def test_a_place_that_cannot_be_is_refused_before_it_searches(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tune, "search", None)
    assert tune.main(["--out", name]) == 2
    assert capsys.readouterr().err == f"tune: error: --out is {name}; allowed: a .toml file in a folder that is there\n"
