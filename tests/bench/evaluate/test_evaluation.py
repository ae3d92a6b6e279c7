"""`dirt-push evaluate`: one table, however it was come by; nothing finished is lost."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from dirt_env.bench.evaluate import evaluation, pool
from dirt_env.bench.evaluate.episode import METRICS, run_trial
from dirt_env.bench.evaluate.journal import EPISODES, RESULT, SETTINGS
from dirt_env.bench.evaluate.suite import suite_names
from dirt_env.cli import main
from dirt_env.split import EVALUATION

SMALL = ["--suite", "quick", "--policies", "adaptive_push,idle,random", "--layouts", "3", "--steps", "40"]


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The folder of an undisturbed evaluation by one worker."""
    out = tmp_path_factory.mktemp("one")
    assert main(["evaluate", *SMALL, "--out", str(out)]) == 0
    return out


def figures(out):
    return (out / RESULT).read_bytes()


def test_it_writes_every_figure_with_its_interval(finished):
    result = json.loads(figures(finished))
    assert [(task["job"], task["level"]) for task in result["tasks"]] == [("heap", 0), ("heap", 1)]
    assert [entry["policy"] for entry in result["overall"]] == ["adaptive_push", "idle", "random"]
    assert len(result["results"]) == 6
    for entry in (*result["results"], *result["overall"]):
        assert set(entry["metrics"]) == set(METRICS)
        for figure in entry["metrics"].values():
            assert set(figure) == {"iqm", "low", "high", "mean", "n"}
            assert figure["iqm"] is None or figure["low"] <= figure["iqm"] <= figure["high"]
    assert result["results"][0]["metrics"]["score"]["n"] == 3
    assert result["overall"][0]["metrics"]["score"]["n"] == 6
    assert [(pair["first"], pair["second"]) for pair in result["pairs"]] == [
        ("adaptive_push", "idle"),
        ("adaptive_push", "random"),
        ("idle", "random"),
    ]
    assert set(result["layouts"]) <= set(EVALUATION)
    assert result["versions"]["dirt_env"]
    assert result["machine"]["architecture"]
    assert {policy["name"]: policy["sees"] for policy in result["policies"]} == {
        "adaptive_push": "map",
        "idle": "nothing",
        "random": "nothing",
    }


def test_all_policies_are_on_the_same_layouts(finished):
    records = [json.loads(line) for line in (finished / EPISODES).read_text().splitlines()]
    of = {
        name: {(r["job"], r["level"], r["layout"]) for r in records if r["policy"] == name}
        for name in ("idle", "random")
    }
    assert of["idle"] == of["random"]
    assert len(records) == 18


def test_it_draws_what_it_found(finished):
    pytest.importorskip("matplotlib")
    assert all((finished / name).read_bytes().startswith(b"\x89PNG") for name in ("share.png", "profile.png"))


def test_the_table_names_job_policy_and_pairs(finished, capsys):
    assert main(["evaluate", *SMALL, "--out", str(finished)]) == 0
    captured = capsys.readouterr()
    lines = captured.out.splitlines()
    assert lines[0].split()[:5] == ["job", "level", "policy", "n", "done"]
    assert [line.split()[0] for line in lines[1:10]] == ["heap"] * 6 + ["all"] * 3
    assert lines[10].startswith("adaptive_push scores higher than idle on the same layout: ")
    assert captured.err == ""


@pytest.mark.slow
@pytest.mark.parametrize("workers", ["1", "2"])
def test_what_a_scene_warns_of_is_said_once(tmp_path, capfd, workers):
    np.save(tmp_path / "step.npy", np.repeat([[0.0], [4.0]], 32, axis=0).repeat(64, axis=1))
    (tmp_path / "steep.toml").write_text("""
        [ground]
        kind = "file"
        path = "step.npy"
        pixel = 0.5
        [[start]]
        region = { kind = "circle", center = [20.0, 6.0], radius = 2.0 }
        volume = 4
        [[goal]]
        region = { kind = "circle", center = [10.0, 6.0], radius = 3.0 }
        [[obstacle]]
        kind = "post"
        center = [28.0, 3.0]
        """)
    (tmp_path / "one.toml").write_text('[[job]]\nscene = "steep.toml"')
    command = ["evaluate", "--suite", str(tmp_path / "one.toml"), "--policies", "idle,ppo", "--layouts", "2"]
    assert main([*command, "--steps", "2", "--workers", workers, "--out", str(tmp_path / "out")]) == 0
    warned = capfd.readouterr().err
    assert warned.count("the ground is steeper than its soil's repose") == 1, warned
    assert warned.count("can have obstacles, and policy ppo does not see them") == 1, warned
    assert "UserWarning" not in warned


