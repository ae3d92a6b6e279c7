"""The plan, the rows that are kept, the report's columns and tables, and the document made from them."""

import json
from pathlib import Path

import pytest

from dirt_env.bench.accuracy import report
from dirt_env.bench.accuracy.catalogue import PROBLEMS
from dirt_env.bench.accuracy.ledger import NAME, Ledger, stamp
from dirt_env.bench.accuracy.measure import COLUMNS, measure
from dirt_env.bench.accuracy.methods import METHODS
from dirt_env.bench.accuracy.plan import BASE_CELLS, Item, plan
from dirt_env.bench.accuracy.plots import sweep_of
from dirt_env.bench.accuracy.studies import STUDIES
from dirt_env.bench.accuracy.targets import TARGETS, best, is_met

ROOT = Path(__file__).resolve().parents[3]
ASKED = {
    "problem", "method", "cells", "tolerance", "precision", "cpu_ms", "rel_l1", "roundness", "volume_error",
    "target_rel_l1", "target_ms",
}  # fmt: skip
MARK = {"commit": "abc", "machine": "one", "versions": {"python": "3"}, "sources": "1"}


def row_of(problem, method, **others):
    base = dict.fromkeys(COLUMNS) | {"problem": problem, "method": method, "cells": 64, "tolerance": 1e-3}
    return base | {"precision": "f4", "setting": "", "cpu_ms": 1.0, "rel_l1": 0.1, "volume_error": 0.0} | others


def test_the_full_set_sweeps_one_setting_at_a_time():
    items = plan(quick=False)
    assert len(items) == len(set(items))
    assert {item.problem for item in items} == {*PROBLEMS, *STUDIES}
    assert {item.method for item in items} >= set(METHODS)
    for item in items:
        if item.problem in PROBLEMS and PROBLEMS[item.problem].kind not in ("sweep", "flux"):
            moved = [item.cells != BASE_CELLS, item.tolerance not in (None, 1e-3), item.cap is not None]
            departs = sum([*moved, item.precision == "f8" and item.method != "paper"])
            loose = item.problem == "column-collapse" and item.tolerance in (1e-2, 3e-2)
            assert departs <= 1 or (departs == 2 and loose)
    own = [item for item in items if (item.problem, item.method) == ("column-collapse", "explicit")]
    for column, least in (("tolerance", 6), ("cap", 5), ("cells", 4), ("precision", 2)):
        assert len({getattr(item, column) for item in own}) >= least
    assert {item.cells for item in items if item.method == "default"} >= {32, 64, 128, 256, 512, 1024}


def test_a_part_of_it_can_be_named():
    assert {item.problem for item in plan(True, ["wedge"])} == {"wedge"}
    assert {(item.problem, item.method) for item in plan(False, ["wedge", "berm"], ["blade"])} == {("berm", "blade")}
    assert len(plan(True)) < len(plan(False)) / 5
    assert {item.method for item in plan(True, ["dump"], ["projection"])} == {"projection"}
    for problems, methods, words in (
        (["hill"], [], "--problem is 'hill'; allowed: linear-mode, "),
        ([], ["magic"], "--method is 'magic'; allowed: paper, "),
        (["berm"], ["paper"], "--method paper does nothing of --problem berm"),
    ):
        with pytest.raises(ValueError, match=words):
            plan(False, problems, methods)


def test_a_row_has_the_columns_asked_for():
    row = measure(Item("linear-mode", "neighbours-4", 64, None, None, "f8"))
    assert set(row) >= ASKED
    assert tuple(row) == COLUMNS
    assert row["repeats"] >= 7
    assert row["cpu_ms"] > 0
    assert 0 < row["rel_l1"] < 1e-13
    assert row["target_rel_l1"] == 1e-13
    assert row["roundness"] is None
    assert json.loads(json.dumps(row)) == row
    row = measure(Item("naive-rule", "wrap-around", 32, None, None, "f4", STUDIES["naive-rule"].rows[1][2]))
    assert 1 < row["value"] < 1000
    assert row["setting"].startswith("rate 0.5")
    assert measure(Item("naive-rule", "wrap-around", 32, None, None, "f4", "share"))["value"] > 0.1


def test_rows_are_kept_and_a_torn_line_is_not(tmp_path):
    items = [Item("wedge", "explicit", cells, 1e-3, None, "f4") for cells in (32, 64)]
    ledger = Ledger(tmp_path, MARK)
    for item in items:
        ledger.add(item, row_of(*item[:2], cells=item.cells))
    file = tmp_path / NAME
    whole = file.read_bytes()
    file.write_bytes(whole[:-9])
    again = Ledger(tmp_path, MARK)
    assert list(again.rows) == items[:1]
    assert again.aside is None
    again.add(items[1], row_of("wedge", "explicit"))
    assert file.read_bytes() == whole
    assert Ledger(tmp_path, MARK).rows == ledger.rows


@pytest.mark.parametrize("change", [{"commit": "def"}, {"machine": "two"}, {"sources": "2"}, {"versions": {}}])
def test_rows_of_another_version_are_put_aside(tmp_path, change):
    ledger = Ledger(tmp_path, MARK)
    ledger.add(Item("wedge", "explicit", 64, 1e-3, None, "f4"), row_of("wedge", "explicit"))
    before = (tmp_path / NAME).read_bytes()
    other = Ledger(tmp_path, MARK | change)
    assert other.rows == {}
    assert other.aside.read_bytes() == before
    third = Ledger(tmp_path, MARK)
    assert third.aside not in (None, other.aside)


