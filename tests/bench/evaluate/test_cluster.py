"""Ray: two machines, one of which is lost in mid-run, give the same bytes. `make test-ray` runs this."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dirt_env.bench.evaluate.journal import EPISODES, RESULT
from dirt_env.cli import main

ROOT = Path(__file__).resolve().parents[3]
RULE = """
import os, time
from pathlib import Path
import numpy as np

HERE = Path(__file__).parent

class Waiting:
    "Acts at random; in mid-episode it says on which node it is, and waits while there is a file `wait`."
    sees = "patch"
    def __init__(self, config): pass
    def reset(self, seed=None):
        self.generator, self.seed, self.steps = np.random.default_rng(seed), seed, 0
    def act(self, observation):
        self.steps += 1
        if self.steps == 10 and (HERE / "wait").exists():
            import ray
            node = ray.get_runtime_context().get_node_id()
            (HERE / f"waits-{self.seed}-{os.getpid()}.tmp").write_text(node)
            (HERE / f"waits-{self.seed}-{os.getpid()}.tmp").rename(HERE / f"waits-{self.seed}-{os.getpid()}.txt")
            while (HERE / "wait").exists():
                time.sleep(0.02)
        return self.generator.uniform(-1, 1, 3) + 0.1 * observation["pose"][:3]
"""
HANGS = 1800  # s; only a run that hangs takes so long, however busy the machine is
OPTIONS = ["--suite", "quick", "--policies", "waiting_rule:Waiting,adaptive_push", "--layouts", "4", "--steps", "50"]


@pytest.mark.slow
def test_a_lost_machine_changes_nothing(tmp_path, monkeypatch):
    """Two nodes, each of them held in the middle of an episode; one is killed there, then the other may go on."""
    cluster_utils = pytest.importorskip("ray.cluster_utils")
    (tmp_path / "waiting_rule.py").write_text(RULE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setattr(sys, "path", [*sys.path])
    command = [sys.executable, "-m", "dirt_env", "evaluate", *OPTIONS]
    subprocess.run([*command, "--out", "here"], check=True, stdout=subprocess.DEVNULL, timeout=HANGS)
    (tmp_path / "wait").touch()
    cluster = cluster_utils.Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        second = cluster.add_node(num_cpus=1)
        cluster.wait_for_nodes()
        away = [*command, "--ray", cluster.address, "--out", "there"]
        running = subprocess.Popen(away, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        lost = seed_that_waits_on(second.node_id, tmp_path, running)
        cluster.remove_node(second, allow_graceful=False)
        (tmp_path / "wait").unlink()
        said = running.communicate(timeout=HANGS)[1]
        assert running.returncode == 0, said
    finally:
        cluster.shutdown()
    records = [json.loads(line) for line in (tmp_path / "there" / EPISODES).read_text().splitlines()]
    assert len(records) == 16
    assert lost in {record["layout"] for record in records if record["policy"].endswith(":Waiting")}, "played elsewhere"
    assert (tmp_path / "there" / RESULT).read_bytes() == (tmp_path / "here" / RESULT).read_bytes()


def seed_that_waits_on(node: str, folder: Path, running: subprocess.Popen) -> int:
    """The layout whose episode is held on that node; fails if the run ends before, or takes too long."""
    until = time.monotonic() + HANGS
    while time.monotonic() < until and running.poll() is None:
        for path in folder.glob("waits-*.txt"):
            if path.read_text() == node:
                return int(path.name.split("-")[1])
        time.sleep(0.02)
    raise AssertionError(f"no episode came to its middle on the node; the run says {running.poll()}")


def test_without_ray_it_says_what_to_install(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    arguments = ["evaluate", "--policies", "idle", "--layouts", "1", "--ray", "auto", "--out", str(tmp_path / "out")]
    assert main(arguments) == 2
    assert 'pip install ".[ray]" into a virtual environment of its own' in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
