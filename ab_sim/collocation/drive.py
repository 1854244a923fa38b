"""Collocation along a speed profile, in steps of its own, the scene's steps being samples in them.

How long a step is follows from the motion: of the scene's steps it goes over one or several, or
down to a 1024th of one; one that leaves too large an error, or whose iteration does not come to an
end, is made shorter; and after one whose error is far enough below what is asked the next is
longer. Behind a kink of the motion, where there is no step to carry on, the first one is short
beside the spindle's turns and the deck's cycles, as is fit for what decays after a jump.

Steps follow one another from the last kink on, wherever the samples that are asked for end: a step
belongs to the state, with how many of its samples have been taken. A command in the middle of one
drops the rest of it, and the next begins at the very sample that was the present. No step goes
beyond the end of a piece of the speed profile.
"""

import math

from ab_sim.collocation.event_fallback import (
    before_events,
    give_up,
    keep_good,
    look_at_branches,
    steps_due,
    take_steps,
)
from ab_sim.collocation.nodes import PIECES
from ab_sim.collocation.run import (
    GOOD,
    INSIDE,
    PROFILE_TIME,
    STEP,
    STRIDE,
    TAKEN,
    CollocationRun,
    head_of,
)
from ab_sim.collocation.step import first_step_size, go_to_end, next_after, put_states, try_step
from ab_sim.compiling.kinds import Table, call
from ab_sim.dynamics.system import TURNS
from ab_sim.events.balls import put_branches
from ab_sim.integrate.steppers.collocation import PARTS
from ab_sim.stepping.fixed_step import (
    ANGLE,
    PLACE_UNTIL,
    EqualSteps,
    enter_step_range,
    has_turns_to_unwind,
    local_time,
    put_labels,
    step_by_step,
    steps_in,
    unwind,
)


def advance_by_collocation(
    own: CollocationRun,
    step_plan: Table,
    at: int,
    first: int,
    steps: int,
    command: float,
    samples: Table,
) -> int:
    """See ``fixed_step.advance``."""
    only_record = steps == 0 and samples.shape[0] > 0
    done, sound = 0, True
    while sound and at < step_plan.shape[0]:
        step_range = enter_step_range(own.run, step_plan[at], first + done, only_record)
        here, count = steps_in(step_plan[at], first + done, steps - done)
        until = step_plan[at, step_plan.shape[1] - PLACE_UNTIL]
        taken = collocate(own, step_range, until, samples[done : samples.shape[0]], count)
        sound = taken == count
        done += here if sound else taken
        if done == steps:
            break
        at += 1
    put_labels(own.run, samples, first if only_record else first + 1, command)
    return done if sound else -1 - done


def collocate(
    own: CollocationRun, step_range: EqualSteps, until: float, samples: Table, steps: int
) -> int:
    """See ``fixed_step.step_by_step``; ``until``: local time at which the profile's piece ends."""
    run, head = own.run, head_of(own)
    if steps == 0:
        if samples.shape[0] > 0:
            step_by_step(run, step_range, samples, 0)
        elif head[STEP] != step_range.length:
            look_at_branches(own, step_range, samples)
        return 0
    put_branches(run.balls)
    done, written = 0, 0
    while written < steps:
        if done == steps:
            write(own, step_range, samples, written, done)
            written = done
            continue
        if head[TAKEN] == head[GOOD] or head[STEP] != step_range.length:
            now = EqualSteps(
                step_range.start, step_range.first + done, step_range.offset, step_range.length
            )
            due = min(steps_due(own, step_range.length), steps - done)
            anew = due > 0 or head[STEP] != step_range.length
            if written < done and (anew or has_turns_to_unwind(run)):
                write(own, step_range, samples, written, done)
                written = done
            if due > 0:
                taken = take_steps(own, now, samples[done : samples.shape[0]], due)
                done += taken
                written = done
                if taken < due:
                    return done
                continue
            unwind(run)
            if anew:
                look_at_branches(own, now, samples)
            if not take_step(own, now, until):
                if written < done:
                    write(own, step_range, samples, written, done)
                    written = done
                if give_up(own):
                    continue
                for j in range(run.state.size):
                    run.work.trial[j] = math.nan
                return done
            if head[GOOD] == 0.0:
                continue
        more, sound = take_samples(own, steps, done, written)
        if more == 0 and sound:
            write(own, step_range, samples, written, done)
            written = done
            continue
        done += more
        if not sound:
            write(own, step_range, samples, written, done)
            return done
    return done


