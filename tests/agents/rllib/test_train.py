"""RLlib's PPO on a local cluster of two nodes, of which one is lost; `make test-ray` runs this."""

import csv
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from dirt_env.config import load
from dirt_env.env import DirtPushEnv
from dirt_env.policy import load_policy, needed

ROOT = Path(__file__).resolve().parents[3]
SMOKE = ROOT / "configs" / "rllib" / "smoke.toml"
TRAIN = [sys.executable, str(ROOT / "agents" / "rllib" / "train.py"), "--config", str(SMOKE)]
STEPS = 256  # of one update


def rows(out):
    """What the run has logged so far."""
    path = out / "training.csv"
    return list(csv.DictReader(path.read_text().splitlines())) if path.exists() else []


def await_row(running, out, is_it, seconds=240):
    """Wait for a logged line of which `is_it` is true; fails with what the run said if it ends before."""
    until = time.monotonic() + seconds
    while not any(map(is_it, found := rows(out))):
        assert running.poll() is None, running.communicate()[1]
        assert time.monotonic() < until, found
        time.sleep(0.05)


def runners(wanted, after=0):
    """Whether an update later than `after` updates was made by so many env runners."""
    return lambda row: float(row["runners"]) == wanted and float(row["steps"]) > after * STEPS


def test_a_start_that_fails_leaves_nothing_behind(tmp_path):
    pytest.importorskip("ray.rllib")
    command = [*TRAIN, "--address", "1.2.3", "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 2
    assert "--address is '1.2.3'" in done.stderr
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.slow
def test_a_lost_machine_does_not_end_the_run(tmp_path):
    """A runner on each node; one node is killed and the run goes on; a machine that joins gets its runner."""
    cluster_utils = pytest.importorskip("ray.cluster_utils")
    pytest.importorskip("ray.rllib")
    out = tmp_path / "out"
    cluster = cluster_utils.Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        second = cluster.add_node(num_cpus=1)
        cluster.wait_for_nodes()
        command = [*TRAIN, "--address", cluster.address, "--out", str(out)]
        endless = [*command, "--set", "steps=10_000_000"]
        running = subprocess.Popen(endless, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        await_row(running, out, runners(2))
        cluster.remove_node(second, allow_graceful=False)
        await_row(running, out, runners(1))
        alone = len(rows(out))
        cluster.add_node(num_cpus=1)
        await_row(running, out, runners(2, after=alone))
        running.send_signal(signal.SIGINT)
        said = running.communicate(timeout=120)[1]
        assert running.returncode == 130, said
        done = int(float(rows(out)[-1]["steps"]))
        assert f"stopped after {done:,} of 10,000,000 steps" in said
        kept = {"settings.json", "training.csv", "policy.npz", f"checkpoint-{done:012d}"}
        assert {path.name for path in out.iterdir()} == kept
        other = subprocess.run([*command, "--set", "ppo.gamma=0.9"], capture_output=True, text=True, timeout=300)
        assert (other.returncode, other.stderr.count("\n")) == (2, 1), other.stderr
        assert f"{out} holds a run with other ppo; allowed: the same, or --fresh, or another --out" in other.stderr
        wanted = done + 2 * STEPS
        again = subprocess.run([*command, "--set", f"steps={wanted}"], capture_output=True, text=True, timeout=300)
        assert again.returncode == 0, again.stderr
        assert f"going on in {out} after {done:,} of {wanted:,} steps" in again.stderr
        steps, seconds = ([float(row[name]) for row in rows(out)] for name in ("steps", "seconds"))
        assert steps[-1] >= wanted
        assert (steps, seconds) == (sorted(set(steps)), sorted(seconds))
        before = {path.name for path in out.iterdir()}
        nowhere = [*TRAIN, "--address", "nonsense", "--out", str(out), "--fresh"]
        lost = subprocess.run(nowhere, capture_output=True, text=True, timeout=300)
        assert (lost.returncode, lost.stderr.count("\n")) == (2, 1), lost.stderr
        assert {path.name for path in out.iterdir()} == before  # the old run is there until the new one can be
        anew = subprocess.run(
            [*command, "--set", f"steps={STEPS}", "--fresh"], capture_output=True, text=True, timeout=300
        )
        assert anew.returncode == 0, anew.stderr
        assert [float(row["steps"]) for row in rows(out)] == [STEPS]
        assert [path.name for path in out.glob("checkpoint-*")] == [f"checkpoint-{STEPS:012d}"]
    finally:
        cluster.shutdown()
    policy = load_policy(str(out / "policy.npz"), load("heap"))
    observation, _ = DirtPushEnv(**needed(policy)).reset(seed=0)
    action = policy.act(observation)
    assert action.shape == (3,)
    assert np.abs(action).max() <= 1.0
