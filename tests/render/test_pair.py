"""Two recordings on one page: the same layouts, or an error."""

import json
import re

import numpy as np
import pytest

from dirt_env.render.pair import write_pair
from dirt_env.render.replay import Recorder


def recorder(site, make_pose, goal=None):
    """One recorded moment, with the goal where it is or elsewhere."""
    result = Recorder("a title", "", site.cell, site.blade, site.machine)
    result.begin("one", start=site.start, goal=site.goal if goal is None else goal, target=site.target)
    result.add(site.height, make_pose(x=3, y=6), 0.0, {"share_in_goal": 0.0})
    return result


def test_both_sides_are_in_one_file_that_names_no_host(site, make_pose, tmp_path):
    write_pair(tmp_path / "a.html", "where", {"one": recorder(site, make_pose), "two": recorder(site, make_pose)})
    page = (tmp_path / "a.html").read_text("utf-8")
    data = json.loads(re.search(r'<script type="application/json" id="replay">(.*?)</script>', page, re.S)[1])
    assert (data["title"], data["description"]) == ("one and two", "where")
    assert [side["title"] for side in data["sides"]] == ["one", "two"]
    assert not re.search(r"(?:src|href)=.?(?:https?:)?//", page)
    assert "{{" not in page


def test_other_layouts_are_refused(site, make_pose, tmp_path):
    other = recorder(site, make_pose, np.roll(site.goal, 1, axis=0))
    with pytest.raises(ValueError, match="episode 1 is on another layout"):
        write_pair(tmp_path / "a.html", "", {"one": recorder(site, make_pose), "two": other})
    assert list(tmp_path.iterdir()) == []
