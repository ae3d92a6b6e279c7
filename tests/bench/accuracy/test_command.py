"""`dirt-push accuracy` from outside: the quick set, an interrupted run, bad names."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from dirt_env.bench.accuracy.ledger import NAME
from dirt_env.cli import main

pytest.importorskip("matplotlib")
TIMES = ("cpu_ms", "repeats")
SOME = ("--problem", "wedge", "--problem", "trench-narrow", "--problem", "trench-wide", "--method", "neighbours-4")


def command(out, *options):
    return [sys.executable, "-m", "dirt_env", "accuracy", "--out", str(out), *options]


def errors_of(out):
    rows = json.loads((out / "accuracy.json").read_text())["rows"]
    return [{name: value for name, value in row.items() if name not in TIMES} for row in rows]


def row(rows, problem, method, cells=64, **others):
    [found] = [
        row
        for row in rows
        if (row["problem"], row["method"], row["cells"]) == (problem, method, cells)
        and all(row[name] == value for name, value in ({"tolerance": 1e-3} | others).items())
    ]
    return found


@pytest.mark.slow
def test_the_quick_set_has_the_errors_it_should(tmp_path):
    done = subprocess.run(command(tmp_path, "--quick"), capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "accuracy.json").read_text())
    assert set(report) == {"commit", "machine", "versions", "rows"}
    rows = report["rows"]
    default = row(rows, "column-collapse", "default")
    assert default["rel_l1"] < 0.005
    assert default["roundness"] > 0.99
    assert default["volume_error"] == 0
    assert default["target_rel_l1"] == 0.005
    assert default["target_ms"] == 1.5
    assert 0.03 < row(rows, "column-collapse", "neighbours-8")["rel_l1"] < 0.06
    assert 0.15 < row(rows, "column-collapse", "neighbours-4")["rel_l1"] < 0.3
    assert 0.25 < row(rows, "column-collapse", "paper", tolerance=None)["rel_l1"] < 0.45
    assert row(rows, "linear-mode", "explicit", tolerance=None)["rel_l1"] < 1e-13
    coarse, fine = (row(rows, "manufactured", "explicit", cells, tolerance=None)["rel_l1"] for cells in (32, 64))
    assert 3.8 < coarse / fine < 4.2  # of order two
    assert row(rows, "dump", "water-filling", tolerance=None)["rel_l1"] < 0.002
    assert row(rows, "berm", "blade")["rel_l1"] < 0.003
    assert row(rows, "trench-narrow", "default")["rel_l1"] < 0.01
    assert "Column collapse, 64 x 64: time to the smallest error" in done.stdout
    assert (tmp_path / "column-collapse.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_run_that_is_killed_goes_on_to_the_same_rows(tmp_path):
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    process = subprocess.Popen(command(killed, *SOME), stdout=subprocess.DEVNULL)
    file = killed / NAME
    deadline = time.monotonic() + 120
    while not (file.exists() and file.read_bytes().count(b"\n") > 3) and time.monotonic() < deadline:
        time.sleep(0.005)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    kept = file.read_bytes()
    kept = kept[: kept.rfind(b"\n") + 1]
    assert not (killed / "accuracy.json").exists()
    for folder in (killed, whole):
        subprocess.run(command(folder, *SOME), check=True, stdout=subprocess.DEVNULL, timeout=300)
    assert file.read_bytes().startswith(kept)
    assert errors_of(killed) == errors_of(whole)
    assert len(errors_of(whole)) > 20
    first = json.loads(kept.splitlines()[1])
    assert first in json.loads((killed / "accuracy.json").read_text())["rows"]  # its time too


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--problem", "hill"], "--problem is 'hill'; allowed: linear-mode"),
        (["--method", "magic"], "--method is 'magic'; allowed: paper"),
        (["--problem", "berm", "--method", "paper"], "does nothing of --problem berm"),
        (["--quick", "--renew-docs", "docs"], "--renew-docs is given; allowed: with the full set"),
        (["--renew-docs", "nowhere"], "--renew-docs is nowhere; allowed: a folder with accuracy.md"),
    ],
)
def test_bad_options_are_one_line(tmp_path, capsys, options, words):
    assert main(["accuracy", "--out", str(tmp_path), *options]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert words in said.err
    assert said.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_plots_want_matplotlib(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("dirt_env.bench.accuracy.plots.find_spec", lambda name: None)
    assert main(["accuracy", "--out", str(tmp_path), "--quick"]) == 2
    assert 'pip install "dirt-push[bench]"' in capsys.readouterr().err


def test_an_interrupt_says_how_to_go_on(tmp_path, capsys, monkeypatch):
    calls = []

    def measure(item):
        if len(calls) == 2:
            raise KeyboardInterrupt
        calls.append(item)
        return {**item._asdict(), "cpu_ms": 1.0}

    monkeypatch.setattr("dirt_env.bench.accuracy.command.measure", measure)
    assert main(["accuracy", "--out", str(tmp_path), "--problem", "berm"]) == 130
    said = capsys.readouterr()
    assert f"interrupted after 2 of 10 rows, all kept in {tmp_path}; the same command goes on" in said.err
    assert len((tmp_path / NAME).read_text().splitlines()) == 3
    assert not (tmp_path / "accuracy.json").exists()
