"""Every number of the behaviours that push: its unit, the range it may be tuned in, and what it does.

The numbers themselves are data: `configs/policy/*.toml`, read by `pushing.numbers`.
"""

from dataclasses import Field, dataclass, field, fields
from math import isfinite


def _number(least: float, most: float, unit: str = "") -> float:
    """A parameter: the least and largest value that make sense, and their unit ("" for a share)."""
    return field(metadata={"range": (least, most), "unit": unit})


@dataclass(frozen=True, kw_only=True)
class Pushing:
    """What behaviours that push have in common. A load is the rated 0.8 width height^2 of the blade."""

    # SELECT
    min_height: float = _number(0.01, 0.3, "m")  # soil lower than this above the target is left where it is
    perch: float = _number(0.0, 2.0)  # what a load under and behind the machine at its start takes from its worth
    least_gain: float = _number(0.0, 5.0, "loads m")  # a push that brought less is not begun again for a while
    inset: float = _number(0.0, 4.0, "m")  # how far inside the goal a push is aimed
    centre: float = _number(0.0, 1.0)  # 0 aims at the goal's nearest point, 1 at its centre
    back_off: float = _number(1.6, 5.0, "m")  # from the first soil back to the pivot at the start of a push
    clearance: float = _number(0.0, 1.0, "m")  # room beside the blade when it passes something solid
    mound: float = _number(0.1, 3.0, "m")  # soil higher than this above the target is driven round

    # NAVIGATE and ALIGN
    carry: float = _number(0.1, 1.0, "m")  # height of the edge over the tracks, at most the machine's lift
    arrive: float = _number(0.05, 1.0, "m")  # how near to the start of a push is near enough
    navigate_limit: float = _number(5.0, 120.0, "s")  # after that it gives up and selects anew
    align_tolerance: float = _number(0.01, 0.5, "rad")
    lowered: float = _number(0.01, 0.5, "m")  # how near to its height the edge has to be before a push begins
    align_limit: float = _number(2.0, 30.0, "s")

    # PUSH
    grade: float = _number(-0.1, 0.1, "m")  # height of the edge over the target surface
    shave: float = _number(0.0, 1.0)  # 0 holds the edge at the mean of the targets ahead, 1 at the lowest
    rim: float = _number(0.0, 1.0)  # the same at the rim of a pit to be dug, where crumbs stay for good
    layer: float = _number(0.5, 20.0, "loads")  # where more lies on the way, the push takes as much off its top
    full: float = _number(0.3, 3.0, "loads")  # from which the blade is raised
    raise_gain: float = _number(0.0, 0.5, "m/load")  # how far, for every load too much
    slow_load: float = _number(0.0, 2.0, "1/load")  # speed is the largest / (1 + slow_load * load)
    slow_edge: float = _number(0.0, 1.0)  # 1: no faster than the blade can follow the ground; 0: heedless
    min_speed: float = _number(0.1, 1.0)  # share of the largest speed that it keeps in any case
    grading_speed: float = _number(0.1, 1.0)  # largest share of its speed on a design surface
    gather: float = _number(0.0, 1.5)  # share of the way to soil that escapes to a side by which the aim shifts
    gather_ahead: float = _number(0.5, 8.0, "m")  # how far ahead of the blade it looks for such soil
    lost_share: float = _number(0.2, 1.0)  # it selects anew when this share of the largest load has escaped
    enter: float = _number(-0.5, 3.0, "m")  # how far inside the goal the blade ends a push
    push_limit: float = _number(5.0, 240.0, "s")
    held: float = _number(0.0, 1.0)  # with traction the blade is raised at less than this share of the speed asked for
    ease: float = _number(0.0, 1.0, "m/step")  # as fast, where the machine stands still
    sink: float = _number(0.0, 1.0, "m/step")  # and as fast it is let down again

    # RETREAT
    retreat: float = _number(0.3, 5.0, "m")
    retreat_limit: float = _number(1.0, 30.0, "s")

    def __post_init__(self) -> None:
        """Check every number; raises ValueError with the name, the value and the range."""
        for entry in fields(self):
            value, (least, most) = getattr(self, entry.name), range_of(entry)
            if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
                raise ValueError(f"{entry.name} is {value!r}; allowed: a number from {least:g} to {most:g}")
            if not least <= value <= most:
                raise ValueError(f"{entry.name} is {value:g}; allowed: {least:g} to {most:g}")


@dataclass(frozen=True, kw_only=True)
class Parameters(Pushing):
    """Those of the adaptive push: how it values a push."""

    tail: float = _number(-1.0, 1.0, "loads/m")  # worth of a push by how far its first soil is from the goal
    overload: float = _number(0.0, 2.0)  # what a load more than one on the push's way takes from its worth
    travel: float = _number(0.0, 0.2, "loads/s")  # what a second on the way to the push takes from its worth


@dataclass(frozen=True, kw_only=True)
class Earning(Pushing):
    """Those of behaviours that value a push by what it brings in a second: what it is taken to bring and to cost."""

    carried: float = _number(0.3, 6.0, "loads")  # most that a push is taken to bring
    overhead: float = _number(0.0, 30.0, "s")  # for lowering, lifting and backing off
    pace: float = _number(0.1, 1.0)  # share of the top speed at which it is taken to push
    far: float = _number(0.0, 1.0, "1/m")  # by how much a push is worth more for every metre from the goal


@dataclass(frozen=True, kw_only=True)
class GreedyParameters(Earning):
    """Those of the greedy behaviour: when it finishes another way."""

    finish: float = _number(0.0, 20.0, "loads")  # with less than this left it goes on as the adaptive push


@dataclass(frozen=True, kw_only=True)
class GradeParameters(Pushing):
    """Those of grading: what a pass over a design surface costs."""

    overhead: float = _number(0.0, 30.0, "s")  # for lowering, lifting and backing off
    enough: float = _number(0.0, 1.0, "m4")  # a pass that takes less off the squared error is not begun
    back_drag: float = _number(0.0, 20.0, "m")  # dragged back along the lane after a finishing pass
    light: float = _number(0.0, 5.0, "loads")  # a pass is a finishing one if its load was never more than this


@dataclass(frozen=True, kw_only=True)
class SlotParameters(Parameters):
    """Those of slot dozing: how lanes lie, and what a pass in one takes."""

    spacing: float = _number(0.5, 2.0, "blades")  # from one lane to the next
    loads: float = _number(0.3, 6.0, "loads")  # that a pass takes up on its way; the rest of the lane waits
    least_load: float = _number(0.02, 2.0, "loads")  # a lane with less in it is empty


@dataclass(frozen=True, kw_only=True)
class PlannerParameters(Earning):
    """Those of the planner: how much it tries out."""

    tries: float = _number(1, 100, "pushes")  # tried out at each SELECT, of each of two ways to value them
    trial: float = _number(1.0, 600.0, "s")  # after which a trial ends


@dataclass(frozen=True, kw_only=True)
class PassPlannerParameters(GradeParameters):
    """Those of the planner on design surfaces."""

    tries: float = _number(1, 100, "passes")  # tried out at each SELECT
    trial: float = _number(1.0, 600.0, "s")  # after which a trial ends


def range_of(entry: Field) -> tuple[float, float]:
    """Least and largest value of a parameter."""
    return entry.metadata["range"]


def unit_of(entry: Field) -> str:
    """Unit of a parameter, "" for a share."""
    return entry.metadata["unit"]
