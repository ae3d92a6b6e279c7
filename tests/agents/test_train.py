"""The command as people use it: it trains, survives a kill at any moment, and refuses what does not fit."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from dirt_env.agents import checkpoint
from dirt_env.agents.archive import packed, unpacked
from dirt_env.agents.lock import alone_in
from dirt_env.agents.train import main
from dirt_env.agents.trainer import Trainer

from .conftest import SMOKE, smoke

SCRIPT = Path(__file__).resolve().parents[2] / "agents" / "train.py"
RESULTS = ("policy.npz", "best.npz", "selection.csv")
SHORT = ["--config", str(SMOKE), "--set", "steps=768", "--set", "record.evaluate_every=768"]


def start(out, *more):
    command = [sys.executable, str(SCRIPT), "--config", str(SMOKE), "--out", str(out), *more]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def steps_in(out):
    """The last step of the environment that the log has."""
    path = out / "training.csv"
    lines = path.read_text().splitlines() if path.is_file() else []
    return int(lines[-1].split(",")[0] or 0) if len(lines) > 1 and lines[-1][:1].isdigit() else 0


def wait_for(process, out, steps):
    while process.poll() is None and steps_in(out) < steps:
        time.sleep(0.01)
    assert process.poll() is None, process.communicate()


def without_times(path):
    """A log without what a clock has said."""
    rows = [line.split(",") for line in path.read_text().splitlines()]
    timed = ("seconds", "cpu_seconds", "environment", "inference", "update", "steps_per_s")
    return [[cell for name, cell in zip(rows[0], row, strict=True) if name not in timed] for row in rows]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The folder of a run that nothing came in the way of."""
    out = tmp_path_factory.mktemp("undisturbed")
    process = start(out)
    said, complaint = process.communicate(timeout=300)
    assert process.returncode == 0, complaint
    assert "4,096 steps in" in said
    assert "level 1: " in said
    return out


@pytest.mark.slow
def test_a_run_that_is_killed_again_and_again_ends_with_the_same_bits(undisturbed, tmp_path):
    for steps in (300, 1100, 2600):  # before the first save, in the second stage, after the first evaluation
        process = start(tmp_path)
        wait_for(process, tmp_path, steps)
        process.send_signal(signal.SIGKILL)
        process.communicate()
    process = start(tmp_path)
    said, told = process.communicate(timeout=300)
    assert process.returncode == 0, told
    assert "going on in" in told
    assert "4,096 steps in" in said
    assert checkpoint.read(tmp_path / "checkpoint.npz").metadata["steps"] == 4096
    for name in ("policy.npz", "best.npz"):
        assert (tmp_path / name).read_bytes() == (undisturbed / name).read_bytes(), name
    for name in ("training.csv", "selection.csv"):
        assert without_times(tmp_path / name) == without_times(undisturbed / name)


