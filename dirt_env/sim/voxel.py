"""The paper's Algorithms 1 and 2 on the part of the grid that is not at rest; what is left out would not have changed.

One update, for all cells: UpdateConstraints; ApplyFillIncoming (accept what comes in, sink, spread or rise);
ApplyFillOutgoing. A cell sees its neighbours as they were before each of these steps (snapshot reads). `voxel_plain`
has the same without shortcuts and with every reading; this file has the default reading only, equal to the last bit.

Row after row of cells is worked on: accept and sink in row r, spread in row r - 1, deliver in row r - 2, so that the
work space stays in the processor's cache. The work space is a ring of four rows of cells of each quantity below.
"""

from math import inf

from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.voxel_plain import plain_update
from dirt_env.sim.voxel_state import Rules, Voxels
from dirt_env.sim.window import clear, widen

# Rows of the work space: fill with what came in, what sinks, fill after sinking, the same as it looks to fill that is
# to enter (infinite where a constraint forbids it), available neighbours, what each is sent, what the cell above is
# sent, what comes in.
ACCEPTED, SINKING, LEVEL, ENTRY, AVAILABLE, SENT, RISING, COMING = range(8)
REACH = 2  # columns: what a column becomes in one update depends on columns no farther away


@kernel
def age_constraints(life, flags):
    """UpdateConstraints (Algorithm 1, line 2) in one row: one update less to live. Returns how many there are.

    A constraint that blocks 100 updates is set to 101: the first of them begins here.
    """
    count = 0
    for p in range(life.size):
        flags[p] = life[p] > 0
        count += life[p] > 0
    if count > 0:
        for p in range(life.size):
            life[p] -= life[p] > 0
    return count


@kernel
def accept_and_sink(fill, incoming, life, accepted, sinking, level, entry_):
    """Algorithm 2: take in what comes; send min(fill, 1 - below) to the cell below where that may enter."""
    n = fill.size
    for p in range(n):
        accepted[p] = fill[p] + incoming[p]
    here, sinks, above_sinks = accepted[1:], sinking[1:], sinking[1:]
    for p in range(n - 1):
        amount = min(here[p], max(0.0, 1.0 - accepted[p]))
        sinks[p] = amount if life[p] == 0 else 0.0
    for p in range(n - 1):
        level[p] = accepted[p] - sinking[p] + above_sinks[p]
    level[n - 1] = accepted[n - 1]
    for p in range(n):
        entry_[p] = level[p] if life[p] == 0 else inf


@kernel
def shut_rim(level, first, last):
    """Make the `first` and the `last` cells of a row, those of the rim, give nothing."""
    for p in range(first):
        level[p] = -inf
    for p in range(level.size - last, level.size):
        level[p] = -inf


@kernel
def count_available(level, entry_, south, north, high, difference, available):
    """Algorithm 2, lines 11 to 16: to how many neighbours on the same level fill can go, by `difference` emptier."""
    n = level.size - 2 * high
    here, count = level[high:], available[high:]
    east, below, above = entry_[2 * high :], south[high:], north[high:]
    for p in range(n):
        count[p] = (1.0 if here[p] - entry_[p] > difference else 0.0) + (1.0 if here[p] - east[p] > difference else 0.0)
    for p in range(n):
        at_south, at_north = here[p] - below[p] > difference, here[p] - above[p] > difference
        count[p] += (1.0 if at_south else 0.0) + (1.0 if at_north else 0.0)


@kernel
def spread_or_rise(level, entry_, available, high, rate, lock, sent, rising):
    """Algorithm 2, lines 17 to 32: the `rate` of the fill in equal parts to those neighbours; where there are none,
    what is over 1 goes up.
    """
    n = level.size - 2 * high
    here, count, part, rises, above = level[high:], available[high:], sent[high:], rising[high:], entry_[high + 1 :]
    for p in range(n):
        amount = here[p] * rate / max(count[p], 1.0)
        amount = (amount + lock) - lock
        part[p] = amount if count[p] > 0.0 else 0.0
    for p in range(n):
        over = max(here[p] - 1.0, 0.0)
        over = over if count[p] == 0.0 else 0.0
        rises[p] = over if above[p] < inf else 0.0


@kernel
def leave(level, available, sent, rising, fill, flags):
    """What is left in a row of cells; marks in `flags` those that changed and returns how many they are."""
    changed = 0
    for p in range(fill.size):
        left = level[p] - (available[p] * sent[p] + rising[p])
        flags[p] = fill[p] != left
        changed += fill[p] != left
        fill[p] = left
    return changed


@kernel
def come(level, entry_, sent, south, south_sent, north, north_sent, rising, high, difference, coming):
    """ApplyFillOutgoing (Algorithm 1, line 8), seen from the cells of a row that receive."""
    n = level.size - 2 * high
    room, comes, east, east_sent = entry_[high:], coming[high:], level[2 * high :], sent[2 * high :]
    for p in range(n):
        from_west, from_east = sent[p], east_sent[p]
        from_west = from_west if level[p] - room[p] > difference else 0.0
        from_east = from_east if east[p] - room[p] > difference else 0.0
        comes[p] = from_west + from_east
    south, south_sent, north, north_sent = south[high:], south_sent[high:], north[high:], north_sent[high:]
    for p in range(n):
        from_south, from_north = south_sent[p], north_sent[p]
        from_south = from_south if south[p] - room[p] > difference else 0.0
        from_north = from_north if north[p] - room[p] > difference else 0.0
        comes[p] += from_south + from_north
    below = rising[high - 1 :]
    for p in range(n):
        comes[p] += below[p]


