"""Ray: two machines, one of which is lost in mid-run, give the same bytes. `make test-ray` runs this."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dirt_env.bench.evaluate.journal import EPISODES, RESULT
from dirt_env.cli import main

ROOT = Path(__file__).resolve().parents[3]
SLOW_RULE = """
import os, time
import numpy as np

class Slow:
    sees = "patch"
    def __init__(self, config): pass
    def reset(self, seed=None):
        self.generator = np.random.default_rng(seed)
        with open(os.path.join(os.path.dirname(__file__), "begun.txt"), "a") as file:
            file.write(f"{seed}\\n")
    def act(self, observation):
        time.sleep(0.02)
        return self.generator.uniform(-1, 1, 3) + 0.1 * observation["pose"][:3]
"""
OPTIONS = ["--suite", "quick", "--policies", "slow_rule:Slow,adaptive_push", "--layouts", "4", "--steps", "50"]


@pytest.mark.slow
def test_a_lost_machine_changes_nothing(tmp_path, monkeypatch):
    cluster_utils = pytest.importorskip("ray.cluster_utils")
    (tmp_path / "slow_rule.py").write_text(SLOW_RULE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setattr(sys, "path", [*sys.path])
    command = [sys.executable, "-m", "dirt_env", "evaluate", *OPTIONS]
    subprocess.run([*command, "--out", "here"], check=True, stdout=subprocess.DEVNULL, timeout=300)
    begun_here = len((tmp_path / "begun.txt").read_text().split())
    cluster = cluster_utils.Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        second = cluster.add_node(num_cpus=1)
        cluster.wait_for_nodes()
        away = [*command, "--ray", cluster.address, "--out", "there"]
        running = subprocess.Popen(away, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        lines = tmp_path / "there" / EPISODES
        until = time.monotonic() + 240
        while running.poll() is None and time.monotonic() < until:
            if lines.exists() and lines.read_bytes().count(b"\n") >= 3:
                break
            time.sleep(0.02)
        begun_both = (tmp_path / "begun.txt").read_text().split()[begun_here:]
        assert len(begun_both) >= 2
        time.sleep(0.3)  # into the next episode of about a second
        cluster.remove_node(second, allow_graceful=False)
        said = running.communicate(timeout=300)[1]
        assert running.returncode == 0, said
    finally:
        cluster.shutdown()
    begun = (tmp_path / "begun.txt").read_text().split()
    assert len(begun) > 2 * begun_here, "an episode was lost with its machine, and begun again"
    assert (tmp_path / "there" / RESULT).read_bytes() == (tmp_path / "here" / RESULT).read_bytes()
    assert (tmp_path / "there" / EPISODES).read_bytes().count(b"\n") == 16


def test_without_ray_it_says_what_to_install(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    arguments = ["evaluate", "--policies", "idle", "--layouts", "1", "--ray", "auto", "--out", str(tmp_path)]
    assert main(arguments) == 2
    assert 'pip install ".[ray]" into a virtual environment of its own' in capsys.readouterr().err
    assert os.path.getsize(tmp_path / EPISODES) == 0
