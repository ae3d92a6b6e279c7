"""The policies that are shipped: they are known by name, run without torch, and do better than chance."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from dirt_env.agents.loading import load_settings
from dirt_env.agents.network import load
from dirt_env.agents.settings import flattened

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
    metadata = {name: trained(name) for name in seeds}
    assert [metadata[name]["seed"] for name in seeds] == list(range(len(seeds)))
    shipped = plain("ppo_heap")
    assert all({**flattened(metadata[name]["settings"]), "seed": 0} == shipped for name in seeds)
    scores = {
        name: np.mean([level["volume_distance_m4_per_min"] for level in metadata[name]["selection"]]) for name in seeds
    }
    best = max(scores, key=scores.get)
    assert trained_file("ppo").read_bytes() == trained_file(best).read_bytes()


def test_the_large_one_is_of_the_settings_that_are_shipped_for_it():
    assert flattened(trained("ppo_large")["settings"]) == plain("ppo_large")


def trained(name):
    """What a shipped policy's file says of its training."""
    return load(trained_file(name), load_scene()).metadata["training"]


def plain(name):
    """Settings that are shipped, as a policy's file has them, by dotted key."""
    return flattened(json.loads(json.dumps(load_settings(Path(name), {}).to_dict())))


def test_the_document_of_results_has_all_of_them_and_its_pictures():
    document = ROOT / "docs" / "results.md"
    text = document.read_text(encoding="utf-8")
    assert all(f"| {name} |" in text for name in SHIPPED[1:])
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert len(pictures) == 4
    assert all((document.parent / picture).is_file() for picture in pictures)


@pytest.mark.parametrize("name", SHIPPED)
def test_each_is_listed_described_and_says_what_it_needs(name, capsys):
    policy = load_policy(name, load_scene())
    assert policy.sees == "patch"
    assert policy.action == {"blade": "grade"}
    assert policy.observation["overview"]
    assert main(["policies"]) == 0
    assert f"{name} " in capsys.readouterr().out
    assert "million steps" in describe_policy(name)


def test_descriptions_tell_them_apart():
    assert len({describe_policy(name) for name in SHIPPED[1:]}) == len(SHIPPED) - 1


@pytest.mark.slow
@pytest.mark.parametrize(("name", "level"), [("ppo", 0), ("ppo", 1), ("ppo_large", 0)])
def test_it_brings_the_soil_home(name, level):
    record = run_trial(Trial(name, Task("heap", level, "heap", {"level": level}), SELECTION[0]))
    assert record["metrics"]["share_end"] > 0.9
