"""What the ground asks of a machine and what its tracks and engine can give: the speed that is left, slip, stall."""

from math import sqrt, tan
from typing import NamedTuple

from dirt_env.sim.blade import blade_frame, load_ahead
from dirt_env.sim.draft import Cut, draft_force, earthmoving_factors
from dirt_env.sim.jit import kernel
from dirt_env.sim.laws import GRAVITY
from dirt_env.sim.params import Blade, Machine, Soil, Strength, Traction, record_of
from dirt_env.sim.thrust import mobilised_share, slip_at
from dirt_env.sim.zones import count_under, slope_ahead


class Pull(NamedTuple):
    """Constants of a machine's traction on a soil, for the kernels; see `pull_of`.

    The first seven are those of `draft.Cut`. `weight` [N] of the machine; soil strength under its tracks: `grip` [N]
    that does not depend on the weight on it, `tangent` of the internal friction; `full`, the share of it that tracks
    mobilise when they spin on the spot; `ratio` of shear deformation to length; `rolling` resistance as share of the
    weight; `power` [W] at the tracks.
    """

    cut: float
    hold: float
    press: float
    slide: float
    top: float
    slope: float
    width: float
    weight: float
    grip: float
    tangent: float
    full: float
    ratio: float
    rolling: float
    power: float


PULL = record_of(Pull)


def pull_of(soil: Soil, strength: Strength, blade: Blade, machine: Machine, traction: Traction) -> Pull:
    """The constants of a soil, a blade and a machine; worked out once, so that no kernel looks for a failure plane."""
    ratio = strength.shear_deformation / machine.length
    return Pull(
        *cut_of(soil, strength, blade, traction.rake),
        weight=traction.mass * GRAVITY,
        grip=2.0 * traction.track_width * machine.length * strength.cohesion,
        tangent=tan(strength.internal_friction),
        full=mobilised_share(1.0 / ratio) if ratio > 0.0 else 1.0,
        ratio=ratio,
        rolling=traction.rolling_resistance,
        power=traction.power * traction.efficiency,
    )


def cut_of(soil: Soil, strength: Strength, blade: Blade, rake: float) -> Cut:
    """Constants of the draft of a blade with that `rake` [rad], from its N factors.

    The wedge that it breaks out weighs as undisturbed soil does, the load as loose soil.
    """
    n = earthmoving_factors(rake, strength.internal_friction, strength.external_friction)
    heavy, along = soil.density * GRAVITY, 1.0 / tan(rake)
    across = along + 1.0 / tan(n.plane)
    hold = n.pull * (strength.cohesion * n.cohesion + strength.adhesion * n.adhesion) + strength.adhesion * along
    return Cut(
        weight=blade.width * (1.0 + soil.swell) * heavy * n.weight * n.pull,
        hold=blade.width * hold,
        press=blade.width * heavy * n.surcharge / across * n.pull,
        slide=soil.friction * heavy,
        top=across,
        slope=soil.slope,
        width=blade.width,
    )


