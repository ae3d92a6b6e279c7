"""Soil as it leaves a spout: a disc of even depth."""

from math import ceil, floor

import numpy as np

from dirt_env.bench.accuracy.case import PARTS, Case


def portions(case: Case, quantum: float | None) -> list[tuple[slice, slice, np.ndarray]]:
    """For each portion of the case's pours the rows, the columns and the heights f8 [m] that it adds there.

    Multiples of `quantum` [m], what that leaves over going to the middle; None does not round.
    """
    grid = case.grid
    result = []
    for x0, y0, poured in case.pours:
        volume = poured / case.rounds
        rows = _span(y0, case.spout, grid.cell, grid.rows)
        cols = _span(x0, case.spout, grid.cell, grid.cols)
        y, x = (
            (np.arange(part.start * PARTS, part.stop * PARTS) + 0.5) * grid.cell / PARTS - centre
            for part, centre in ((rows, y0), (cols, x0))
        )
        inside = (np.hypot(x[None, :], y[:, None]) < case.spout).astype(float)
        share = inside.reshape(rows.stop - rows.start, PARTS, -1, PARTS).mean(axis=(1, 3))
        amounts = share * (volume / grid.cell**2 / share.sum())
        if quantum is not None:
            rounded = np.round(amounts / quantum)
            rounded[rounded.shape[0] // 2, rounded.shape[1] // 2] += (
                round(volume / grid.cell**2 / quantum) - rounded.sum()
            )
            amounts = rounded * quantum
        result += [(rows, cols, amounts)] * case.rounds
    return result


def _span(centre: float, reach: float, cell: float, count: int) -> slice:
    return slice(max(floor((centre - reach) / cell), 0), min(ceil((centre + reach) / cell), count))
