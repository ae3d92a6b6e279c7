"""Where the machine begins."""

from math import atan2, cos, sin

import numpy as np

from dirt_env.scene.distance import distance_inside
from dirt_env.scene.layout import Setting
from dirt_env.sim.params import Grid

BACK_OFF = 3.0  # m from the foot of the soil to the pivot


def behind(setting: Setting, source: np.ndarray, sink: np.ndarray) -> tuple[float, float, float]:
    """The pose behind the soil of `source`, heading for the middle of `sink` (bool [rows, cols] each).

    It is pulled into the site where there is less room than the machine likes to have.
    """
    cell = setting.grid.cell
    row, col = np.nonzero(source)
    x, y = (col + 0.5) * cell, (row + 0.5) * cell
    to_y, to_x = ((axis.mean() + 0.5) * cell for axis in np.nonzero(sink))
    heading = atan2(to_y - y.mean(), to_x - x.mean())
    along = (x - x.mean()) * cos(heading) + (y - y.mean()) * sin(heading)
    back = BACK_OFF - along.min()
    width, depth = setting.size
    margin = min(setting.tracks_radius, width / 2, depth / 2)
    at_x = float(np.clip(x.mean() - back * cos(heading), margin, width - margin))
    at_y = float(np.clip(y.mean() - back * sin(heading), margin, depth - margin))
    return at_x, at_y, atan2(to_y - at_y, to_x - at_x)


def free_cells(setting: Setting, taken: np.ndarray) -> np.ndarray:
    """Centres [n, 2] (x, y) m of the cells where machine and blade touch no `taken` cell, whichever way they point."""
    margin = int(np.ceil(setting.radius / setting.grid.cell))
    open_cells = np.zeros(taken.shape, dtype=bool)
    open_cells[margin:-margin, margin:-margin] = ~taken[margin:-margin, margin:-margin]
    room = distance_inside(~taken, setting.grid.cell) > setting.radius
    row, col = np.nonzero(open_cells & room)
    return (np.stack([col, row], axis=1) + 0.5) * setting.grid.cell


def check(setting: Setting, pose: tuple[float, float, float], solid: np.ndarray | None, key: str) -> None:
    """An error unless the tracks are inside the site and clear of solid cells."""
    x, y, heading = pose
    width, depth = setting.size
    forward = np.array([cos(heading), sin(heading)]) * setting.machine.length / 2
    left = np.array([-sin(heading), cos(heading)]) * setting.machine.width / 2
    corners = np.array([[a, b] for a in (-1, 1) for b in (-1, 1)]) @ np.stack([forward, left]) + (x, y)
    if corners.min() < 0 or (corners > (width, depth)).any():
        low, high = corners.min(axis=0), corners.max(axis=0)
        raise ValueError(
            f"{key} puts the tracks at x = {low[0]:.2f} to {high[0]:.2f} m and y = {low[1]:.2f} to {high[1]:.2f} m; "
            f"allowed: inside the site, x from 0 to {width:g} m and y from 0 to {depth:g} m"
        )
    if solid is not None and (solid & under(setting, pose)).any():
        raise ValueError(
            f"{key} puts the machine on {int((solid & under(setting, pose)).sum())} solid cells; allowed: none"
        )


def under(setting: Setting, pose: tuple[float, float, float]) -> np.ndarray:
    """Cells under the tracks' rectangle, bool [rows, cols]."""
    x, y, heading = pose
    grid = setting.grid
    dx = (np.arange(grid.cols)[None, :] + 0.5) * grid.cell - x
    dy = (np.arange(grid.rows)[:, None] + 0.5) * grid.cell - y
    along = np.abs(dx * cos(heading) + dy * sin(heading))
    across = np.abs(dy * cos(heading) - dx * sin(heading))
    return (along <= setting.machine.length / 2) & (across <= setting.machine.width / 2)


def touches(setting: Setting, pose: tuple[float, float, float], solid: np.ndarray) -> bool:
    """Whether the tracks' rectangle or the blade overlaps a solid cell anywhere, not only at its centre."""
    x, y, heading = pose
    blade, machine = setting.blade, setting.machine
    ahead = x + blade.reach * cos(heading), y + blade.reach * sin(heading)
    tracks = _overlapped(setting.grid, x, y, heading, machine.length / 2, machine.width / 2)
    return bool((solid & (tracks | _overlapped(setting.grid, *ahead, heading, 0.0, blade.width / 2))).any())


def _overlapped(grid: Grid, x: float, y: float, heading: float, long: float, wide: float) -> np.ndarray:
    """Cells that a rectangle of half sides `long`, `wide` [m] overlaps, bool [rows, cols]: no axis separates them."""
    dx = (np.arange(grid.cols)[None, :] + 0.5) * grid.cell - x
    dy = (np.arange(grid.rows)[:, None] + 0.5) * grid.cell - y
    c, s, half = abs(cos(heading)), abs(sin(heading)), 0.5 * grid.cell
    along = np.abs(dx * cos(heading) + dy * sin(heading)) <= long + half * (c + s)
    across = np.abs(dy * cos(heading) - dx * sin(heading)) <= wide + half * (c + s)
    return along & across & (np.abs(dx) <= half + c * long + s * wide) & (np.abs(dy) <= half + s * long + c * wide)
