"""The paper's cells as objects with lists, line by line as printed, and the readings that lose or make soil.

`down`, `up` and `cap` choose what the damaged text leaves open. Only here may volume change: "all" sends the whole fill
up where only the excess should go, without taking it away (line 29 as printed); `cap` cuts every cell off at 1, the
topmost level too (line 31 as printed).
"""

import numpy as np

from dirt_env.sim.voxel_state import FOREVER

SIDES = ((0, -1), (0, 1), (-1, 0), (1, 0))


class Cell:
    """GridCell: fill, the lists of incoming and outgoing fill, its constraint."""

    def __init__(self, fill, incoming, life):
        self.fill, self.life = fill, life
        self.incoming = [incoming]
        self.outgoing = []
        self.seen = fill
        self.neighbours = []
        self.below = self.above = None

    @property
    def is_open(self):
        return self.life == 0

    def update_constraints(self):
        if self.life > 0:
            self.life -= 1

    def accept(self):
        self.fill += sum(self.incoming)
        self.incoming = []

    def sink(self):
        if self.below is not None and self.below.is_open:
            amount = min(self.seen, max(0.0, 1.0 - self.below.seen))
            self.fill -= amount
            self.below.fill += amount

    def spread(self, rules, up, cap):
        available = [cell for cell in self.neighbours if cell.is_open and self.seen - cell.seen > rules.difference]
        if available:
            part = self.seen * rules.rate / len(available)
            for cell in available:
                self.outgoing.append((cell, part))
            self.fill -= len(available) * part
        else:
            over = self.fill - 1.0
            if over > 0.0 and self.above is not None and self.above.is_open:
                self.outgoing.append((self.above, self.fill if up == "all" else over))
                self.fill -= over
            if cap:
                self.fill = min(self.fill, 1.0)

    def apply_outgoing(self):
        for cell, amount in self.outgoing:
            cell.incoming.append(amount)
        self.outgoing = []


def cells_of(voxels):
    """Every cell inside the rim by (row, column, level), wired to its neighbours."""
    shape = voxels.fill.shape
    inside = [index for index in np.ndindex(shape) if all(0 < i < n - 1 for i, n in zip(index, shape, strict=True))]
    cells = {
        index: Cell(float(voxels.fill[index]), float(voxels.incoming[index]), int(voxels.life[index]))
        for index in inside
    }
    for (r, c, m), cell in cells.items():
        cell.neighbours = [cells[r + dr, c + dc, m] for dr, dc in SIDES if (r + dr, c + dc, m) in cells]
        cell.below, cell.above = cells.get((r, c, m - 1)), cells.get((r, c, m + 1))
        if cell.life == FOREVER:
            cell.fill, cell.incoming = 0.0, []
    return cells


def grid_update(cells, rules, up="excess", cap=False):
    """Algorithm 1. Each step of Algorithm 2 looks at the grid as the step before has left it."""
    everything = list(cells.values())
    for cell in everything:
        cell.update_constraints()
    for cell in everything:
        cell.accept()
    for stage in (Cell.sink, lambda cell: cell.spread(rules, up, cap)):
        for cell in everything:
            cell.seen = cell.fill
        for cell in everything:
            stage(cell)
    for cell in everything:
        cell.apply_outgoing()


def volume(cells):
    """Fill and fill in transit, in cells."""
    return sum(cell.fill + sum(cell.incoming) for cell in cells.values())
