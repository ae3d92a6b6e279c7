"""Settings of runs on a cluster: the shipped ones are read, and what cannot be is refused."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest
from dirt_env.agents.rllib.settings import CLUSTER, load_cluster_settings
from dirt_env.agents.rllib.train import main

FOLDER = Path(__file__).resolve().parents[3] / "configs" / "rllib"
SMOKE = FOLDER / "smoke.toml"
EXAMPLE = FOLDER.parents[1] / "docs" / "examples" / "rllib_shove.toml"


@pytest.mark.parametrize("path", [*sorted(FOLDER.glob("*.toml")), EXAMPLE], ids=lambda path: path.stem)
def test_shipped_settings_are_read_and_written_back(path):
    settings = load_cluster_settings(path, {})
    plain = settings.to_dict()
    assert plain.pop("name") == path.stem == settings.name
    assert replace(CLUSTER.read(plain, "", path.parent), name=path.stem) == settings
    assert settings.rollout >= settings.ppo.batch_size


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"ppo": {"gama": 0.9}}, "ppo.gama is not known, did you mean gamma"),
        ({"cluster": {"runners": -1}}, "cluster.runners is -1"),
        (
            {"ppo": {"batch_size": 257}},
            "ppo.batch_size is 257; allowed: at most cluster.runners x worlds.count x ppo.n_steps = 256",
        ),
        ({"worlds": {"levels": [17]}}, "level is 17"),
        ({"worlds": {"set": {"observation": {"map": True}}}}, "allowed: patch and pose"),
        ({"network": {"roots": True}}, "network.roots is True; allowed: False"),
        ({"network": {"kernels": [9]}}, "network.kernels has 9 over 8 pixels"),
        ({"network": {"strides": [1, 1]}}, "network.filters, kernels and strides have 1, 1 and 2 numbers"),
    ],
)
def test_what_cannot_be_is_refused(overrides, words):
    with pytest.raises(ValueError, match=words.replace("[", r"\[")):
        load_cluster_settings(SMOKE, overrides)


def test_without_ray_it_says_what_to_install(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    assert main(["--config", str(SMOKE), "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("train: error: ")
    assert 'pip install ".[rllib]"' in said
