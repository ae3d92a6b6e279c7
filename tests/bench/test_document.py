"""How reports are written."""

import json

from dirt_env.bench.document import aligned, as_json, markdown


def test_the_report_is_json_with_a_row_a_line():
    made = {"commit": "c", "machine": "m", "versions": {}, "rows": [{"problem": "wedge", "value": None}] * 3}
    text = as_json(made)
    assert json.loads(text) == made
    assert sum('"wedge"' in line for line in text.splitlines()) == 3


def test_a_table_is_as_wide_as_its_longest_cells_and_may_be_markdown():
    lines = [["case", "s"], ["a", "0.25"]]
    assert aligned(lines) == "case     s\n   a  0.25"
    assert markdown(lines) == "| case | s |\n| --- | --- |\n| a | 0.25 |"