def take_samples(own: CollocationRun, steps: int, done: int, written: int) -> tuple[int, bool]:
    """States at the next samples of the step in memory, behind those that are not written yet.

    Args:
        own: the Collocation.
        steps: how many are asked for.
        done: how many have been taken.
        written: how many of these have been written.

    Returns:
        How many more: none if there is no room. And whether the state is within its bounds behind
        them.
    """
    run, head, buffers = own.run, head_of(own), own.buffers
    count, states = own.method.nodes.at.size, run.state.size
    taken, room = int(head[TAKEN]), done - written
    group, lane = taken // count, taken % count
    end = min(min(taken + steps - done, int(head[GOOD])), (group + 1) * count)
    if room + end - taken > count:
        return 0, True
    # Lanes before this one, if any, are samples that are there already, or lie before the first.
    line, first = STRIDE * count, count + room
    put_states(own, group, buffers.states[first - lane : buffers.states.size])
    sound, inside = True, (states + INSIDE) * line + first
    for k in range(end - taken):
        if not buffers.states[inside + k] > 0.0:
            end, sound = taken + k, False
            break
    for j in range(states):
        if not sound:
            run.work.trial[j] = buffers.states[j * line + first + end - taken]
        if end > taken:
            run.state[j] = buffers.states[j * line + first + end - taken - 1]
    head[TAKEN] = float(end)
    return end - taken, sound


def write(
    own: CollocationRun, step_range: EqualSteps, samples: Table, written: int, done: int
) -> None:
    """Rows of the states that have been taken but not written: N cost what one does."""
    run, buffers, count = own.run, own.buffers, own.method.nodes.at.size
    balls, states, line = run.balls, buffers.states, STRIDE * count
    first = run.state.size * line + count
    for k in range(done - written):
        end = (step_range.first + written + k + 1) * run.step - step_range.start
        states[first + PROFILE_TIME * line + k] = end
    for i in range(balls.number + 1):
        buffers.turns[i] = float(balls.discrete[i, TURNS])
    if done > written:
        times, begin = states[first : states.size], states[count : states.size]
        row = samples[written][ANGLE : samples.shape[1]]
        width, new = float(samples.shape[1]), float(done - written)
        c, b = run.scene.c, balls.branches
        call(own.functions.rows, c, b, times, begin, buffers.turns, row, width, new)


def take_step(own: CollocationRun, step_range: EqualSteps, until: float) -> bool:
    """The next step, or the steps that make up one of the scene's, the last of which stays.

    Args:
        own: the Collocation.
        step_range: from the present on.
        until: local time at which the profile's piece ends [s].

    Returns:
        Whether there is such a step.
    """
    run, length = own.run, step_range.length
    begin, trial = local_time(run, step_range, 0), run.work.trial
    whole = (until - begin) / length + 1e-6 if length == run.step else 1.0
    for j in range(run.state.size):
        trial[j] = run.state[j]
    size, done = first_step_size(own, begin, length, whole), 0
    while done < PARTS:
        size, error, within = try_step(own, begin + (done / PARTS) * length, length, size)
        if size == 0:
            return False
        done += size
        good, samples = before_events(own), max(1, size // PARTS)
        size = next_after(own, size, error, within)
        if done >= PARTS:
            keep_good(own, good * samples // PIECES)
        elif good < PIECES:
            keep_good(own, 0)
            return True
        else:
            go_to_end(own)
            while size > (done & -done):
                size //= 2
    return True
