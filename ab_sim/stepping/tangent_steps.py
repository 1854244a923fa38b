"""Fixed steps along a speed profile, and with them what parameters change of every state.

In the subset of Python that ``ab_sim.compiling`` translates. The state goes as in ``fixed_step``,
to the bit.
"""

import math

from ab_sim.compiling.kinds import Table, call
from ab_sim.events.balls import put_branches
from ab_sim.events.location import check_branches, within_bounds
from ab_sim.events.run import evaluate, take_step
from ab_sim.stepping.fixed_step import (
    DRIFT,
    END,
    FIRST,
    EqualSteps,
    enter_step_range,
    local_time,
    profile_time,
    put_labels,
    record,
    square_of_quaternion,
    take_over_end,
    time_after,
    unwind,
)
from ab_sim.stepping.tangent_events import step_over_events_with_tangents
from ab_sim.stepping.tangent_functions import touch_anyhow
from ab_sim.stepping.tangents import Tangents, carry, copy, hold_stuck, of_block, put_yields

BEGIN, LENGTH, LATER, LEAVE, PLACE_CHANGE = range(5)
"""Lines of a step range's changes: of the local time at which its first step begins, and of that
step's length; of the local time of all others, and of samples; of the time at which it ends, where
that is a breakpoint just at a step's end; the first of the numbers of its place on the profile."""


def advance_with_tangents(
    own: Tangents,
    step_plan: Table,
    plan_changes: Table,
    at: int,
    first: int,
    steps: int,
    samples: Table,
) -> int:
    """``fixed_step.advance`` without commands, and the changes with it.

    Args:
        own: what steps; its arrays change.
        step_plan: as there.
        plan_changes: of each line of it and each block the lines above, for each column; shape
            (lines * blocks * (4 + numbers of the place), lanes).
        at, first, steps, samples: as there.

    Returns:
        As there; fewer steps than asked for, too, where ``trouble`` says why.
    """
    run, done, sound = own.run, 0, True
    fields = plan_changes.shape[0] // (step_plan.shape[0] * own.blocks)
    while sound and at < step_plan.shape[0]:
        number = first + done
        step_range = enter_step_range(run, step_plan[at], number, False)
        block_lines = own.blocks * fields
        changes = plan_changes[at * block_lines : (at + 1) * block_lines]
        enter(own, changes)
        here = int(min(step_plan[at, END] - number, float(steps - done)))
        ends = here > 0
        fresh = step_plan[at, FIRST] == number
        count = max(here, 1)
        taken = steps_with_tangents(
            own, step_range, changes, samples[done : samples.shape[0]], count, fresh, ends
        )
        sound = taken == count
        done += here if sound else taken
        if own.trouble[0] != 0:
            break
        if sound and (step_plan[at, END] == first + done or not ends):
            leave(own, changes)
        if done == steps and ends:
            break
        at += 1
    put_labels(run, samples, first + 1, math.nan)
    return done if sound else -1 - done


def enter(own: Tangents, changes: Table) -> None:
    """Begin a step range: how its place on the profile changes."""
    for block in range(own.blocks):
        place = of_block(own, own.constants, block)[own.run.place :]
        copy(of_block(own, changes, block)[PLACE_CHANGE:], place)


def leave(own: Tangents, changes: Table) -> None:
    """End a step range whose end moves, though steps end there whatever it does."""
    moves = False
    for block in range(own.blocks):
        moved = of_block(own, changes, block)[LEAVE]
        for lane in range(own.lanes):
            moves = moves or moved[lane] != 0.0
    if not moves:
        return
    c, b = own.run.scene.c, own.run.balls.branches
    call(own.slope, c, b, own.run.state, own.slopes[0], own.time[0])
    for block in range(own.blocks):
        change, moved = of_block(own, own.change, block), of_block(own, changes, block)[LEAVE]
        for j in range(change.shape[0]):
            for lane in range(own.lanes):
                change[j, lane] += moved[lane] * own.slopes[0, j]


