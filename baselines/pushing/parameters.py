"""Every number of the behaviours that push, with its unit, its tuned default and the range it may be tuned in."""

from dataclasses import Field, dataclass, field, fields
from math import isfinite


def _number(default: float, least: float, most: float) -> float:
    """A parameter: its default, and the least and largest value that make sense."""
    return field(default=default, metadata={"range": (least, most)})


@dataclass(frozen=True)
class Pushing:
    """What behaviours that push have in common.

    Lengths in m, times in s, angles in rad, volumes in loads: 1 is the rated 0.8 width height^2 of the blade.
    """

    # SELECT
    min_height: float = _number(0.06, 0.01, 0.3)  # soil lower than this above the target is left where it is
    perch: float = _number(1.16, 0.0, 2.0)  # what a load under and behind the machine at its start takes from its worth
    least_gain: float = _number(0.5, 0.0, 5.0)  # a push that brought less, loads m, is not begun again for a while
    inset: float = _number(2.0, 0.0, 4.0)  # how far inside the goal a push is aimed
    centre: float = _number(0.282, 0.0, 1.0)  # 0 aims at the goal's nearest point, 1 at its centre
    back_off: float = _number(2.6, 1.6, 5.0)  # from the first soil back to the pivot at the start of a push
    clearance: float = _number(0.13, 0.0, 1.0)  # room beside the blade when it passes something solid
    mound: float = _number(0.796, 0.1, 3.0)  # soil higher than this above the target is driven round

    # NAVIGATE and ALIGN
    carry: float = _number(0.5, 0.1, 1.0)  # height of the edge over the tracks, at most the machine's lift
    arrive: float = _number(0.593, 0.05, 1.0)  # how near to the start of a push is near enough
    navigate_limit: float = _number(15.8, 5.0, 120.0)  # after that it gives up and selects anew
    align_tolerance: float = _number(0.1, 0.01, 0.5)
    lowered: float = _number(0.247, 0.01, 0.5)  # how near to its height the edge has to be before a push begins
    align_limit: float = _number(2.0, 2.0, 30.0)

    # PUSH
    grade: float = _number(0.0, -0.1, 0.1)  # height of the edge over the target surface
    shave: float = _number(0.4, 0.0, 1.0)  # 0 holds the edge at the mean of the targets ahead, 1 at the lowest
    rim: float = _number(1.0, 0.0, 1.0)  # the same at the rim of a pit to be dug, where crumbs stay for good
    layer: float = _number(4.0, 0.5, 20.0)  # where more lies on the way, loads, the push takes as much off its top
    full: float = _number(0.703, 0.3, 3.0)  # load from which the blade is raised
    raise_gain: float = _number(0.066, 0.0, 0.5)  # how far, m for every load too much
    slow_load: float = _number(0.0, 0.0, 2.0)  # speed is the largest / (1 + slow_load * load)
    slow_edge: float = _number(1.0, 0.0, 1.0)  # 1: no faster than the blade can follow the ground; 0: heedless
    min_speed: float = _number(0.345, 0.1, 1.0)  # share of the largest speed that it keeps in any case
    grading_speed: float = _number(0.5, 0.1, 1.0)  # largest share of its speed on a design surface
    gather: float = _number(0.411, 0.0, 1.5)  # share of the way to soil that escapes to a side by which the aim shifts
    gather_ahead: float = _number(2.61, 0.5, 8.0)  # how far ahead of the blade it looks for such soil
    lost_share: float = _number(0.752, 0.2, 1.0)  # it selects anew when this share of the largest load has escaped
    enter: float = _number(1.32, -0.5, 3.0)  # how far inside the goal the blade ends a push
    push_limit: float = _number(77.3, 5.0, 240.0)
    held: float = _number(0.6, 0.0, 1.0)  # with traction: the blade is raised at less than this share of the speed
    ease: float = _number(0.3, 0.0, 1.0)  # by as much in a step, m, if it stands still
    sink: float = _number(0.1, 0.0, 1.0)  # and let down again by as much, m, when it runs

    # RETREAT
    retreat: float = _number(0.755, 0.3, 5.0)
    retreat_limit: float = _number(13.7, 1.0, 30.0)

    def __post_init__(self) -> None:
        """Check every number; raises ValueError with the name, the value and the range."""
        for entry in fields(self):
            value, (least, most) = getattr(self, entry.name), range_of(entry)
            if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
                raise ValueError(f"{entry.name} is {value!r}; allowed: a number from {least:g} to {most:g}")
            if not least <= value <= most:
                raise ValueError(f"{entry.name} is {value:g}; allowed: {least:g} to {most:g}")


