"""Suites: what is shipped is whole, and bad files are refused by name."""

import numpy as np
import pytest

from dirt_env.bench.evaluate.suite import Task, load_suite, suite_names
from dirt_env.config import layout, scene_names

PAPER = {"several_starts", "several_goals", "uneven", "posts", "dig"}


@pytest.fixture
def written(tmp_path):
    """A suite file of that text."""

    def write(text):
        (tmp_path / "mine.toml").write_text(text)
        return tmp_path / "mine.toml"

    return write


@pytest.mark.parametrize("name", suite_names())
def test_every_shipped_suite_can_be_played_and_says_what_it_is(name):
    suite = load_suite(name)
    assert suite.description
    assert suite.tasks


@pytest.mark.parametrize("name", suite_names())
def test_every_layout_of_a_task_is_another_one(name):
    for task in load_suite(name).tasks:
        config = task.config()
        first, second = (layout(config, np.random.default_rng(seed)) for seed in (1, 2))
        assert first.pose != second.pose or (first.height != second.height).any(), task.name


def test_all_has_every_scene_at_every_level():
    tasks = load_suite("all").tasks
    assert {task.scene for task in tasks} == set(scene_names())
    assert {task.level for task in tasks if task.job == "heap"} == {0, 1, 2, 3, 4, 5}
    for scene in set(scene_names()) - {"heap"}:
        middle = None if scene in PAPER else 1  # as in paper.toml, with ranges of its own
        assert {task.level for task in tasks if task.scene == scene} == {0, middle, 2}, scene


def test_the_ground_of_the_uneven_scene_is_drawn_anew():
    [task] = [task for task in load_suite("paper").tasks if task.job == "uneven"]
    assert task.config().ground.seed is None


def test_a_file_of_ones_own(written, tmp_path):
    (tmp_path / "site.toml").write_text('level = 2\ndescription = "mine"\n')
    path = written(
        'description = "two"\n'
        '[[job]]\nscene = "heap"\nlevels = [0, 3]\nsteps = 40\n'
        '[[job]]\nname = "own"\nscene = "site.toml"\nset = { soil = { repose = 30 } }\n'
    )
    first, second, third = load_suite(path).tasks
    assert (first.name, second.name, third.name) == ("heap 0", "heap 3", "own")
    assert (first.steps, third.steps) == (40, None)
    assert (second.config().layout.rough, third.config().description) != ((0.0, 0.0), "")
    assert third.config().soil.slope == pytest.approx(np.tan(np.radians(30)))
    assert {task.steps for task in load_suite(path, steps=7).tasks} == {7}


def test_files_that_a_suite_names_lie_beside_it(written, tmp_path, monkeypatch):
    np.save(tmp_path / "map.npy", np.zeros((64, 64)))
    path = written(
        '[[job]]\nscene = "posts"\nlevels = [1]\nset = { ground = { kind = "file", path = "map.npy", pixel = 0.5 } }\n'
    )
    monkeypatch.chdir("/")
    [task] = load_suite(path).tasks
    assert task.config().ground.path == str(tmp_path / "map.npy")


def test_a_task_is_made_again_from_what_is_written_of_it():
    for task in load_suite("all").tasks:
        assert Task(**task.written()) == task


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "has no .*job"),
        ("tasks = 1", "has the key 'tasks'; allowed: description, include, job"),
        ("[[job]]\nlevels = [1]", "has no `scene`"),
        ('[[job]]\nscene = "heap"\nlevel = 1', "has the key 'level'; allowed: name, scene, levels"),
        ('[[job]]\nscene = "heap"\nlevels = 1', "levels is 1; allowed: a TOML list"),
        ('[[job]]\nscene = "heap"\nlevels = ["a"]', "allowed: a list of whole numbers"),
        ('[[job]]\nscene = "heap"\nlevels = [9]', "job heap 9: .*level.* 9"),
        ('[[job]]\nscene = "heap"\nsteps = 0', "steps is 0; allowed: 1 or more"),
        ('[[job]]\nscene = "heap"\nset = { soil = { angle = 3 } }', "job heap: .*angle"),
        ('[[job]]\nscene = "uneven"\nwithout = ["ground.sed"]', "job uneven: ground.sed is not known, did you mean"),
        ('[[job]]\nscene = "heep"', "did you mean heap"),
        ('[[job]]\nscene = "heap"\n[[job]]\nscene = "heap"', "has the job heap twice"),
        ('include = ["mine.toml"]', "includes itself"),
        ('include = ["no"]', f"suite is 'no'; allowed: {', '.join(suite_names())}"),
        ("[[job", "is no TOML"),
    ],
)
def test_bad_files_are_refused(written, text, complaint):
    with pytest.raises(ValueError, match=complaint):
        load_suite(written(text))


def test_unknown_names_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"quick, surfaces, .*or the path of a \.toml file"):
        load_suite("fast")
    with pytest.raises(ValueError, match="is no file"):
        load_suite(tmp_path / "none.toml")