@kernel
def depth_ahead(height, solid, line, cell, plane, side):
    """Mean depth [m] over the blade's width of the soil below the `plane` of the tracks that the edge is about to cut.

    It is looked up within a cell of the blade, on the `side` it moves to (1 ahead, -1 behind).
    """
    rows, cols = height.shape
    if line.edge - abs(line.roll) * line.half >= plane:
        return 0.0
    x, y = line.x + 0.5 * side * cell * line.ahead_x, line.y + 0.5 * side * cell * line.ahead_y
    span_x = abs(line.ahead_y) * line.half + 0.5 * cell * abs(line.ahead_x)
    span_y = abs(line.ahead_x) * line.half + 0.5 * cell * abs(line.ahead_y)
    total, count = 0.0, 0
    for r in range(max(int((y - span_y) // cell), 0), min(int((y + span_y) // cell) + 1, rows)):
        for c in range(max(int((x - span_x) // cell), 0), min(int((x + span_x) // cell) + 1, cols)):
            ahead, left = blade_frame(line, (c + 0.5) * cell, (r + 0.5) * cell)
            ahead *= side
            if ahead <= 0 or ahead > cell or abs(left) > line.half or (solid is not None and solid[r, c]):
                continue
            total += max(min(float(height[r, c]), plane) - line.edge - line.roll * left, 0.0)
            count += 1
    return total / count if count > 0 else 0.0


@kernel
def cut_at(pull):
    """The Cut of a Pull."""
    return Cut(pull.cut, pull.hold, pull.press, pull.slide, pull.top, pull.slope, pull.width)


@kernel
def mixed_draft(depth, load, pull, zones):
    """Draft [N] of a blade across the soils in `zones.ahead`: that of each over its share of the width.

    `pull` is that of the scene's soil.
    """
    base = draft_force(depth, load, cut_at(pull))
    result = base
    for k in range(1, len(zones.pulls)):
        if zones.ahead[k] > 0.0:
            result += zones.ahead[k] * (draft_force(depth, load, cut_at(zones.pulls[k])) - base)
    return result


@kernel
def mixed_footing(pull, zones):
    """(grip [N], tangent, full, ratio) of a Pull for tracks on the soils in `zones.under`: their means."""
    grip, tangent, ratio = pull.grip, pull.tangent, pull.ratio
    for k in range(1, len(zones.pulls)):
        share, other = zones.under[k], zones.pulls[k]
        grip += share * (other.grip - pull.grip)
        tangent += share * (other.tangent - pull.tangent)
        ratio += share * (other.ratio - pull.ratio)
    full = pull.full
    if ratio != pull.ratio:
        full = mobilised_share(1.0 / ratio) if ratio > 0.0 else 1.0
    return grip, tangent, full, ratio


@kernel
def effort(height, solid, pose, line, cell, soil, blade, machine, pull, speed, zones=None):
    """(share of the commanded `speed` [m/s] that is left, draft [N], power at the tracks [W], slip [-]) just now.

    The tracks have to give the draft, the rolling resistance and the weight's share on a slope. They run at the
    commanded speed, or at what the engine's power allows, and slip as the thrust asks for. Where the soil under them is
    not strong enough for the thrust they spin on the spot: the machine has stalled. With `zones`, both depend on the
    soils along the blade and under the tracks.
    """
    if speed == 0.0:
        return 1.0, 0.0, 0.0, 0.0
    plane = pose.z + pose.pitch * blade.reach
    side = 1 if speed > 0.0 else -1
    slope = soil.slope
    grip, tangent, full, ratio = pull.grip, pull.tangent, pull.full, pull.ratio
    if zones is not None:
        slope = slope_ahead(zones, slope, line, cell, side)
        count_under(zones, cell, pose, (line.ahead_x, line.ahead_y), machine)
        grip, tangent, full, ratio = mixed_footing(pull, zones)
    load, pushed = load_ahead(height, solid, line, cell, slope, plane, side)
    depth = depth_ahead(height, solid, line, cell, plane, side)
    if zones is not None:
        draft = mixed_draft(depth, load if pushed else 0.0, pull, zones)
    else:
        draft = draft_force(depth, load if pushed else 0.0, cut_at(pull))
    rise = side * pose.pitch
    level = 1.0 / sqrt(1.0 + rise * rise)
    resistance = (pull.rolling + rise) * pull.weight * level
    strength = grip + tangent * pull.weight * level
    thrust, limit = draft + resistance, strength * full
    if thrust <= 0.0:  # downhill
        return 1.0, draft, 0.0, 0.0
    if thrust >= limit:
        return 0.0, max(limit - resistance, 0.0), min(limit * abs(speed), pull.power), 1.0
    slip = slip_at(thrust / strength, ratio)
    share = min(1.0, pull.power / (thrust * abs(speed)))
    return share * (1.0 - slip), draft, share * thrust * abs(speed), slip
