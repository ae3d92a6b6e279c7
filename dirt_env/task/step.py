"""A control step of many worlds in one compiled call: decode, advance, measure, book, reward, observe."""

import numpy as np

from dirt_env.sim.advance import step
from dirt_env.sim.intrinsics import add_shared, read_shared, uncounted
from dirt_env.sim.jit import entry, kernel
from dirt_env.task.actions import command_of
from dirt_env.task.batch import (
    Batch,
    Scratch,
    at,
    bank_at,
    blade_of,
    grid_of,
    job_of,
    machine_of,
    pull_at,
    sight_of,
    soil_of,
    sums_of,
    view_of,
    zones_at,
)
from dirt_env.task.goal import measure
from dirt_env.task.observation import Sight, observe
from dirt_env.task.prefetch import prefetch_world
from dirt_env.task.reward import TERMS, Scale, ToDo, reward_terms

INFO = (
    "share_in_goal",
    "volume_moved_m3",
    "loose_moved_m3",
    "misplaced_m3",
    "spilled_m3",
    "lost_m3",
    "grade_error_m",
    "work_kj",
    "distance_m",
    "time_s",
    "load_m3",
    "draft_kn",
    "blocked",
    "energy_kj",
    "slip",
    "is_success",
)
"""The numbers of `info`, see `DirtPushEnv`; the last is 0 or 1."""

FIGURES = (*INFO, *TERMS, "reward")
"""Rows of the figures of a step: the numbers of `info`, the reward's terms, the reward."""

SUCCESS, FIRST_TERM, REWARD = len(INFO) - 1, len(INFO), len(FIGURES) - 1
ADVANCE, BOOK, SHOW = range(3)  # phases of a step
MANY = 200  # worlds of a batch, of which what a step reads may no longer be in the caches
LOOKS = 4000  # whether other threads are done, 50 to 200 us; being woken by one takes as long
TOGETHER = 8  # worlds that go through each phase one after the other, while its code and their data are in the caches


