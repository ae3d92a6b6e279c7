"""`dirt-push stability`: the cases pass, the report says so, what fails or hangs is named."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from dirt_env.bench.stability import registry, report
from dirt_env.bench.stability.registry import Case, all_cases
from dirt_env.bench.stability.watchdog import Row, Watchdog
from dirt_env.cli import main
from tests.bench import broken_cases

ROOT = Path(__file__).resolve().parents[2]
FEW = ["rate-025-holds", "rate-026-diverges", "grid-2x2"]
KEYS = {"commit", "machine", "versions", "quick", "limit_s", "rows"}


def broken(name, limit=30.0):
    return Case(name, "broken", "what is right", getattr(broken_cases, name), limit)


def picked(*names):
    return [part for name in names for part in ("--case", name)]


@pytest.mark.slow
def test_the_quick_set_passes(tmp_path):
    command = [sys.executable, "-m", "dirt_env", "stability", "--quick", "--out", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=1500, check=False)
    found = json.loads((tmp_path / "stability.json").read_text())
    assert set(found) == KEYS
    assert [row["case"] for row in found["rows"]] == list(all_cases())
    assert len(found["rows"]) >= 50
    assert [(row["case"], row["measured"]) for row in found["rows"] if not row["ok"]] == []
    assert done.returncode == 0, done.stdout + done.stderr
    assert found["limit_s"] == max(row["limit_s"] for row in found["rows"])


def test_some_cases_are_picked_and_reported(tmp_path, capsys):
    assert main(["stability", *picked(*FEW), "--out", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "stability.json").read_text())
    assert set(found) == KEYS
    assert {"python", "numba", "numpy"} <= set(found["versions"])
    assert [row["case"] for row in found["rows"]] == FEW
    for row in found["rows"]:
        assert set(row) == set(Row._fields)
        assert row["ok"] is True
        assert 0 <= row["cpu_s"] <= row["limit_s"]
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines[:3]] == [["pass", name] for name in FEW]
    assert re.match(r"3 of 3 cases pass; [\d.]+ s of processor time", lines[3])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("fails", "2 of 3"),
        ("raises", "ArithmeticError: the volume is not what it was"),
        ("dies", r"its process died \(exit status 9\)"),
    ],
)
def test_a_case_that_fails_gives_status_1_and_the_others_go_on(name, said, tmp_path, monkeypatch, capsys):
    all_cases()
    monkeypatch.setitem(registry.CASES, name, broken(name))
    assert main(["stability", *picked(name, "rate-025-holds"), "--out", str(tmp_path)]) == 1
    rows = json.loads((tmp_path / "stability.json").read_text())["rows"]
    assert [row["ok"] for row in rows] == [False, True]
    assert re.search(said, rows[0]["measured"])
    out = capsys.readouterr().out
    assert re.search(rf"FAIL +{name} ", out)
    assert "1 of 2 cases pass" in out


def test_a_case_that_hangs_is_ended_and_named():
    with Watchdog() as watchdog:
        row = watchdog.run(broken("hangs", limit=0.5))
        assert (row.case, row.ok, row.measured) == ("hangs", False, "hung: no end within 0.5 s")
        assert watchdog.run(broken("passes")).ok


def test_an_unknown_case_is_one_line(capsys):
    assert main(["stability", "--case", "grid-2x3"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert said.startswith("dirt-push: error: --case is 'grid-2x3' (did you mean grid-2x2?); allowed: ")


def test_the_table_in_a_document_is_renewed_by_all_cases_only(tmp_path, capsys):
    doc = tmp_path / "stability.md"
    assert main(["stability", "--renew-docs", str(tmp_path)]) == 2
    assert "allowed: a folder with stability.md" in capsys.readouterr().err
    doc.write_text("before\n<!-- stability:cases -->\nold\n<!-- /stability -->\nafter\n")
    assert main(["stability", "--quick", "--renew-docs", str(tmp_path)]) == 2
    assert "allowed: with all cases" in capsys.readouterr().err
    row = Row("a-case", "theme", "right", "wrong", False, 0.5, 3.0)
    report.renew(doc, [row])
    text = doc.read_text()
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "old" not in text
    assert "| a-case | right | wrong | **fails** | 0.5 |" in text
    doc.write_text("nothing")
    with pytest.raises(ValueError, match="no place for what is new"):
        report.renew(doc, [row])


def test_the_document_has_every_case():
    text = (ROOT / "docs" / "stability.md").read_text()
    listed = re.findall(r"^\| ([a-z0-9-]+) \| .* \| (pass|\*\*fails\*\*) \|", text, re.MULTILINE)
    assert [name for name, _ in listed] == list(all_cases())


def test_every_case_says_what_is_right_and_has_a_bounded_time():
    for case in all_cases().values():
        assert len(case.expected) > 8
        assert 0 < case.limit <= 3600.0
        assert case.theme in registry.THEMES
