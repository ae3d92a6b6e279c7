"""The record of an evaluation: half a line is dropped, other settings are refused, one writer at a time."""

import json

import pytest

from dirt_env.bench.evaluate import journal
from dirt_env.bench.evaluate.journal import EPISODES, RESULT, SETTINGS, Journal

SAME = {"policies": ["idle"], "layouts": [1, 2]}


def test_what_was_added_is_there_again(tmp_path):
    with Journal(tmp_path / "new", SAME) as first:
        first.add({"layout": 1, "share": 0.1})
        first.add({"layout": 2, "share": 1 / 3})
    with Journal(tmp_path / "new", SAME) as second:
        assert second.records == [{"layout": 1, "share": 0.1}, {"layout": 2, "share": 1 / 3}]


@pytest.mark.parametrize("kept", range(0, 40, 3))
def test_a_kill_at_any_byte_loses_only_what_was_not_finished(tmp_path, kept):
    with Journal(tmp_path, SAME) as first:
        for layout in range(3):
            first.add({"layout": layout})
    written = (tmp_path / EPISODES).read_bytes()
    (tmp_path / EPISODES).write_bytes(written[:kept])
    with Journal(tmp_path, SAME) as second:
        assert second.records == [{"layout": n} for n in range(written[:kept].count(b"\n"))]
        second.add({"layout": 9})
    with Journal(tmp_path, SAME) as third:
        assert third.records[-1] == {"layout": 9}


def test_other_settings_are_refused_by_name_and_lose_nothing(tmp_path):
    with Journal(tmp_path, SAME) as first:
        first.add({"layout": 1})
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(ValueError, match=r"other layouts \(layouts was \[1, 2\], is \[1\]\).*--fresh"):
        Journal(tmp_path, {**SAME, "layouts": [1]})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_fresh_begins_anew(tmp_path):
    with Journal(tmp_path, SAME) as first:
        first.add({"layout": 1})
    (tmp_path / RESULT).write_text("old")
    (tmp_path / "mine.txt").write_text("kept")
    with Journal(tmp_path, {**SAME, "layouts": [1]}, fresh=True) as second:
        assert second.records == []
    assert {path.name for path in tmp_path.iterdir()} == {"mine.txt", SETTINGS, EPISODES}
    assert json.loads((tmp_path / SETTINGS).read_text())["layouts"] == [1]


def test_damage_is_named_with_its_line(tmp_path):
    with Journal(tmp_path, SAME) as first:
        first.add({"layout": 1})
    with open(tmp_path / EPISODES, "ab") as file:
        file.write(b"{]\n")
    with pytest.raises(ValueError, match=r"episodes.jsonl, line 2 is damaged"):
        Journal(tmp_path, SAME)
    (tmp_path / SETTINGS).unlink()
    with pytest.raises(ValueError, match=r"episodes without settings\.json"):
        Journal(tmp_path, SAME)


@pytest.mark.skipif(journal.fcntl is None, reason="no file locks here")
def test_only_one_at_a_time(tmp_path):
    with Journal(tmp_path, SAME), pytest.raises(ValueError, match="another evaluation is at work"):
        Journal(tmp_path, SAME)
    Journal(tmp_path, SAME).__exit__(None, None, None)
