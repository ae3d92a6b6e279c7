"""`dirt-push`: what it prints, what it writes, and how it refuses."""

import json
import os
import re
import subprocess
import sys

import pytest

from dirt_env import __version__
from dirt_env.cli import main
from dirt_env.cli.run import read_settings
from dirt_env.config import load, scene_names
from dirt_env.config.presets import KEYS, PRESETS
from dirt_env.policy import load_policy, policy_names, trained_file

FIGURES = (
    "share_in_goal",
    "volume_moved_m3",
    "spilled_m3",
    "time_s",
    "m3_per_h",
    "work_kj",
    "energy_kj",
    "distance_m",
    "steps",
)
SHORT = ["--policy", "random", "--steps", "6"]


def refusal(arguments, capsys):
    """The one line on stderr for bad input."""
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("dirt-push: error: ")
    assert captured.err.count("\n") == 1
    return captured.err


def test_run_writes_figures_replay_and_animation(tmp_path, capsys):
    assert main(["run", *SHORT, "--episodes", "2", "--seed", "5", "--out", str(tmp_path / "new")]) == 0
    assert {path.name for path in (tmp_path / "new").iterdir()} == {"summary.json", "replay.html", "replay.gif"}
    summary = json.loads((tmp_path / "new" / "summary.json").read_text())
    assert (summary["policy"], summary["scene"], summary["seed"]) == ("random", "heap", 5)
    assert [episode["seed"] for episode in summary["episodes"]] == [5, 6]
    for figures in (*summary["episodes"], summary["mean"]):
        assert all(isinstance(figures[name], int | float) for name in FIGURES)
        assert figures["grade_error_m"] is None, "the scene has no design"
    assert summary["mean"]["steps"] == 6
    assert summary["mean"]["distance_m"] == pytest.approx(sum(e["distance_m"] for e in summary["episodes"]) / 2)
    captured = capsys.readouterr()
    assert captured.err == ""
    shown = re.search(r'"stat_names": *\[([^]]*)\]', (tmp_path / "new" / "replay.html").read_text("utf-8"))[1]
    assert "share_in_goal" in shown
    assert "grade_error_m" not in shown
    table = captured.out.splitlines()
    assert [line.split()[0] for line in table[1:5]] == ["episode", "1", "2", "mean"]


def test_two_policies_of_one_name_have_a_folder_each(tmp_path, monkeypatch):
    (tmp_path / "ppo.npz").write_bytes(trained_file("ppo").read_bytes())
    monkeypatch.chdir(tmp_path)
    arguments = ["run", "--policy", "ppo.npz,ppo", "--steps", "2", "--no-replay", "--level", "0"]
    assert main(arguments) == 0
    [out] = (tmp_path / "runs").iterdir()
    wrote = {path.parent.name: json.loads(path.read_text())["policy"] for path in out.rglob("summary.json")}
    assert wrote == {"ppo": "ppo.npz", "ppo-2": "ppo"}


def test_two_policies_are_written_side_by_side(tmp_path, capsys):
    arguments = ["run", "--policy", "random,idle", "--steps", "4", "--seed", "5", "--out", str(tmp_path)]
    assert main(arguments) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"random", "idle", "side_by_side.html"}
    summaries = [json.loads((tmp_path / name / "summary.json").read_text()) for name in ("random", "idle")]
    assert [summary["policy"] for summary in summaries] == ["random", "idle"]
    assert {summary["episodes"][0]["seed"] for summary in summaries} == {5}
    assert capsys.readouterr().out.splitlines()[-1] == f"wrote {tmp_path / 'side_by_side.html'}"
    assert main([*arguments, "--no-replay"]) == 0
    assert not (tmp_path / "side_by_side.html").exists(), "an old page never lies beside other figures"


@pytest.mark.parametrize("policies", ["idle,idle", "idle,random,adaptive_push"])
def test_more_than_two_or_the_same_twice_are_refused(policies, tmp_path, capsys):
    assert "two different ones" in refusal(["run", "--policy", policies, "--out", str(tmp_path / "new")], capsys)
    assert not (tmp_path / "new").exists()


def test_the_same_seed_writes_the_same_summary(tmp_path):
    for name in ("a", "b"):
        assert main(["run", *SHORT, "--no-replay", "--out", str(tmp_path / name)]) == 0
    assert (tmp_path / "a" / "summary.json").read_bytes() == (tmp_path / "b" / "summary.json").read_bytes()


def test_options_reach_the_scene(tmp_path):
    changes = ["--level", "0", "--set", "soil.repose=30", "--set", "site.border=open", "--set", "site.size=[28, 28]"]
    assert main(["run", *SHORT, *changes, "--no-replay", "--out", str(tmp_path)]) == 0
    config = json.loads((tmp_path / "summary.json").read_text())["config"]
    assert config["soil"]["repose"] == 30.0
    assert config["site"]["border"] == "open"
    assert config["site"]["size"] == [28.0, 28.0]
    assert config["layout"]["level"] == 0


