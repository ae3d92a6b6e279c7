"""Numbers as TOML: what is shipped is whole, and files of one's own are laid over it."""

from dataclasses import asdict, fields, replace

import pytest
from dirt_env.baselines.pushing.numbers import FILES, line_of, numbers_folder, numbers_for, shipped, write
from dirt_env.baselines.pushing.parameters import GreedyParameters, Parameters, PassPlannerParameters

from dirt_env.config import load
from dirt_env.policy import load_policy

TUNED = {  # as they were before they were data
    Parameters: {"min_height": 0.06, "perch": 1.16, "inset": 2.0, "layer": 4.0, "tail": 0.2, "push_limit": 77.3},
    GreedyParameters: {"inset": 1.904, "align_limit": 7.518, "least_gain": 0.0, "carried": 1.5, "perch": 1.16},
}


@pytest.fixture
def own(tmp_path):
    """A file of that text."""

    def written(text):
        (tmp_path / "mine.toml").write_text(text)
        return str(tmp_path / "mine.toml")

    return written


def test_every_shipped_file_has_a_kind_that_reads_it():
    assert {f"{name}.toml" for name in FILES.values()} == {path.name for path in numbers_folder().glob("*")}


@pytest.mark.parametrize("kind", FILES, ids=lambda kind: kind.__name__)
def test_shipped_numbers_are_as_they_are_written_with_units_and_ranges(kind):
    text = (numbers_folder() / f"{FILES[kind]}.toml").read_text()
    lines = [line for line in text.splitlines() if not line.startswith("# ")]
    expected = [line_of(entry, getattr(shipped(kind), entry.name)) for entry in fields(kind)]
    assert text.startswith("# Numbers of ")
    assert lines[: len(expected)] == expected


@pytest.mark.parametrize("kind", TUNED, ids=lambda kind: kind.__name__)
def test_shipped_numbers_are_those_that_were_tuned(kind):
    numbers = asdict(shipped(kind))
    assert {name: numbers[name] for name in TUNED[kind]} == TUNED[kind]


def test_a_file_of_ones_own_changes_what_it_names_and_nothing_else(own):
    config = load()
    found = numbers_for(Parameters, config, own("tail = 0.5\n[voxel]\nshave = 0.1\n"))
    assert found == replace(shipped(Parameters), tail=0.5)


def test_tables_count_where_their_condition_holds(own):
    path = own("[traction]\nlayer = 1.0\n[noise]\nmin_height = 0.1\n")
    numbers = {
        name: numbers_for(Parameters, load(**overrides), path)
        for name, overrides in (("", {}), ("pulls", {"traction": {}}), ("noisy", {"observation": {"noise": {}}}))
    }
    assert numbers[""] == shipped(Parameters)
    assert numbers["pulls"].layer == 1.0
    assert numbers["pulls"].min_height == shipped(Parameters).min_height
    assert numbers["noisy"].min_height == 0.1
    assert numbers_for(Parameters, load(terrain="voxel")).shave == 0.7


def test_what_was_written_is_read_again(own):
    numbers = shipped(PassPlannerParameters, tries=3.0, shave=0.125)
    text = write(numbers, "mine")
    assert text == "# mine\nshave = 0.125  # 0 to 1\ntries = 3.0  # passes, 1 to 100\n", "nothing that is as shipped"
    assert numbers_for(PassPlannerParameters, load("ramp"), own(text)) == numbers


@pytest.mark.parametrize(
    ("mine", "found", "expected"),
    [
        ("", {"perch": 1.0}, {"perch": 1.0, "layer": 2.0}),
        ("", {"layer": 3.0}, {"layer": 2.0}),
        ("[traction]\nlayer = 1.5\nfull = 2.0\n", {"layer": 3.0}, {"layer": 1.5, "full": 2.0}),
        ("layer = 3.5\n", {"layer": 3.0}, {"layer": 3.0}),
        ("layer = 3.5\n", {"layer": 4.0}, {"layer": 4.0}),
        ("layer = 3.5\n[traction]\nlayer = 1.0\n", {"layer": 3.0}, {"layer": 1.0}),
    ],
)
def test_a_file_that_is_written_keeps_what_tables_say(own, tmp_path, mine, found, expected):
    """Of the shipped file, and of the one that the numbers began from; one's own plain numbers beat shipped tables."""
    begun, numbers = own(mine), shipped(Parameters, **found)
    (tmp_path / "found.toml").write_text(write(numbers, "found", begun))
    plain, pulls = (numbers_for(Parameters, load(**scene), tmp_path / "found.toml") for scene in ({}, {"traction": {}}))
    assert plain == numbers
    assert pulls == replace(numbers, **expected)


def test_a_policy_goes_by_the_file_in_its_name(own):
    assert load_policy(f"greedy@{own('carried = 3.0')}", load()).parameters == shipped(GreedyParameters, carried=3.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("tial = 0.5", r"mine.toml: unknown tial; allowed: min_height, .*tables \[voxel\], \[traction\], \[noise\]"),
        ("[traction]\ntial = 0.5", "mine.toml: unknown traction.tial; allowed: min_height"),
        ("tries = 3", r"unknown tries \(it is a number of planner.toml, planner_passes.toml\); allowed: min_height"),
        ("traction = 3", r"mine.toml: traction is 3; allowed: a table of numbers, \[traction\]"),
        ("tail = 5", "mine.toml: tail is 5; allowed: -1 to 1"),
        ("tail = 'far'", "mine.toml: tail is 'far'; allowed: a number from -1 to 1"),
        ("tail =", "mine.toml is no TOML"),
    ],
)
def test_a_bad_file_is_refused_with_what_is_allowed(own, text, message):
    with pytest.raises(ValueError, match=message):
        load_policy(f"adaptive_push@{own(text)}", load())


def test_a_file_that_is_not_there_and_a_behaviour_without_numbers_are_refused():
    with pytest.raises(ValueError, match=r"nowhere\.toml is no file; allowed: a \.toml file with numbers"):
        load_policy("slot@nowhere.toml", load())
    with pytest.raises(ValueError, match="idle has no numbers; allowed: adaptive_push, grade, greedy, planner, slot"):
        load_policy("idle@mine.toml", load())
    with pytest.raises(ValueError, match=r"policy greedy@: there is no file after @; allowed: NAME@FILE\.toml"):
        load_policy("greedy@", load())
