"""What is built and installed: one name in site-packages, and the scenes and behaviours with it."""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("build")

ROOT = Path(__file__).resolve().parents[1]
PLACES = {name: f"dirt_env/{name}" for name in ("agents", "baselines", "configs")} | {"dirt_env": "dirt_env"}
LITTER = ("__pycache__", "*.pyc", ".*")

pytestmark = pytest.mark.slow


def run(*command: str | Path, cwd: Path) -> str:
    """Output of a command; fails with what it said."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """A copy of what is packaged, since building leaves things behind."""
    copy = tmp_path_factory.mktemp("sources")
    for name in PLACES:
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns(*LITTER))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    return copy


@pytest.fixture(scope="module")
def wheel(sources, tmp_path_factory):
    """The wheel, built from the source distribution."""
    place = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", place, sources, cwd=place)
    [wheel] = place.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def home(wheel, tmp_path_factory):
    """An empty environment with the wheel in it; the libraries it needs are those of this environment."""
    home = tmp_path_factory.mktemp("home")
    run(sys.executable, "-m", "venv", "--without-pip", home, cwd=home)
    python = program(home, "python")
    run(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", wheel, cwd=home)
    (packages(home) / "libraries.pth").write_text(sysconfig.get_path("purelib"))
    return home


def program(home: Path, name: str) -> Path:
    """A program of a virtual environment."""
    return home / ("Scripts" if sys.platform == "win32" else "bin") / name


def packages(home: Path) -> Path:
    """The site-packages of a virtual environment."""
    [place] = home.glob("[lL]ib/**/site-packages")
    return place


def test_the_wheel_holds_every_file_of_the_sources(sources, wheel):
    expected = {
        f"{place}/{path.relative_to(sources / name).as_posix()}"
        for name, place in PLACES.items()
        for path in (sources / name).rglob("*")
        if path.is_file() and ".egg-info" not in str(path)
    }
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {name for name in names if ".dist-info/" not in name} == expected


def test_site_packages_gets_one_name(home):
    names = {path.name.partition("-")[0] for path in packages(home).iterdir()}
    assert names - {"libraries.pth"} == {"dirt_env", "dirt_push"}


def test_a_behaviour_runs_from_the_wheel_in_any_folder(home, tmp_path):
    run(program(home, "dirt-push"), "run", "--policy", "idle", "--episodes", "1", "--out", "out", cwd=tmp_path)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert (summary["policy"], summary["scene"]) == ("idle", "heap")


def test_behaviours_are_found_inside_the_library(home, tmp_path):
    code = "import dirt_env.baselines.adaptive_push as module; print(module.__file__)"
    assert Path(run(program(home, "python"), "-c", code, cwd=tmp_path).strip()).is_relative_to(packages(home))


def test_the_module_is_the_same_command(home, tmp_path):
    command = run(program(home, "dirt-push"), "--help", cwd=tmp_path)
    assert run(program(home, "python"), "-m", "dirt_env", "--help", cwd=tmp_path) == command
