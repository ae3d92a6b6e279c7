"""How reports are written."""

import json

import pytest

from dirt_env.bench.document import aligned, as_json, markdown, renewed


def test_the_report_is_json_with_a_row_a_line():
    made = {"commit": "c", "machine": "m", "versions": {}, "rows": [{"problem": "wedge", "value": None}] * 3}
    text = as_json(made)
    assert json.loads(text) == made
    assert sum('"wedge"' in line for line in text.splitlines()) == 3


def test_a_table_is_as_wide_as_its_longest_cells_and_may_be_markdown():
    lines = [["case", "s"], ["a", "0.25"]]
    assert aligned(lines) == "case     s\n   a  0.25"
    assert markdown(lines) == "| case | s |\n| --- | --- |\n| a | 0.25 |"


def test_a_bar_in_a_cell_does_not_end_it():
    assert markdown([["|h|"], ["a"]]).splitlines()[0] == "| \\|h\\| |"


def test_only_what_stands_between_marks_is_renewed():
    text = "a\n<!-- speed:x -->old<!-- /speed -->\nb <!-- speed:y --><!-- /speed --> c"
    once = renewed(text, "speed", {"x": "1", "y": "2"})
    assert once == "a\n<!-- speed:x -->\n1\n<!-- /speed -->\nb <!-- speed:y -->\n2\n<!-- /speed --> c"
    assert renewed(once, "speed", {"x": "1", "y": "2"}) == once
    for wrong in ("<!-- speed:z --><!-- /speed -->", "<!-- speed:x -->", "nothing"):
        with pytest.raises(ValueError, match="speed:"):
            renewed(wrong, "speed", {"x": "1", "y": "2"})