def test_without_steps_an_episode_lasts_the_nominal_time(tmp_path):
    arguments = ["run", "--policy", "idle", "--set", "task.time=10", "--no-replay", "--out", str(tmp_path)]
    assert main(arguments) == 0
    assert json.loads((tmp_path / "summary.json").read_text())["mean"]["time_s"] == 10.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--scene", "haep"], "heap"),
        (["--scene", "missing.toml"], "missing.toml"),
        (["--policy", "clever"], "policy is 'clever'; known: "),
        (["--set", "soil.repos=3"], "repose"),
        (["--set", "site.cell=0"], "site.cell is 0"),
        (["--set", "site.cell"], "KEY=VALUE"),
        (["--set", "scene=dig"], "--set is 'scene=dig'; allowed: keys of the scene only; --scene chooses another"),
        (["--set", "render_mode=human"], "--set is 'render_mode=human'; allowed: keys of the scene only"),
        (["--set", "self=1"], "--set is 'self=1'; allowed: keys of the scene only"),
        (["--set", "blade.width=0.6"], "blade.width is 0.6"),
        (["--level", "17"], "17"),
    ],
)
def test_bad_input_is_one_clear_line(arguments, words, tmp_path, capsys):
    line = refusal(["run", *SHORT, *arguments, "--out", str(tmp_path / "out")], capsys)
    assert words in line
    assert not (tmp_path / "out").exists()