@entry
def step_worlds(
    batch: Batch,
    scratch: Scratch | None,
    actions: np.ndarray,
    idle: np.ndarray,
    sight: Sight,
    figures: np.ndarray,
    first: int,
    last: int,
    base: int,
    phase: int,
    turns: np.ndarray,
    thread: int,
) -> bool:
    """One control step of the worlds first:last that are not idle[m], in place, from the `phase` on.

    Calls with the same `turns` i8[threads + 1], of zeros, share the worlds, each with a number `thread` and a scratch
    of its own: it begins with its own part of them and then helps the others, TOGETHER worlds in a turn. Returns
    whether it knows that all are done, for which thread 0 waits a little. With one thread, `turns` is not touched.

    ADVANCE is the whole step. BOOK is what follows after the worlds have been advanced, for terrains that do that
    elsewhere (they have no scratch). SHOW shows the worlds as they are: no reward, and its terms 0. One entry does all
    of that, because what reset and step have in common would be compiled twice.

    Row w - base of actions f8[m, 3], of the arrays of `sight` and column w - base of figures f8[FIGURES, m] are those
    of world w. Idle worlds leave theirs as they are.
    """
    batch, sight = uncounted(batch), uncounted(sight)
    actions, idle, figures = uncounted(actions), uncounted(idle), uncounted(figures)
    parts = len(turns) - 1  # whose turns are counted; the last number is that of the worlds done
    share = -(-(last - first) // (parts * TOGETHER)) * TOGETHER
    for k in range(parts):
        part, turn = (thread + k) % parts, -1
        stop = min(first + (part + 1) * share, last)
        while True:
            turn = add_shared(turns, part, 1) if parts > 1 else turn + 1
            begin = first + part * share + turn * TOGETHER
            if begin >= stop:
                break
            end = min(begin + TOGETHER, stop)
            if len(batch.height) >= MANY:  # asked for now, stepped in the next turn
                for w in range(begin if turn == 0 else end, min(end + TOGETHER, stop)):
                    prefetch_world(batch, w, sight.patch.shape[-1])
            if scratch is not None and phase == ADVANCE:
                space = uncounted(scratch)
                for w in range(begin, end):
                    if not idle[w - base]:
                        _advance(batch, space, actions[w - base], w)
            for w in range(begin, end):
                if not idle[w - base]:
                    if phase <= BOOK:
                        _book(batch, w, figures, w - base)
                    else:
                        for i in range(FIRST_TERM, REWARD + 1):
                            figures[i, w - base] = 0.0
            for w in range(begin, end):
                if not idle[w - base]:
                    _show(batch, w, sight, figures, w - base)
            if parts > 1:
                add_shared(turns, parts, end - begin)
    if parts > 1:
        for _ in range(LOOKS if thread == 0 else 0):
            if read_shared(turns, parts) == last - first:
                return True
    return parts == 1


@kernel
def _advance(batch, space, action, w):
    """What the world's ground and machine do in a step, by its action of three numbers."""
    scene = batch.scenes[w]
    machine = machine_of(scene)
    command = command_of(action[0], action[1], action[2], machine)
    step(
        batch.height[w], at(batch.solid, w), at(batch.outside, w), batch.machine[w], batch.tally[w],
        space.buffers, space.links, space.link_levels, batch.changed[w], batch.pending[w],
        batch.episodes[w].quantum, grid_of(batch, scene), soil_of(scene), blade_of(scene), machine,
        command, scene.period, pull_at(batch.pulls, w), at(batch.grade, w),
        zones_at(batch.zone, batch.soils, batch.zone_pulls, w), bank_at(batch, w),
    )  # fmt: skip


@entry
def take_up(batch: Batch, first: int, last: int) -> None:
    """Measure worlds that have just been put into the batch, from the first row to the last."""
    for w in range(first, last):
        changed = batch.changed[w]
        changed[0], changed[1], changed[2], changed[3] = 0, batch.height.shape[1], 0, batch.height.shape[2]
        _measure(batch, w)


@kernel
def _share(batch, w):
    """Share of the soil that has come to where it belongs."""
    soil = batch.job.soil[w]
    return batch.sums.result[w, 2] / soil if soil > 0.0 else 0.0


@kernel
def _is_finished(batch, w):
    """Whether the job is done: the design surface within its tolerance, or enough of the soil in the goal."""
    scene = batch.scenes[w]
    return batch.sums.result[w, 4] <= scene.tolerance or _share(batch, w) >= scene.success


@kernel
def _measure(batch, w):
    """Measure the job where the ground has changed, and whether it is done."""
    changed = batch.changed[w]
    measure(batch.height[w], job_of(batch, w), batch.scenes[w].cell, changed, sums_of(batch, w), bank_at(batch, w))
    changed[:] = 0
    batch.episodes[w].finished = _is_finished(batch, w)


@kernel
def _book(batch, w, figures, column):
    """Measure the job after a step, add the step's tally to the totals, and write the reward and its terms."""
    scene, episode, tally = batch.scenes[w], batch.episodes[w], batch.tally[w]
    left = batch.sums.result[w]
    before, was_finished = ToDo(left[0], left[1]), episode.finished
    _measure(batch, w)
    totals, scale = episode.totals, episode.scale
    totals.steps += 1
    totals.work += tally.work
    totals.energy += tally.energy
    totals.distance += tally.distance
    totals.lost += tally.lost
    lost = tally.lost / (1.0 + scene.soil.swell)
    terms = reward_terms(
        before,
        ToDo(left[0], left[1]),
        tally.energy,
        lost,
        episode.finished == 1 and was_finished == 0,
        Scale(scale.potential, scale.deep, scale.energy, scale.steps, scale.soil),
    )
    reward = 0.0
    for k in range(len(terms)):
        figures[FIRST_TERM + k, column] = terms[k]
        reward += scene.weights[k] * terms[k]
    figures[REWARD, column] = reward


@kernel
def _draft(pulls, tally):
    """Mean force on the blade over a step [kN]; without traction, over its way."""
    if pulls is not None:
        return 1e-3 * tally.draft
    return 1e-3 * tally.work / tally.distance if tally.distance > 0.0 else 0.0


@kernel
def _show(batch, w, sight, figures, column):
    """Write the numbers of the info, in the order of INFO, and the observation."""
    scene, episode, tally, remaining = batch.scenes[w], batch.episodes[w], batch.tally[w], batch.sums.result[w]
    totals, loose = episode.totals, 1.0 + scene.soil.swell
    lost = totals.lost / loose
    share, time = _share(batch, w), totals.steps * scene.period
    values = (
        share,
        remaining[2],
        remaining[2] * loose,
        remaining[1],
        max(0.0, remaining[3] - episode.start.stray) + lost,
        lost,
        remaining[4],
        1e-3 * totals.work,
        totals.distance,
        time,
        batch.machine[w].load,
        _draft(batch.pulls, tally),
        tally.blocked,
        1e-3 * totals.energy,
        tally.slip,
        float(episode.finished),
    )
    for k in range(len(values)):
        figures[k, column] = values[k]
    observe(
        batch.height[w], job_of(batch, w), batch.machine[w : w + 1], scene.cell, view_of(batch, scene), 1.0 - share,
        max(0.0, 1.0 - time / scene.time), sight_of(sight, column),
    )  # fmt: skip