@kernel
def replace(coming, incoming, flags):
    """The new list of incoming fill of a row; marks the cells where it differs from the last and returns how many."""
    changed = 0
    for p in range(incoming.size):
        flags[p] = incoming[p] != coming[p]
        changed += incoming[p] != coming[p]
        incoming[p] = coming[p]
    return changed


@kernel
def note(flags, count, row, column, high, box):
    """Make `box` hold the marked columns of a row whose first cell belongs to `column`."""
    if count == 0:
        return
    first, last = 0, flags.size - 1
    while flags[first] == 0:
        first += 1
    while flags[last] == 0:
        last -= 1
    widen(box, row, row + 1, column + first // high, column + last // high + 1)


@kernel
def update_box(fill, incoming, life, work, flags, rules, box, moved):
    """One update (Algorithm 1) of the rows and columns of `box`; writes into `moved` where something changed.

    Of the cells around it as much is read as has an influence, and nothing written.
    """
    rows, cols, high = fill.shape
    r0, r1, c0, c1 = box
    left, right = max(c0 - REACH, 0), min(c1 + REACH, cols)
    a, b = (c0 - left) * high, (c1 - left) * high
    n = (right - left) * high
    fills, incomings, lives = fill.reshape(rows, -1), incoming.reshape(rows, -1), life.reshape(rows, -1)
    begin, end = left * high, right * high
    lock = 1.5 * 2.0**52 * rules.grain
    for r in range(max(r0 - REACH, 0), min(r1 + REACH, rows) + REACH):
        if r < min(r1 + REACH, rows):
            k = r % 4
            life_row = lives[r, begin:end]
            count = age_constraints(life_row, flags[:n])
            note(flags[:n], count, r, left, high, moved)
            accept_and_sink(
                fills[r, begin:end], incomings[r, begin:end], life_row,
                work[ACCEPTED, 0, :n], work[SINKING, 0, :n], work[LEVEL, k, :n], work[ENTRY, k, :n],
            )  # fmt: skip
            if r == 0 or r == rows - 1:
                shut_rim(work[LEVEL, k, :n], n, 0)
            else:
                shut_rim(work[LEVEL, k, :n], high if left == 0 else 0, high if right == cols else 0)
        q = r - 1
        if max(r0 - 1, 1) <= q < min(r1 + 1, rows - 1):
            k, south, north = q % 4, (q - 1) % 4, (q + 1) % 4
            level, entry_, available = work[LEVEL, k, :n], work[ENTRY, k, :n], work[AVAILABLE, 0, :n]
            sent, rising = work[SENT, k, :n], work[RISING, k, :n]
            count_available(
                level, entry_, work[ENTRY, south, :n], work[ENTRY, north, :n], high, rules.difference, available
            )
            spread_or_rise(level, entry_, available, high, rules.rate, lock, sent, rising)
            if r0 <= q < r1:
                there = slice(begin + a, begin + b)
                count = leave(level[a:b], available[a:b], sent[a:b], rising[a:b], fills[q, there], flags[: b - a])
                note(flags[: b - a], count, q, c0, high, moved)
        q = r - 2
        if r0 <= q < r1:
            k, south, north = q % 4, (q - 1) % 4, (q + 1) % 4
            coming = work[COMING, 0, :n]
            come(
                work[LEVEL, k, :n], work[ENTRY, k, :n], work[SENT, k, :n], work[LEVEL, south, :n],
                work[SENT, south, :n], work[LEVEL, north, :n], work[SENT, north, :n], work[RISING, k, :n],
                high, rules.difference, coming,
            )  # fmt: skip
            count = replace(coming[a:b], incomings[q, begin + a : begin + b], flags[: b - a])
            note(flags[: b - a], count, q, c0, high, moved)


@kernel
def grown(box, rows, cols):
    """`box` grown by as many columns as can change next, within the rim."""
    return max(box[0] - REACH, 1), min(box[1] + REACH, rows - 1), max(box[2] - REACH, 1), min(box[3] + REACH, cols - 1)


@kernel
def updates(fill, incoming, life, active, touched, work, flags, rules, count):
    """At most `count` updates, fewer if everything comes to rest; returns how many. `active` has what changed last."""
    rows, cols, _ = fill.shape
    plain = rules.neighbours != 4 or rules.in_place or rules.down_in_transit or rules.rise_into_constraint
    done = 0
    while done < count and active[1] > active[0]:
        if plain:
            widen(touched, 1, rows - 1, 1, cols - 1)
            clear(active)
            if plain_update(fill, incoming, life, rules):
                widen(active, 1, rows - 1, 1, cols - 1)
        else:
            box = grown(active, rows, cols)
            widen(touched, box[0], box[1], box[2], box[3])
            clear(active)
            update_box(fill, incoming, life, work, flags, rules, box, active)
        done += 1
    return done


@entry
def update(voxels: Voxels, rules: Rules, count: int = 1) -> int:
    """Do `count` updates of the grid, in place, or as many as it takes to come to rest; returns how many."""
    return updates(
        voxels.fill,
        voxels.incoming,
        voxels.life,
        voxels.active,
        voxels.touched,
        voxels.work,
        voxels.flags,
        rules,
        count,
    )


@entry
def update_all(voxels: Voxels, rules: Rules, count: int = 1) -> None:
    """The same for every cell, at rest or not: for comparison."""
    rows, cols, _ = voxels.fill.shape
    for _ in range(count):
        box = (1, rows - 1, 1, cols - 1)
        clear(voxels.active)
        update_box(voxels.fill, voxels.incoming, voxels.life, voxels.work, voxels.flags, rules, box, voxels.active)