@dataclass(frozen=True)
class Parameters(Pushing):
    """Those of the adaptive push: how it values a push."""

    tail: float = _number(0.2, -1.0, 1.0)  # worth of a push for every metre that its first soil is from the goal, loads
    overload: float = _number(0.0, 0.0, 2.0)  # what a load more than one on the push's way takes from its worth
    travel: float = _number(0.058, 0.0, 0.2)  # what a second on the way to the push takes from its worth, loads


@dataclass(frozen=True)
class GreedyParameters(Pushing):
    """Those of the greedy behaviour: what it takes a push to bring and to cost, and its own ways of pushing."""

    carried: float = _number(1.5, 0.3, 6.0)  # most loads that a push is taken to bring
    overhead: float = _number(4.0, 0.0, 30.0)  # s for lowering, lifting and backing off
    pace: float = _number(0.7, 0.1, 1.0)  # share of the top speed at which it is taken to push
    far: float = _number(0.0, 0.0, 1.0)  # by how much a push is worth more for every metre from the goal, share

    # As above, tuned anew.
    inset: float = _number(1.904, 0.0, 4.0)
    full: float = _number(0.924, 0.3, 3.0)
    gather_ahead: float = _number(2.632, 0.5, 8.0)
    clearance: float = _number(0.141, 0.0, 1.0)
    align_limit: float = _number(7.518, 2.0, 30.0)
    gather: float = _number(0.358, 0.0, 1.5)
    back_off: float = _number(2.397, 1.6, 5.0)
    raise_gain: float = _number(0.153, 0.0, 0.5)
    grading_speed: float = _number(0.434, 0.1, 1.0)
    push_limit: float = _number(37.018, 5.0, 240.0)
    centre: float = _number(0.269, 0.0, 1.0)
    shave: float = _number(0.465, 0.0, 1.0)
    least_gain: float = _number(0.0, 0.0, 5.0)


@dataclass(frozen=True)
class GradeParameters(Pushing):
    """Those of grading: what a pass over a design surface costs, and its own ways of going along it."""

    overhead: float = _number(4.0, 0.0, 30.0)  # s for lowering, lifting and backing off
    enough: float = _number(0.002, 0.0, 1.0)  # m4; a pass that takes less off the squared error is not begun
    back_drag: float = _number(3.0, 0.0, 20.0)  # m; dragged back along the lane after a finishing pass
    light: float = _number(0.2, 0.0, 5.0)  # a pass is a finishing one if its load was never more than this

    # As above, for surfaces.
    shave: float = _number(0.0, 0.0, 1.0)
    layer: float = _number(1.5, 0.5, 20.0)
    full: float = _number(2.0, 0.3, 3.0)
    least_gain: float = _number(0.0, 0.0, 5.0)


@dataclass(frozen=True)
class SlotParameters(Parameters):
    """Those of slot dozing: how lanes lie, and what a pass in one takes."""

    spacing: float = _number(1.1, 0.5, 2.0)  # of the blade's width; from one lane to the next
    loads: float = _number(1.3, 0.3, 6.0)  # that a pass takes up on its way; the rest of the lane waits
    least_load: float = _number(0.25, 0.02, 2.0)  # a lane with less in it is empty


def range_of(entry: Field) -> tuple[float, float]:
    """Least and largest value of a parameter."""
    return entry.metadata["range"]


ON_CELLS = Parameters(shave=0.7, rim=0.9)  # a step at the rim of a pit stands there, and no later push gets hold of it


def numbers_for(terrain: str) -> Parameters:
    """The numbers for a kind of terrain."""
    return ON_CELLS if terrain == "voxel" else Parameters()
