"""The policies that are shipped: they are known by name, run without torch, and do better than chance."""

import re
from pathlib import Path

import numpy as np
import pytest
from dirt_env.agents.network import load

from dirt_env.bench.evaluate.episode import Trial, run_trial
from dirt_env.bench.evaluate.suite import Task
from dirt_env.cli import main
from dirt_env.config import load as load_scene
from dirt_env.policy import describe_policy, load_policy, policy_names, trained_file
from dirt_env.split import SELECTION

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = tuple(name for name in policy_names() if name.startswith("ppo"))


def test_there_is_one_of_each_training_seed_the_best_of_them_and_a_large_one():
    assert ("ppo", "ppo_large", *(f"ppo_seed{seed}" for seed in range(5))) == SHIPPED
    seeds = SHIPPED[2:]
    metadata = {name: load(trained_file(name), load_scene()).metadata["training"] for name in seeds}
    assert [metadata[name]["seed"] for name in seeds] == list(range(len(seeds)))
    settings = [{**metadata[name]["settings"], "seed": None} for name in seeds]
    assert all(one == settings[0] for one in settings)
    scores = {name: np.mean([level["share_area"] for level in metadata[name]["selection"]]) for name in seeds}
    best = max(scores, key=scores.get)
    assert trained_file("ppo").read_bytes() == trained_file(best).read_bytes()


def test_the_document_of_results_has_all_of_them_and_its_pictures():
    document = ROOT / "docs" / "results.md"
    text = document.read_text(encoding="utf-8")
    assert all(f"| {name} |" in text for name in SHIPPED[1:])
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert len(pictures) == 3
    assert all((document.parent / picture).is_file() for picture in pictures)


@pytest.mark.parametrize("name", SHIPPED)
def test_each_is_listed_described_and_says_what_it_needs(name, capsys):
    policy = load_policy(name, load_scene())
    assert policy.sees == "patch"
    assert policy.action == {"blade": "grade"}
    assert policy.observation["overview"]
    assert main(["policies"]) == 0
    assert f"{name} " in capsys.readouterr().out
    assert describe_policy(name)


@pytest.mark.slow
@pytest.mark.parametrize("level", [0, 1])
def test_it_brings_the_soil_home(level):
    record = run_trial(Trial("ppo", Task("heap", level, "heap", {"level": level}), SELECTION[0]))
    assert record["metrics"]["share_end"] > 0.9
