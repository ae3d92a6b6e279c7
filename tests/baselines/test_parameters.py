"""Numbers of the behaviours: their ranges."""

from dataclasses import fields

import pytest
from dirt_env.baselines.pushing.numbers import FILES, shipped
from dirt_env.baselines.pushing.parameters import Parameters, range_of


@pytest.mark.parametrize("entry", fields(Parameters), ids=lambda entry: entry.name)
def test_a_number_outside_its_range_is_refused_with_the_range(entry):
    least, most = range_of(entry)
    for value in (least - 1.0, most + 1.0, float("nan"), "much", True):
        with pytest.raises(ValueError, match=f"{entry.name} is .*allowed: .*{least:g} to {most:g}"):
            shipped(Parameters, **{entry.name: value})


@pytest.mark.parametrize("kind", FILES, ids=lambda kind: kind.__name__)
def test_the_ends_of_the_ranges_are_allowed(kind):
    for end in (0, 1):
        kind(**{entry.name: range_of(entry)[end] for entry in fields(kind)})
