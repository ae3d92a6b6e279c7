"""Steering: which yaw rate and which speed bring the machine to a point, as shares of its largest."""

from math import atan2, cos, hypot, pi

from .route import Point
from .site import Site

SHARP = 0.6  # rad; a bend sharper than this is turned in place


def wrap(angle: float) -> float:
    """The angle in [-pi, pi)."""
    return (angle + pi) % (2 * pi) - pi


def turn_to(site: Site, heading: float) -> float:
    """Steering that brings the heading [rad] there within this step, or as far as it gets."""
    error = wrap(heading - site.pose["heading"])
    return min(max(error / (site.machine.yaw_rate * site.period), -1.0), 1.0)


def drive_to(site: Site, point: Point, reverse: bool) -> tuple[float, float]:
    """(steering, speed) towards a point, or backwards to it; stops there."""
    dx, dy = point[0] - site.pose["x"], point[1] - site.pose["y"]
    course = atan2(dy, dx) + (pi if reverse else 0.0)
    error = wrap(course - site.pose["heading"])
    steering = turn_to(site, course)
    if abs(error) > SHARP:
        return steering, 0.0
    speed = min(1.0, hypot(dx, dy) * cos(error) / (site.machine.speed * site.period))
    return steering, -speed if reverse else speed


def is_quicker_in_reverse(site: Site, point: Point, heading: float) -> bool:
    """Whether turning, driving to the point and turning to `heading` there takes less time backwards."""
    course = atan2(point[1] - site.pose["y"], point[0] - site.pose["x"])
    forward = abs(wrap(course - site.pose["heading"])) + abs(wrap(heading - course))
    backward = abs(wrap(course + pi - site.pose["heading"])) + abs(wrap(heading - course - pi))
    return backward < forward