def test_without_out_the_folder_is_named_after_scene_and_policy(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", *SHORT, "--scene", "posts", "--no-replay"]) == 0
    assert main(["run", *SHORT, "--scene", "posts", "--level", "2", "--no-replay"]) == 0
    assert {path.name for path in (tmp_path / "runs").iterdir()} == {"posts-random", "posts-2-random"}


def test_out_has_to_be_a_folder(tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    for out in ("file", "file/below"):
        assert f"--out is {tmp_path / out}" in refusal(["run", *SHORT, "--out", str(tmp_path / out)], capsys)
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="needs a folder that nobody can write to")
def test_an_out_that_cannot_be_written_to_is_said_before_the_run(capsys, monkeypatch):
    monkeypatch.setattr("dirt_env.run.Run.play", lambda *_: pytest.fail("it was played"))
    for out in ("/proc/self", "/proc/new"):
        line = refusal(["run", *SHORT, "--out", out], capsys)
        assert f"--out is {out}: " in line
        assert "allowed: a folder that can be written to" in line


def test_no_replay_of_an_earlier_run_stays_beside_the_new_figures(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    for name in ("replay.html", "replay.gif"):
        (tmp_path / name).write_text("of another run")
    assert main(["run", *SHORT, "--no-replay", "--out", str(tmp_path)]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"summary.json", "mine.txt"}


def test_a_job_that_is_done_reads_as_success(tmp_path, capsys):
    """A pad within a wide tolerance is done, though next to no soil was moved."""
    for tolerance, reached, total in (("9", "yes", "1"), ("0.0001", "no", "0")):
        arguments = ["--scene", "pad", "--set", f"design.tolerance={tolerance}", "--no-replay", "--out", str(tmp_path)]
        assert main(["run", *SHORT, *arguments]) == 0
        _, titles, first, mean, *_ = (line.split() for line in capsys.readouterr().out.splitlines())
        assert (titles[1], first[1], mean[1:4]) == ("done", reached, [total, "of", "1"])
        summary = json.loads((tmp_path / "summary.json").read_text())
        assert summary["episodes"][0]["is_success"] is (reached == "yes")
        assert summary["mean"]["grade_error_m"] > 0.0
        assert summary["mean"]["success"] == float(total)


def test_missing_pillow_is_said_before_the_run(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("dirt_env.run.find_spec", lambda name: None)
    assert "pillow" in refusal(["run", *SHORT, "--out", str(tmp_path)], capsys)
    assert main(["run", *SHORT, "--no-replay", "--out", str(tmp_path)]) == 0


@pytest.mark.parametrize("number", ["0", "-3", "many", "1.5"])
def test_numbers_are_whole_and_positive(number, tmp_path, capsys):
    with pytest.raises(SystemExit) as caught:
        main(["run", "--episodes", number, "--out", str(tmp_path)])
    assert caught.value.code == 2
    assert f"is '{number}'; allowed: whole numbers >= 1" in capsys.readouterr().err


def test_scenes_and_policies_are_listed(capsys):
    assert main(["scenes"]) == 0
    scenes = capsys.readouterr().out.splitlines()
    assert main(["policies"]) == 0
    policies = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in scenes] == list(scene_names())
    assert [line.split()[0] for line in policies] == list(policy_names())
    assert all(len(line.split()) > 3 for line in scenes + policies)


def test_soils_are_listed_with_their_numbers(capsys):
    assert main(["soils"]) == 0
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.split() == list(KEYS)
    assert [row.split()[0] for row in rows] == list(PRESETS)
    assert [float(number) for number in rows[0].split()[1:]] == list(PRESETS["dry_sand"].values())


def test_the_version(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out == f"dirt-push {__version__}\n"


def test_settings_are_nested_and_typed():
    settings = ["a.b=1", "a.c=[1.5, 2]", "d=true", 'e="x y"', "f=word", "a.g={kind = 'flat'}"]
    nested = {"a": {"b": 1, "c": [1.5, 2], "g": {"kind": "flat"}}, "d": True, "e": "x y", "f": "word"}
    assert read_settings(settings) == nested


@pytest.mark.parametrize("setting", ["", "=1", "a..b=1", "a"])
def test_settings_have_a_key_and_a_value(setting):
    with pytest.raises(ValueError, match="allowed: KEY=VALUE"):
        read_settings([setting])


def test_a_value_is_no_table():
    with pytest.raises(ValueError, match="a is a value already"):
        read_settings(["a=1", "a.b=2"])


def command(*arguments):
    return [sys.executable, "-m", "dirt_env", *arguments]


def interrupt_after(steps, monkeypatch):
    """Ctrl-C after so many control steps."""
    kind = type(load_policy("random", load()))
    act, calls = kind.act, []

    def interrupted(self, observation):
        calls.append(self)
        if len(calls) > steps:
            raise KeyboardInterrupt
        return act(self, observation)

    monkeypatch.setattr(kind, "act", interrupted)


def test_an_interrupted_run_keeps_what_is_finished(tmp_path, capsys, monkeypatch):
    """Ctrl-C in the third episode: status 130, figures and replay of two episodes."""
    interrupt_after(2 * 6 + 3, monkeypatch)
    assert main(["run", *SHORT, "--episodes", "100", "--out", str(tmp_path)]) == 130
    captured = capsys.readouterr()
    assert captured.err == "dirt-push: interrupted after 2 of 100 episodes\n"
    assert "mean" in captured.out
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["interrupted"], summary["episodes_wanted"], len(summary["episodes"])) == (True, 100, 2)
    assert replayed(tmp_path / "replay.html") == [("episode 1 of 100", 7), ("episode 2 of 100", 7)]
    assert {path.name for path in tmp_path.iterdir()} == {"summary.json", "replay.html", "replay.gif"}


def replayed(page):
    """Label and number of moments of every episode in a replay."""
    data = re.search(r'<script type="application/json" id="replay">(.*?)</script>', page.read_text("utf-8"), re.S)[1]
    return [(episode["label"], episode["frames"]) for episode in json.loads(data)["episodes"]]


def test_an_interruption_before_the_first_episode_is_finished_is_said(tmp_path, capsys, monkeypatch):
    interrupt_after(3, monkeypatch)
    assert main(["run", *SHORT, "--episodes", "2", "--out", str(tmp_path)]) == 130
    captured = capsys.readouterr()
    said = "dirt-push: interrupted before the first episode was finished: nothing written\n"
    assert (captured.out, captured.err) == ("", said)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs a shell")
def test_a_run_is_kept_though_nobody_reads_what_it_says(tmp_path):
    """`dirt-push run | true`: the reader is gone before the first line."""
    reader, writer = os.pipe()
    os.close(reader)
    arguments = command("run", *SHORT, "--no-replay", "--out", str(tmp_path))
    done = subprocess.run(arguments, stdout=writer, stderr=subprocess.PIPE, text=True, timeout=300, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "summary.json").is_file()


@pytest.mark.slow
def test_a_run_is_kept_though_the_name_of_the_scene_cannot_be_shown(tmp_path):
    arguments = command("run", *SHORT, "--set", "name=gr\u00fcn", "--out", str(tmp_path / "out"))
    surroundings = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(arguments, env=surroundings, capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "random in gr?n, " in done.stdout
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"summary.json", "replay.html", "replay.gif"}


@pytest.mark.slow
def test_a_reader_that_stops_early_is_no_error():
    script = f"{sys.executable} -m dirt_env policies | head -n 1 >/dev/null; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_a_terminal_gets_a_progress_bar(tmp_path):
    leader, follower = os.openpty()
    arguments = command("run", *SHORT, "--no-replay", "--out", str(tmp_path))
    subprocess.run(arguments, stderr=follower, stdout=subprocess.DEVNULL, timeout=300, check=True)
    os.close(follower)
    shown = os.read(leader, 100_000).decode()
    os.close(leader)
    assert "episode 1 of 1" in shown
    assert "#" in shown
