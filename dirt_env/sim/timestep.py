"""How finely a control step is cut: the blade's ends move at most half a cell in a substep."""

from math import ceil, hypot

from dirt_env.sim.jit import kernel

STRIDE = 0.5  # cells that an end of the blade may move in one substep


@kernel
def substeps(speed, yaw_rate, dt, cell, blade):
    """Number of substeps of a control step of `dt` seconds; at least 1."""
    radius = hypot(blade.reach, 0.5 * blade.width)
    travel = (abs(speed) + abs(yaw_rate) * radius) * dt
    return max(int(ceil(travel / (STRIDE * cell))), 1)