@pytest.mark.slow
def test_two_workers_give_the_same_bytes(finished, tmp_path):
    assert main(["evaluate", *SMALL, "--workers", "2", "--out", str(tmp_path)]) == 0
    assert figures(tmp_path) == figures(finished)


@pytest.mark.slow
@pytest.mark.parametrize("workers", ["1", "2"])
def test_killed_at_any_time_it_goes_on_and_gives_the_same_bytes(finished, tmp_path, workers):
    command = [sys.executable, "-m", "dirt_env", "evaluate", *SMALL, "--workers", workers, "--out", str(tmp_path)]
    for least in (1, 5):
        running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        until = time.monotonic() + 120
        while running.poll() is None and time.monotonic() < until:
            if (tmp_path / EPISODES).exists() and (tmp_path / EPISODES).read_bytes().count(b"\n") >= least:
                break
            time.sleep(0.005)
        running.kill()
        running.wait()
        with open(tmp_path / EPISODES, "ab") as file:
            file.write(b'{"policy": "adap')
    (tmp_path / RESULT).unlink(missing_ok=True)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, timeout=120)
    assert figures(tmp_path) == figures(finished)


def stop_after(count):
    """A player that is interrupted after so many episodes."""

    def play(trials):
        for number, trial in enumerate(trials):
            if number == count:
                raise KeyboardInterrupt
            yield run_trial(trial)

    return play


