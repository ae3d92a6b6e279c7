"""The tables of docs/jobs.md from an evaluation."""

from pathlib import Path

import pytest

from dirt_env.bench.evaluate.document import check_document, renew_document
from dirt_env.bench.evaluate.suite import load_suite
from dirt_env.cli import main

ROOT = Path(__file__).resolve().parents[3]
FIGURE = {"iqm": 0.951, "low": 0.94, "high": 0.962, "mean": 0.75, "n": 4}
PAGE = "# Mine\n" + "".join(
    f"<!-- evaluate-goals:{block} -->old<!-- /evaluate-goals -->\n" for block in ("table", "score")
)


def result(suite):
    """An evaluation of that suite with the same figures everywhere."""
    metrics = dict.fromkeys(("success", "share_end", "grade_error_m", "time_s", "score"), FIGURE)
    return {
        "layouts": [10000, 10001],
        "policies": [{"name": "one"}, {"name": "two"}],
        "results": [
            {"job": task.job, "level": task.level, "policy": name, "metrics": metrics}
            for task in suite.tasks
            for name in ("one", "two")
        ],
        "overall": [{"policy": name, "metrics": metrics} for name in ("one", "two")],
        "pairs": [{"first": "one", "second": "two", "probability": {"value": 0.7, "low": 0.6, "high": 0.8}}],
    }


def test_what_is_marked_is_made_anew_and_the_rest_stays(tmp_path):
    (tmp_path / "jobs.md").write_text(PAGE)
    suite = load_suite("goals")
    renew_document(tmp_path, suite, result(suite))
    text = (tmp_path / "jobs.md").read_text()
    assert text.startswith("# Mine\n")
    assert "old" not in text
    rows = [line for line in text.splitlines() if line.startswith("| dig")]
    assert [row.split(" | ")[1] for row in rows] == ["0", "1, varied", "2"]
    assert "| 3 of 4; 95.1% [94.0%, 96.2%]; 1 s |" in rows[0]


def test_surfaces_are_judged_by_their_error(tmp_path):
    (tmp_path / "jobs.md").write_text("<!-- evaluate-surfaces:table --><!-- /evaluate-surfaces -->")
    suite = load_suite("surfaces")
    renew_document(tmp_path, suite, result(suite))
    [row] = [line for line in (tmp_path / "jobs.md").read_text().splitlines() if line.startswith("| berm | 2")]
    assert "0.16 m | 900 | 3 of 4; 0.951 m [0.940, 0.962]; 1 s" in row


def test_the_page_of_this_project_has_a_place_for_both_suites():
    for suite in ("goals", "surfaces"):
        check_document(ROOT / "docs", suite)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--suite", "goals", "--renew-docs", "."], "--renew-docs is .; allowed: a folder with jobs.md"),
        (["--steps", "5", "--renew-docs", "."], "--renew-docs is given; allowed: without --steps"),
        (["--suite", "quick", "--renew-docs", str(ROOT / "docs")], "has no table of the suite quick"),
    ],
)
def test_what_cannot_be_renewed_is_refused_before_anything_is_played(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["evaluate", "--policies", "idle", *arguments]) == 2
    assert message in capsys.readouterr().err