def test_a_file_that_is_no_ledger_is_put_aside(tmp_path):
    (tmp_path / NAME).write_text("rows, once\n")
    assert Ledger(tmp_path, MARK).aside.read_text() == "rows, once\n"


def test_the_stamp_names_the_sources(tmp_path):
    mark = stamp()
    assert set(mark) == {"commit", "machine", "versions", "sources"}
    assert mark == stamp()


def test_targets_say_measured_and_target_and_what_is_missed():
    rows = [
        row_of("column-collapse", "default", rel_l1=0.004, cpu_ms=1.2, roundness=0.99),
        row_of("column-collapse", "super", rel_l1=0.003, cpu_ms=1.4, roundness=0.996),
        row_of("column-collapse", "paper", rel_l1=0.4, cpu_ms=0.1),
        row_of("berm-between", "blade", rel_l1=0.37),
    ]
    lines = {line[0]: line for line in report.targets(rows)}
    assert len(lines) == len(TARGETS) + 1
    assert lines["column collapse, 64 x 64"] == [
        "column collapse, 64 x 64", "default", "0.4 % / 0.5 %", "1.2 / 1.5", "met",
    ]  # fmt: skip
    assert lines["column collapse, 64 x 64 (stretch)"][4] == "**missed**"
    assert lines["roundness, 64 x 64"][1:3] == ["super", "0.996 / 0.995"]
    assert lines["1-D berm between cells"][2:] == ["37 % / 8 %", "-", "**missed**"]
    assert lines["linear mode, float64"][2] == "not measured"


def test_a_target_is_held_against_the_fastest_that_keeps_it():
    target = next(target for target in TARGETS if target.title == "column collapse, 64 x 64")
    rows = [row_of("column-collapse", "default", rel_l1=error, cpu_ms=ms) for error, ms in ((0.1, 0.1), (0.004, 2.0))]
    assert best(target, rows)["cpu_ms"] == 2.0
    assert not is_met(target, best(target, rows))
    assert is_met(target, rows[1] | {"cpu_ms": 1.5})
    assert best(target, []) is None
    assert best(target, [rows[1] | {"cap": 16}]) is None  # cut off


def test_the_comparison_takes_the_time_to_the_smallest_error_and_of_the_default_that_to_one_percent():
    rows = [
        row_of("column-collapse", "default", rel_l1=0.009, cpu_ms=0.5),
        row_of("column-collapse", "default", rel_l1=0.002, cpu_ms=0.9),
        row_of("column-collapse", "default", rel_l1=0.05, cpu_ms=0.1),
        row_of("column-collapse", "neighbours-8", rel_l1=0.044, cpu_ms=20.0, tolerance=1e-4),
        row_of("column-collapse", "neighbours-8", rel_l1=0.0445, cpu_ms=10.0),
        row_of("column-collapse", "neighbours-8", rel_l1=0.09, cpu_ms=1.0),
    ]
    assert report.collapse(rows)[1:] == [
        ["8 neighbours", "4.45 %", "10", "20"],
        ["default (settle)", "0.9 %", "0.5", "1"],
    ]
    assert report.collapse(rows[2:]) == []


def test_a_sweep_holds_the_other_settings_at_the_base():
    rows = [
        row_of("wedge", "explicit", cells=cells, tolerance=tolerance, cap=cap, precision=precision)
        for cells, tolerance, cap, precision in (
            (64, 1e-3, None, "f4"), (128, 1e-3, None, "f4"), (64, 1e-2, None, "f4"), (64, 1e-3, 16, "f4"),
            (64, 1e-3, None, "f8"),
        )
    ]  # fmt: skip
    assert [row["cells"] for row in sweep_of(rows, "cells")] == [64, 128]
    assert [row["tolerance"] for row in sweep_of(rows, "tolerance")] == [1e-3, 1e-2]
    assert [row["cap"] for row in sweep_of(rows, "cap")] == [16]
    assert sweep_of(rows, None) == rows[4:]
    cells = [row_of("wedge", "paper", tolerance=None, precision="f8", cells=32)]
    assert sweep_of(cells, "cells") == cells


def test_marks_that_are_wrong_are_refused():
    made = {"commit": "c", "machine": "m", "versions": {"python": "3"}, "rows": []}
    assert report.renewed("a <!-- accuracy:made-with -->x<!-- /accuracy --> b", made) == (
        "a <!-- accuracy:made-with -->\nCommit c; m; python 3.\n<!-- /accuracy --> b"
    )
    for text in ("<!-- accuracy:hill --><!-- /accuracy -->", "<!-- accuracy:targets -->"):
        with pytest.raises(ValueError, match="has no end or no block"):
            report.renewed(text, made)


def test_the_document_shows_what_the_committed_figures_say():
    """`dirt-push accuracy --renew-docs docs` wrote it, and nobody has changed it by hand since."""
    committed = json.loads((ROOT / "docs/figures/accuracy/accuracy.json").read_text())
    document = (ROOT / "docs/accuracy.md").read_text()
    assert report.renewed(document, committed) == document
    assert [set(row) for row in committed["rows"]] == [set(COLUMNS)] * len(committed["rows"])
    assert document.count("<!-- accuracy:") == len(report.blocks(committed))
    for name in PROBLEMS:
        picture = ROOT / "docs/figures/accuracy" / f"{name}.png"
        assert f"figures/accuracy/{name}.png" in document
        assert picture.stat().st_size < 150_000