def test_ctrl_c_says_what_is_kept_and_the_same_command_goes_on(finished, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(evaluation.pool, "run_here", stop_after(4))
    assert main(["evaluate", *SMALL, "--out", str(tmp_path)]) == 130
    captured = capsys.readouterr()
    assert captured.err == (
        f"dirt-push: interrupted: 4 of 18 episodes are kept in {tmp_path}; the same command goes on from there\n"
    )
    assert captured.out == ""
    played = []
    monkeypatch.setattr(evaluation.pool, "run_here", lambda trials: (played.append(t) or run_trial(t) for t in trials))
    assert main(["evaluate", *SMALL, "--out", str(tmp_path)]) == 0
    assert len(played) == 14
    assert figures(tmp_path) == figures(finished)


def test_other_settings_in_an_old_folder_are_refused(finished, tmp_path, capsys):
    before = figures(finished)
    other = [*SMALL[:-1], "41"]
    assert main(["evaluate", *other, "--out", str(finished)]) == 2
    assert "holds an evaluation with other tasks" in capsys.readouterr().err
    assert figures(finished) == before


def test_a_height_map_that_has_changed_is_refused(tmp_path, monkeypatch, capsys):
    rng = np.random.default_rng(0)
    (tmp_path / "site.toml").write_text(
        '[ground]\nkind = "file"\npath = "map.npy"\npixel = 0.5\n[task]\ntime = 2.0\n'
        '[[start]]\nregion = { kind = "circle", center = [9.0, 16.0], radius = 3.0 }\nvolume = 5.0\n'
        '[[goal]]\nregion = { kind = "circle", center = [21.0, 16.0], radius = 3.5 }\n'
    )
    (tmp_path / "suite.toml").write_text('[[job]]\nscene = "site.toml"\n')
    np.save(tmp_path / "map.npy", 0.01 * rng.normal(size=(64, 64)))
    monkeypatch.chdir(tmp_path)
    arguments = ["evaluate", "--policies", "idle", "--suite", "suite.toml", "--layouts", "1", "--out", "out"]
    assert main(arguments) == main(arguments) == 0
    capsys.readouterr()
    np.save(tmp_path / "map.npy", 0.01 * rng.normal(size=(64, 64)))
    assert main(arguments) == 2
    assert "out holds an evaluation with other files (files was {" in capsys.readouterr().err
    assert main([*arguments, "--fresh"]) == 0


def test_a_policy_that_fails_is_named_and_the_rest_is_kept(tmp_path, monkeypatch, capsys):
    (tmp_path / "fails_sometimes.py").write_text(
        "class Policy:\n"
        "    sees = 'nothing'\n"
        "    def __init__(self, config): pass\n"
        "    def reset(self, seed=None): self.seed = seed\n"
        "    def act(self, observation): return [0, 0, 1] if self.seed < 10001 else nothing\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    arguments = ["evaluate", "--policies", "fails_sometimes:Policy", "--layouts", "2", "--steps", "2", "--out", "out"]
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("dirt-push: error: policy fails_sometimes:Policy failed in heap 0, layout 10001: NameError")
    assert "2 of 4 episodes are kept in out" in error
    assert json.loads((tmp_path / "out" / SETTINGS).read_text())["policies"] == ["fails_sometimes:Policy"]
    (tmp_path / "fails_sometimes.py").write_text("# edited\n" + (tmp_path / "fails_sometimes.py").read_text())
    assert main(arguments) == 2
    assert "holds an evaluation with other code" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (["--policies", "idle,idle"], "each once"),
        (["--policies", ","], "one or more"),
        (["--policies", "best"], "policy is 'best'; known: adaptive_push, "),
        (["--suite", "fast"], f"suite is 'fast'; allowed: {', '.join(suite_names())}"),
        (["--split", "test"], "split is 'test'; allowed: training, selection, evaluation"),
        (["--layouts", "10001"], "layouts is 10001; allowed: 1 to 10000"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(change, complaint, tmp_path, capsys):
    assert main(["evaluate", *SMALL, *change, "--out", str(tmp_path / "new")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert complaint in error
    assert not (tmp_path / "new").exists()


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="needs POSIX signals")
def test_a_worker_that_is_killed_is_said_to_be_lost(tmp_path):
    (tmp_path / "dies.py").write_text(
        "import os\n"
        "class Policy:\n"
        "    sees = 'nothing'\n"
        "    def __init__(self, config): pass\n"
        "    def reset(self, seed=None): pass\n"
        "    def act(self, observation): os.kill(os.getpid(), 9)\n"
    )
    (tmp_path / "one.toml").write_text('[[job]]\nscene = "heap"\nlevels = [0]\n')  # so that one worker alone can die
    command = [sys.executable, "-m", "dirt_env", "evaluate", "--policies", "idle,dies:Policy", "--layouts", "1"]
    command += ["--steps", "2", "--workers", "2", "--suite", "one.toml", "--out", "out"]
    environment = {**os.environ, "PYTHONPATH": os.getcwd()}
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False, env=environment
    )
    assert done.returncode == 2
    assert f"a worker ended (status {-signal.SIGKILL}) in the episode of dies:Policy in heap 0" in done.stderr


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="needs POSIX signals")
def test_workers_end_when_the_one_that_gave_them_work_is_killed(tmp_path):
    """No process is left behind that would wait for ever."""
    code = (
        "from dirt_env.bench.evaluate.pool import _workers, _serve\n"
        "import os\n"
        "if __name__ == '__main__':\n"
        "    with _workers(2, _serve) as crew:\n"
        "        print(*[worker.pid for worker in crew.values()], flush=True)\n"
        "        os.kill(os.getpid(), 9)\n"
    )
    (tmp_path / "leave.py").write_text(code)
    environment = {**os.environ, "PYTHONPATH": os.getcwd()}
    done = subprocess.run(
        [sys.executable, tmp_path / "leave.py"], capture_output=True, text=True, check=False, env=environment
    )
    assert done.returncode == -9
    until = time.monotonic() + 60
    left = [int(pid) for pid in done.stdout.split()]
    assert len(left) == 2
    while left and time.monotonic() < until:
        left = [pid for pid in left if _is_running(pid)]
        time.sleep(0.05)
    assert not left


def _is_running(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{pid}/stat")
    return not (status.exists() and " Z " in status.read_text())  # a zombie is over


def test_the_pool_gives_every_trial_once():
    assert list(pool.run_here([])) == []
