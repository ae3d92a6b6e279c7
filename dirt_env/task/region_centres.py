"""Connected regions of a mask, and the middle of each."""

import numpy as np

from dirt_env.sim.jit import entry, kernel


def region_centres(mask: np.ndarray, cell: float) -> np.ndarray:
    """Centres x, y [m] of the regions of mask[rows, cols] that hang together over edges, from south to north; f8[n, 2].

    The centre is the centroid, or where that lies outside the region, the middle of the region's nearest cell.
    """
    label = np.empty(mask.shape, np.int32)
    return _middles(label, _label(np.ascontiguousarray(mask), label), cell)


def middle_of(mask: np.ndarray, cell: float) -> np.ndarray:
    """The same for all marked cells as one region, whether they hang together or not; f8[1, 2]."""
    return _middles(np.where(mask, 0, -1).astype(np.int32), 1, cell)


@entry
def _label(mask, label):
    """Number of the region of each cell, in the order of their first cells, -1 outside; returns how many there are.

    Every cell points to an earlier one of its region; the roots are then numbered. Hoshen and Kopelman 1976.
    """
    rows, cols = mask.shape
    root = np.empty(rows * cols, np.int32)
    for r in range(rows):
        for c in range(cols):
            p = r * cols + c
            root[p] = p
            if mask[r, c] and c > 0 and mask[r, c - 1]:
                root[p] = _root_of(root, p - 1)
            if mask[r, c] and r > 0 and mask[r - 1, c]:
                a, b = _root_of(root, p - cols), _root_of(root, p)
                root[max(a, b)] = min(a, b)
                root[p] = min(a, b)
    count = 0
    for r in range(rows):
        for c in range(cols):
            p = r * cols + c
            label[r, c] = -1
            if mask[r, c]:
                first = _root_of(root, p)
                if first == p:
                    label[r, c] = count
                    count += 1
                else:
                    label[r, c] = label[first // cols, first % cols]
    return count


@kernel
def _root_of(root, p):
    """The first cell of the region of cell p; shortens the way there for the next time."""
    while root[p] != p:
        root[p] = root[root[p]]
        p = root[p]
    return p


@entry
def _middles(label, count, cell):
    """Centres x, y [m] of the regions numbered 0 to count - 1 in label[rows, cols]."""
    rows, cols = label.shape
    row, col, cells = np.zeros(count), np.zeros(count), np.zeros(count)
    for r in range(rows):
        for c in range(cols):
            k = label[r, c]
            if k >= 0:
                row[k] += r
                col[k] += c
                cells[k] += 1
    nearest = np.full(count, np.inf)
    at = np.empty((count, 2))
    for k in range(count):
        row[k] /= cells[k]
        col[k] /= cells[k]
        at[k, 0], at[k, 1] = col[k], row[k]
        if label[int(row[k] + 0.5), int(col[k] + 0.5)] == k:
            nearest[k] = -1.0
    for r in range(rows):
        for c in range(cols):
            k = label[r, c]
            if k >= 0 and (r - row[k]) ** 2 + (c - col[k]) ** 2 < nearest[k]:
                nearest[k] = (r - row[k]) ** 2 + (c - col[k]) ** 2
                at[k, 0], at[k, 1] = c, r
    return (at + 0.5) * cell
