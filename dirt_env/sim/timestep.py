"""How finely a control step is cut: the blade's ends move at most half a cell in a substep."""

from math import ceil, hypot

from dirt_env.sim.jit import kernel

STRIDE = 0.5  # cells that an end of the blade may move in one substep


@kernel
def substeps(speed, yaw_rate, dt, cell, blade):
    """Number of substeps of a control step of `dt` seconds; at least 1."""
    fastest = hypot(abs(speed) + abs(yaw_rate) * 0.5 * blade.width, yaw_rate * blade.reach)  # of the two ends [m/s]
    return max(int(ceil(fastest * dt / (STRIDE * cell))), 1)
