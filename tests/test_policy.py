"""Policies by name: scripted ones, and anybody's own as module:attribute, from the current folder too."""

import json
import re
import sys
from pathlib import Path
from typing import ClassVar

import pytest

from dirt_env.cli import main
from dirt_env.config import load
from dirt_env.policy import load_policy, overrides_for, policy_file

MINE = """
import numpy as np

class MyPush:
    sees = "patch"
    def __init__(self, config): self.turn = config.machine.yaw_rate
    def reset(self, seed=None): self.seed = seed
    def act(self, observation): return np.array([0.1, 1.0, 0.0], np.float32)

def make(config): return MyPush(config)

class Bare:
    def __init__(self, config): pass

class Blind(MyPush):
    sees = "stars"

class Odd(MyPush):
    observation = "large"

class NoConfig(MyPush):
    def __init__(self): pass

class Raises(MyPush):
    def __init__(self, config): self.x = config.nothing

number = 3
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder outside the library, with rules in it."""
    (tmp_path / "rules_of_mine.py").write_text(MINE)
    (tmp_path / "half.py").write_text("def make(config:\n")
    (tmp_path / "wants.py").write_text("import not_installed_anywhere\n")
    (tmp_path / "breaks_at_once.py").write_text("x = 1 / 0\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    yield tmp_path
    for path in tmp_path.glob("*.py"):
        sys.modules.pop(path.stem, None)


@pytest.mark.parametrize("name", ["rules_of_mine:MyPush", "rules_of_mine:make"])
def test_a_class_or_function_in_the_current_folder(name, folder):
    policy = load_policy(name, load())
    assert policy.turn == load().machine.yaw_rate
    assert policy_file(name) == folder / "rules_of_mine.py"
    assert policy_file("idle") is None


@pytest.mark.parametrize(
    ("name", "error", "complaint"),
    [
        ("mine", ValueError, "policy is 'mine'; known: adaptive_push, .*or your own as module:attribute"),
        ("no_such_file:MyPush", ImportError, "no module 'no_such_file', neither installed nor in "),
        ("rules_of_mine:YourPush", ValueError, "has no 'YourPush'; it has: MyPush, make"),
        ("rules_of_mine:number", ValueError, "is a int; allowed: module:attribute"),
        ("rules_of_mine:Bare", ValueError, r"gives a Bare without reset and act; allowed: reset\(seed\)"),
        ("rules_of_mine:Blind", ValueError, "its `sees` is 'stars'; allowed: 'map', 'patch', 'nothing'"),
        ("rules_of_mine:Odd", ValueError, "its `observation` is 'large'; allowed: a mapping of keys"),
        ("rules_of_mine:NoConfig", ValueError, "cannot be called with a config"),
        ("rules_of_mine:Raises", ValueError, r"cannot be made: AttributeError.*rules_of_mine.py, line"),
        ("rules_of_mine:", ValueError, "allowed: module:attribute"),
        ("rules-of-mine:MyPush", ValueError, "allowed: module:attribute"),
        ("rules_of_mine.py:MyPush", ValueError, "allowed: without .py, as in rules_of_mine:MyPush"),
        ("half:make", ImportError, "SyntaxError.*half.py, line 1"),
        ("wants:make", ImportError, "policy wants:make: No module named 'not_installed_anywhere'"),
        ("breaks_at_once:make", ImportError, r"ZeroDivisionError: division by zero \(breaks_at_once.py, line 1\)"),
    ],
)
def test_what_is_wrong_is_said(name, error, complaint):
    with pytest.raises(error, match=complaint):
        load_policy(name, load())


def test_run_takes_it_and_writes_where_colons_are_not_allowed(folder, capsys):
    assert main(["run", "--policy", "rules_of_mine:MyPush", "--steps", "4", "--no-replay"]) == 0
    summary = json.loads((folder / "runs" / "heap-rules_of_mine-MyPush" / "summary.json").read_text())
    assert (summary["policy"], summary["sees"]) == ("rules_of_mine:MyPush", "patch")
    assert summary["mean"]["distance_m"] > 0.0


def test_evaluate_takes_it_in_other_processes_too(folder, capsys):
    options = ["--policies", "rules_of_mine:MyPush,idle", "--layouts", "1", "--steps", "6", "--workers", "2"]
    assert main(["evaluate", *options, "--out", "out"]) == 0
    result = json.loads((folder / "out" / "evaluation.json").read_text())
    assert result["policies"][0] == {"name": "rules_of_mine:MyPush", "sees": "patch"}
    assert result["overall"][0]["metrics"]["distance_m"]["iqm"] > 0.0


def test_the_rules_in_the_readme_do_what_it_says(folder, capsys):
    readme = (Path(__file__).resolve().parents[1] / "README.md").read_text()
    [rules] = re.findall(r"```python\n(import numpy as np\n\n\nclass MyPush.*?)```", readme, re.S)
    (folder / "my_rules.py").write_text(rules)
    suite = folder / "easy.toml"
    suite.write_text('[[job]]\nscene = "heap"\nlevels = [0]\n')
    options = ["--policies", "my_rules:MyPush,idle", "--layouts", "3", "--suite", str(suite), "--out", "out"]
    assert main(["evaluate", *options]) == 0
    result = json.loads((folder / "out" / "evaluation.json").read_text())
    assert 0.5 < result["overall"][0]["metrics"]["share_end"]["iqm"] < 0.7
    assert len([line for line in rules.splitlines() if line.strip()]) <= 20


class Particular:
    """A policy that needs an environment of its own."""

    sees = "patch"
    observation: ClassVar = {"size": 8}
    action: ClassVar = {"blade": "grade"}


def test_what_a_policy_needs_is_laid_over_the_scene_and_never_against_what_was_asked_for():
    given = {"level": 2, "observation": {"overview": True}, "action": {"blade": "grade"}}
    assert overrides_for("it", Particular(), given) == {
        "level": 2,
        "observation": {"overview": True, "size": 8},
        "action": {"blade": "grade"},
    }
    with pytest.raises(ValueError, match=r"observation.size is 20; allowed with policy it, which needs it: 8"):
        overrides_for("it", Particular(), {"observation": {"size": 20}})
