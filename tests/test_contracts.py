"""The layers hold, and a wrong import or a file without a place breaks them."""

import ast
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

pytest.importorskip("importlinter")

ROOT = Path(__file__).resolve().parents[1]
LINT = "from importlinter.cli import lint_imports_command; lint_imports_command()"
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
PACKAGES = [name for name in ("dirt_env", "baselines", "agents") if any((ROOT / name).glob("*.py"))]


def check(tree: Path) -> tuple[bool, str]:
    """Whether the contracts of a source tree are kept, and what import-linter says."""
    command = [sys.executable, "-c", LINT, "--no-cache", "--no-logo"]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True, timeout=120, check=False)
    return done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def tree(tmp_path):
    """A copy of the sources, to plant something in."""
    for name in PACKAGES:
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def test_the_contracts_are_kept():
    kept, report = check(ROOT)
    assert kept, report


@pytest.mark.parametrize(
    ("file", "line", "contract"),
    [
        ("dirt_env/sim/laws.py", "import gymnasium", "know no framework and no pictures"),
        ("dirt_env/config/scene.py", "import matplotlib.pyplot", "know no framework and no pictures"),
        ("dirt_env/task/goal.py", "import numba", "Only sim/jit.py, intrinsics.py and lanes.py import numba"),
        ("dirt_env/sim/laws.py", "from dirt_env.config import load", "Layers of the library"),
        ("dirt_env/scene/layout.py", "from dirt_env.task.goal import Remaining", "Layers of the library"),
        ("dirt_env/config/scene.py", "import dirt_env.env", "Layers of the library"),
        ("dirt_env/sim/laws.py", "from dirt_env.sim.advance import advance", "Layers of the physics"),
        ("dirt_env/task/haul.py", "from dirt_env.task.job import Job", "Layers of the task"),
        ("dirt_env/policy.py", "from baselines import idle", "The library knows no behaviours"),
        ("baselines/idle.py", "import torch", "Nothing but the agents learns"),
        ("baselines/idle.py", "from agents import vec_env", "The library knows no behaviours"),
        ("dirt_env/env.py", "import stable_baselines3", "Nothing but the agents learns"),
        ("agents/afterthought.py", "", "Layers of the agents"),
        ("dirt_env/afterthought.py", "", "Layers of the library"),
        ("dirt_env/sim/afterthought.py", "", "Layers of the physics"),
    ],
)
def test_a_planted_line_breaks_its_contract(tree, file, line, contract):
    with open(tree / file, "a") as source:
        source.write(f"\n{line}\n")
    kept, report = check(tree)
    assert not kept
    assert any(contract in text and "BROKEN" in text for text in report.splitlines()), report


def test_every_package_is_under_contract():
    assert SETTINGS["root_packages"] == PACKAGES


def test_behaviours_have_one_name():
    """Nobody imports `baselines` by its place in the checkout; installed, it is `dirt_env.baselines`."""
    for path in [path for name in PACKAGES for path in (ROOT / name).rglob("*.py")]:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                assert not any(name.name.split(".")[0] == "baselines" for name in node.names), path
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                assert node.module.split(".")[0] != "baselines", path