@pytest.mark.slow
def test_a_run_with_a_teacher_that_is_killed_ends_with_the_same_bits(tmp_path):
    teacher = {"policy": "adaptive_push", "worlds": 4, "steps": 240, "epochs": 3, "critic_steps": 700}
    settings = [f"teacher.{name}={value}" for name, value in teacher.items()] + ["steps=1280"]
    more = [word for setting in settings for word in ("--set", setting)]
    process = start(tmp_path / "undisturbed", *more)
    _, told = process.communicate(timeout=300)
    assert process.returncode == 0, told
    out = tmp_path / "killed"
    for begun in (out, out / "checkpoint.npz"):  # before anything is saved, and when the teacher has just played
        process = start(out, *more)
        while process.poll() is None and not begun.exists():
            time.sleep(0.01)
        process.kill()
        process.communicate()
        assert (out / "checkpoint.npz").exists() == (begun != out)
    for steps in (256, 768):  # while the critic learns alone, and after that
        process = start(out, *more)
        wait_for(process, out, steps)
        process.kill()
        process.communicate()
    process = start(out, *more)
    _, told = process.communicate(timeout=300)
    assert process.returncode == 0, told
    assert "going on in" in told
    for name in ("policy.npz", "best.npz"):
        assert (out / name).read_bytes() == (tmp_path / "undisturbed" / name).read_bytes(), name


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_run_that_is_asked_to_stop_saves_and_goes_on(number, undisturbed, tmp_path):
    process = start(tmp_path, "--set", "record.save_every=1000000")
    wait_for(process, tmp_path, 600)
    process.send_signal(number)
    _, told = process.communicate(timeout=120)
    assert process.returncode == 128 + number
    saved = checkpoint.read(tmp_path / "checkpoint.npz").metadata["steps"]
    assert f"train: stopped after {saved:,} of 4,096 steps; the same command goes on from there" in told
    process = start(tmp_path, "--set", "record.save_every=1000000")
    _, told = process.communicate(timeout=300)
    assert process.returncode == 0, told
    assert without_times(tmp_path / "training.csv") == without_times(undisturbed / "training.csv")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The folder of a very short run."""
    out = tmp_path_factory.mktemp("finished")
    assert main([*SHORT, "--out", str(out)]) == 0
    return out


def test_a_run_leaves_a_policy_logs_and_a_checkpoint(finished):
    assert {path.name for path in finished.iterdir()} == {*RESULTS, "training.csv", "checkpoint.npz", "tensorboard"}
    assert any((finished / "tensorboard").iterdir())
    found = checkpoint.read(finished / "checkpoint.npz").metadata
    assert (found["steps"], found["seed"], found["settings"]["ppo"]["n_steps"]) == (768, 0, 16)
    assert {"torch", "stable_baselines3", "dirt_env"} <= found["versions"].keys()
    with np.load(finished / "policy.npz") as file:
        training = json.loads(bytes(file["metadata"]))["training"]
    assert (training["steps"], training["seed"], training["settings"]) == (768, 0, found["settings"])


def test_a_finished_run_is_left_as_it_is(finished, capsys):
    before = {name: (finished / name).read_bytes() for name in RESULTS}
    assert main([*SHORT, "--out", str(finished)]) == 0
    captured = capsys.readouterr()
    assert "going on" in captured.err
    assert "768 steps in" in captured.out
    assert {name: (finished / name).read_bytes() for name in RESULTS} == before


def test_going_on_with_other_versions_is_said(finished, tmp_path, capsys):
    arrays, metadata = unpacked(finished / "checkpoint.npz", checkpoint.FORMAT)
    here = metadata["versions"]["torch"]
    metadata["versions"]["torch"] = "1.0"
    (tmp_path / "checkpoint.npz").write_bytes(packed(arrays, metadata))
    assert main([*SHORT, "--out", str(tmp_path)]) == 0
    said = f"train: with torch {here} (1.0 there), so not to the same last bit as if it had never stopped\n"
    assert said in capsys.readouterr().err
    assert main([*SHORT, "--out", str(finished)]) == 0
    assert "last bit" not in capsys.readouterr().err


def test_levels_of_a_scene_that_has_none_are_refused_table_by_table(tmp_path, capsys):
    site = tmp_path / "site.toml"
    site.write_text(
        'start = [{region = {kind = "circle", center = [8.0, 12.0], radius = 2.0}, volume = 5.0}]\n'
        'goal = [{region = {kind = "circle", center = [24.0, 12.0], radius = 3.0}}]\n'
    )
    run = ["--config", str(SMOKE), "--out", str(tmp_path / "out"), "--set", f"worlds.scene={site}"]
    assert main(run) == 2
    assert "or no levels (--set 'stage=[{}]')" in capsys.readouterr().err
    assert main([*run, "--set", "stage=[{}]"]) == 2
    assert "or no levels (--set record.levels=[])" in capsys.readouterr().err
    assert main([*run, "--set", "stage=[{}]", "--set", "record.levels=[]", "--set", "steps=256"]) == 0


def test_other_settings_are_refused_and_fresh_begins_anew(finished, tmp_path, capsys):
    (tmp_path / "checkpoint.npz").write_bytes((finished / "checkpoint.npz").read_bytes())
    other = [*SHORT, "--out", str(tmp_path), "--set", "ppo.gamma=0.9", "--seed", "3"]
    assert main(other) == 2
    said = capsys.readouterr().err
    assert "other settings: seed is 3 here and 0 there; ppo.gamma is 0.9 here and 0.99 there; allowed: the same" in said
    assert main([*other, "--fresh"]) == 0


def test_what_a_run_has_left_without_its_checkpoint_is_not_written_over(finished, tmp_path, capsys):
    policy = (finished / "best.npz").read_bytes()
    (tmp_path / "best.npz").write_bytes(policy)
    assert main([*SHORT, "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert f"{tmp_path} has best.npz and no checkpoint.npz to go on from; allowed: --fresh to begin anew" in said
    assert (tmp_path / "best.npz").read_bytes() == policy
    assert main([*SHORT, "--out", str(tmp_path), "--fresh"]) == 0


def test_fresh_lets_the_old_run_go_when_the_new_one_is_ready(finished, tmp_path, monkeypatch, capsys):
    out = tmp_path / "out"
    shutil.copytree(finished, out)
    before = {path: path.read_bytes() for path in out.iterdir() if path.is_file()}
    (tmp_path / "bad_teachers.py").write_text(
        "import numpy as np\n"
        "class Fails:\n"
        "    sees = 'nothing'\n"
        "    def __init__(self, config): pass\n"
        "    def reset(self, seed=None): pass\n"
        "    def act(self, observation): return nothing\n"
        "class Short(Fails):\n"
        "    def act(self, observation): return np.zeros(2)\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    teacher = ["--set", "teacher.worlds=2", "--set", "teacher.critic_steps=100", "--fresh", "--out", str(out)]
    for name, complaint in (
        ("Fails", "which failed: NameError: name 'nothing' is not defined (bad_teachers.py, line 6)"),
        ("Short", "which gives actions of the shape (2,); allowed: (3,)"),
    ):
        assert main([*SHORT, "--set", f"teacher.policy=bad_teachers:{name}", *teacher]) == 2
        assert f"train: error: teacher.policy is 'bad_teachers:{name}', {complaint}" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in out.iterdir() if path.is_file()} == before


def test_two_runs_in_one_folder_are_refused(tmp_path, capsys):
    with alone_in(tmp_path):
        assert main([*SHORT, "--out", str(tmp_path)]) == 2
    assert f"another run is at work in {tmp_path}; allowed: one at a time" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_scene_that_has_changed_is_refused(tmp_path, monkeypatch, capsys):
    np.save(tmp_path / "map.npy", np.zeros((64, 64)))
    monkeypatch.chdir(tmp_path)
    ground = 'worlds.set.ground={kind="file", path="map.npy", pixel=0.5}'
    run = [
        "--config",
        str(SMOKE),
        "--out",
        "out",
        "--set",
        ground,
        "--set",
        "steps=256",
        "--set",
        "stage=[{levels=[0]}]",
    ]
    assert main([*run, "--set", "record.evaluate_every=256"]) == 0
    capsys.readouterr()
    np.save(tmp_path / "map.npy", np.full((64, 64), 0.01))
    assert main([*run, "--set", "record.evaluate_every=256"]) == 2
    assert f"is of a run in another scene: {tmp_path / 'map.npy'} has changed since; allowed" in capsys.readouterr().err


def test_a_run_that_diverges_says_so_in_a_line(tmp_path, capsys):
    assert main([*SHORT, "--out", str(tmp_path), "--set", "ppo.vf_coef=1e39"]) == 2
    said = capsys.readouterr().err
    assert "train: error: training diverged after " in said
    assert said.endswith("the actions are no finite numbers any more; allowed: a smaller ppo.learning_rate\n")
    assert "tensor" not in said.lower()


def test_the_last_evaluation_is_saved_and_not_made_again(tmp_path, capsys):
    run = ["--config", str(SMOKE), "--out", str(tmp_path), "--set", "steps=1024", "--set", "stage=[{levels=[0]}]"]
    assert main([*run, "--set", "record.evaluate_every=768", "--set", "record.save_every=256"]) == 0
    before = (tmp_path / "selection.csv").read_text()
    assert main([*run, "--set", "record.evaluate_every=768", "--set", "record.save_every=256"]) == 0
    assert (tmp_path / "selection.csv").read_text() == before


def test_ctrl_c_in_the_last_update_leaves_the_last_evaluation_to_the_next_run(tmp_path, capsys, monkeypatch):
    iterate = Trainer._iterate

    def interrupted(trainer, logbook):
        iterate(trainer, logbook)
        if trainer.is_done:
            os.kill(os.getpid(), signal.SIGINT)

    run = ["--config", str(SMOKE), "--out", str(tmp_path), "--set", "steps=1024", "--set", "stage=[{levels=[0]}]"]
    run += ["--set", "record.evaluate_every=5000"]
    with monkeypatch.context() as patched:
        patched.setattr(Trainer, "_iterate", interrupted)
        assert main(run) == 130
    assert "the same command goes on from there" in capsys.readouterr().err
    assert not (tmp_path / "policy.npz").exists()
    assert main(run) == 0
    assert (tmp_path / "policy.npz").is_file()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--config", "none.toml"], "config none.toml is no file"),
        (["--config", str(SMOKE), "--set", "ppo.gama=1"], "ppo.gama is not known, did you mean gamma"),
        (["--config", str(SMOKE), "--set", "ppo"], "--set is 'ppo'; allowed: KEY=VALUE"),
        (["--config", str(SMOKE), "--seed", "-1"], "seed is -1; allowed: a whole number >= 0"),
    ],
)
def test_bad_input_is_one_clear_line(arguments, complaint, tmp_path, capsys):
    assert main([*arguments, "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert complaint in said


def test_a_setting_given_as_an_argument_is_told_where_it_goes(capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["--config", "smoke", "--steps", "100"])
    assert "unrecognized arguments: --steps 100; settings are changed by --set, as in" in capsys.readouterr().err


def test_a_checkpoint_cut_off_anywhere_is_said_to_be_damaged(finished, tmp_path):
    whole = (finished / "checkpoint.npz").read_bytes()
    path = tmp_path / "checkpoint.npz"
    for length in (0, 1, len(whole) // 3, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(ValueError, match=r"is damaged: .*allowed: --fresh"):
            Trainer(smoke(), tmp_path)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda arrays, metadata: arrays.pop("begins"), "it has no begins"),
        (lambda arrays, metadata: metadata.pop("notes"), "it has no notes"),
        (lambda arrays, metadata: metadata.update(stage=7), "its stage is 7, of 2"),
    ],
)
def test_a_checkpoint_that_lacks_something_is_said_to_be_damaged(change, complaint, finished, tmp_path):
    arrays, metadata = unpacked(finished / "checkpoint.npz", checkpoint.FORMAT)
    change(arrays, metadata)
    (tmp_path / "checkpoint.npz").write_bytes(packed(arrays, metadata))
    with pytest.raises(ValueError, match=f"is damaged: {complaint}; allowed: --fresh"):
        checkpoint.read(tmp_path / "checkpoint.npz")


def test_a_save_that_fails_leaves_the_old_checkpoint(finished, tmp_path, monkeypatch):
    path = tmp_path / "checkpoint.npz"
    trainer = Trainer(smoke(), tmp_path)
    trainer._save()
    before = path.read_bytes()
    trainer.model.num_timesteps += 1

    def fail(*_):
        raise OSError("no space left")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="no space left"):
        trainer._save()
    trainer.close()
    assert path.read_bytes() == before
    assert [one.name for one in tmp_path.iterdir()] == ["checkpoint.npz"]


def test_the_learning_rate_falls_over_the_whole_run(finished):
    header, *rows = [line.split(",") for line in (finished / "training.csv").read_text().splitlines()]
    rates = [float(row[header.index("learning_rate")]) for row in rows]
    assert rates == pytest.approx([5e-4 * (1 - 0.9 * (i + 1) / 3) for i in range(3)], rel=1e-5)


def test_without_torch_it_says_what_to_install(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "dirt_env.agents.trainer", None)
    assert main(["--config", str(SMOKE), "--out", str(tmp_path / "new")]) == 2
    assert not (tmp_path / "new").exists()
    assert 'training needs more than the environment: pip install ".[train]"' in capsys.readouterr().err


def test_an_out_that_is_no_folder_is_one_clear_line(tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    assert main(["--config", str(SMOKE), "--out", str(tmp_path / "file")]) == 2
    assert capsys.readouterr().err.startswith(f"train: error: --out is {tmp_path / 'file'}, which is a file; allowed")


def test_a_gpu_that_is_not_there_is_said_before_an_old_run_goes(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    (tmp_path / "policy.npz").write_text("of an old run")
    assert main(["--config", str(SMOKE), "--out", str(tmp_path), "--fresh", "--set", "device=cuda"]) == 2
    assert capsys.readouterr().err == (
        'train: error: device is "cuda", and torch sees no GPU; allowed: "cpu", or "auto" for one if there is one\n'
    )
    assert (tmp_path / "policy.npz").read_text() == "of an old run"
    assert main(["--config", str(SMOKE), "--out", str(tmp_path / "new"), "--set", "device=cuda"]) == 2
    assert not (tmp_path / "new").exists()
