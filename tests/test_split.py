"""Training, selection and evaluation never share a layout."""

import ast
from pathlib import Path

import numpy as np
import pytest
from dirt_env.baselines.pushing import tune

from dirt_env.config import layout, load
from dirt_env.env import DirtPushEnv
from dirt_env.split import EVALUATION, SELECTION, SPLITS, TRAINING, layouts, training_seeds


def test_the_parts_are_disjoint_and_reported_layouts_begin_at_10000():
    assert not set(TRAINING) & set(SELECTION)
    assert not set(TRAINING) & set(EVALUATION)
    assert not set(SELECTION) & set(EVALUATION)
    assert EVALUATION[0] == 10_000
    assert layouts("evaluation", 3) == (10_000, 10_001, 10_002)


@pytest.mark.parametrize("name", SPLITS)
def test_layouts_are_of_the_part_that_is_asked_for(name):
    assert set(layouts(name, 50)) <= set(SPLITS[name])


def test_more_than_there_are_or_another_part_is_refused():
    with pytest.raises(ValueError, match=r"layouts is 10001; allowed: 1 to 10000"):
        layouts("evaluation", 10_001)
    with pytest.raises(ValueError, match=r"split is 'test'; allowed: training, selection, evaluation"):
        layouts("test", 1)
    with pytest.raises(ValueError, match="count is 0"):
        training_seeds(np.random.default_rng(0), 0)


def test_training_draws_different_training_layouts():
    seeds = training_seeds(np.random.default_rng(3), 500)
    assert len(set(seeds)) == 500
    assert set(seeds) <= set(TRAINING)


def test_tuning_plays_on_training_layouts_only(monkeypatch):
    played = []
    monkeypatch.setattr(tune, "cost", lambda env, policy, seed: played.append(seed) or 0.5)
    tune.search(trials=2, episodes=4, seed=1, say=lambda _: None)
    assert played
    assert set(played) <= set(TRAINING)


def test_no_behaviour_names_a_layout_of_its_own():
    """Seeds of what tunes and trains come from the split: no large number stands in those files."""
    root = Path(__file__).resolve().parents[1]
    for path in [*root.glob("baselines/**/*.py"), *root.glob("agents/**/*.py")]:
        numbers = [node.value for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Constant)]
        assert not [n for n in numbers if type(n) is int and n in EVALUATION], path


def test_the_id_draws_the_layout():
    env, config = DirtPushEnv(level=2), load(level=2)
    env.reset(seed=10_003)
    expected = layout(config, np.random.default_rng(10_003))
    assert (env.episode.layout.height == expected.height).all()
    assert env.episode.layout.pose == expected.pose