def steps_with_tangents(
    own: Tangents,
    step_range: EqualSteps,
    changes: Table,
    samples: Table,
    steps: int,
    fresh: bool,
    ends: bool,
) -> int:
    """``fixed_step.step_by_step``, and the changes with it.

    Args:
        own: what steps.
        step_range: along which.
        changes: of it.
        samples: as there.
        steps: how many, at least one.
        fresh: whether the first is the range's first.
        ends: whether its steps end at samples; a part of a step may not.
    """
    run = own.run
    work, state, length = run.work, run.state, step_range.length
    known = False
    put_branches(run.balls)
    if fresh and step_range.first == 0 and run.balls.has_contact:
        begin = local_time(run, step_range, 0)
        evaluate(run, begin, state, work.slope)
        if not touch_anyhow(own, begin):
            return 0
    for k in range(steps + 1):
        begin = time_after(run, step_range, k)
        on_profile = profile_time(run, step_range, k)
        if known:
            take_over_end(work)
        elif run.has_events:
            evaluate(run, begin, state, work.slope)
            check_branches(run, begin)
            hold_stuck(own)
        number = step_range.first + k
        if k > 0:
            record(run, begin, on_profile, samples[k - 1])
        elif not run.has_events:
            record(run, begin, begin, samples[0])
        own.time[0] = begin
        if (k > 0 and ends) or number == 0:
            put_row_change(own, changes, number, begin, on_profile)
        if k == steps:
            break
        set_step(own, changes, fresh and k == 0)
        if run.has_events:
            end = time_after(run, step_range, k + 1)
            known = step_over_events_with_tangents(own, begin, length, end)
            if own.trouble[0] != 0:
                own.trouble[2] = number
                return k
        else:
            carry(own, begin, length)
            take_step(run, begin, length)
        if not within_bounds(work.trial, work.bounds):
            return k
        for j in range(state.size):
            state[j] = work.trial[j]
        normalise_change(own)
        if unwind(run):
            known = False
    return steps


def set_step(own: Tangents, changes: Table, first: bool) -> None:
    """How the next step's beginning and its length change."""
    for block in range(own.blocks):
        lines = of_block(own, changes, block)
        for lane in range(own.lanes):
            own.begin[block, lane] = lines[BEGIN if first else LATER, lane]
            own.length[block, lane] = lines[LENGTH, lane] if first else 0.0


def put_row_change(
    own: Tangents, changes: Table, number: int, begin: float, on_profile: float
) -> None:
    """The changes of the sample at hand, if they are wanted."""
    if own.wanted[own.cursor[0]] != number:
        return
    run, size = own.run, own.run.state.size
    put_yields(own)
    own.time[0], own.time[1] = begin, on_profile
    for block in range(own.blocks):
        copy(of_block(own, own.change, block), own.along)
        moved = of_block(own, changes, block)[LATER]
        for lane in range(own.lanes):
            own.along[size, lane] = own.along[size + 1, lane] = moved[lane]
        first = (own.cursor[0] * own.blocks + block) * own.channels
        yields, constants = of_block(own, own.yields, block), of_block(own, own.constants, block)
        row = own.row_change[first : first + own.channels]
        c, b, time = run.scene.c, run.balls.branches, own.time
        call(own.change_row, c, b, time, run.state, own.along, constants, yields, row)
    own.cursor[0] += 1


def normalise_change(own: Tangents) -> None:
    """What making a quaternion a unit one, which ``unwind`` is about to do, makes of changes."""
    state, first = own.run.state, own.run.quaternion
    if first < 0:
        return
    square = square_of_quaternion(state, first)
    if abs(square - 1.0) <= DRIFT:
        return
    scale = 1.0 / math.sqrt(square)
    for block in range(own.blocks):
        change = of_block(own, own.change, block)
        for lane in range(own.lanes):
            along = 0.0
            for j in range(first, first + 4):
                along += state[j] * change[j, lane]
            for j in range(first, first + 4):
                change[j, lane] = scale * (change[j, lane] - state[j] * along / square)
