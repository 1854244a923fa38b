"""Fixed steps along a speed profile."""

import math
from typing import NamedTuple

from ab_sim.compiling.kinds import Floats, IntegerTable, Table, call
from ab_sim.dynamics.system import TURNS
from ab_sim.events.balls import put_branches
from ab_sim.events.location import check_branches, step_over_events, within_bounds
from ab_sim.events.run import Run, Workspace, evaluate, take_step
from ab_sim.stepping.implicit import implicit_step

FIRST, END, START, OFFSET, LENGTH, PLACE = range(6)
"""Columns of a step plan, a line for each step range: steps taken before it, and after it, with the
step that a part of one ends; when its piece of the profile begins [s]; where a part begins in its
step [s]; length of each of its steps, or of the part [s]; the first of the numbers of its place on
the profile, as they are in ``Scene.c``."""
PLACE_UNTIL = 2
"""Of these, counted from the last one back: when the piece of the profile ends, local time."""
STEP, TIME, ANGLE, SPEED, COMMAND, DECK = range(6)
"""Columns of a sample: how many steps have been taken; time [s]; angle and speed of the spindle
[rad, rad/s]; the speed asked for; the first of the deck's channels. Behind these are each ball's
angle and rate, and a motor's torque: a *row* is a sample from ANGLE on, up to there. Sensors'
readings, behind that, are the caller's."""
TWO_PI_REST = 2.4492935982947064e-16
"""2 pi less the floating-point number nearest to it."""
DRIFT = 1e-12
"""How far from 1 a quaternion's square may drift before it is made a unit one again. Nothing
depends on its length but its own digits."""


class EqualSteps(NamedTuple):
    """Where steps of one length are taken.

    Times are products of step and number, not sums, so that they do not depend on how a run is cut
    up; the offset comes last, so that a piece of microseconds keeps its digits.
    """

    start: float
    """When the piece of the profile begins [s]."""
    first: int
    """Steps taken before."""
    offset: float
    """Of the first into its nominal step [s]."""
    length: float
    """Of each [s]: the nominal one, or a part of it next to a breakpoint."""


def advance(
    run: Run, step_plan: Table, at: int, first: int, steps: int, command: float, samples: Table
) -> int:
    """Take steps along a step plan, or up to its end, recording every one.

    With none, only see to the branches; or, if there is room for a sample, record the state as it
    is, without a change to anything.

    Args:
        run: the Run; its arrays change.
        step_plan: shape (step ranges, columns as above), one after the other.
        at: the step range that the first step lies in, or the first of its parts.
        first: steps taken before.
        steps: how many to take.
        command: speed asked for [rad/s]; if it is no number, that of the profile.
        samples: shape (steps, channels), or more; columns as above.

    Returns:
        How many steps were taken; if the state then left its bounds -1 less as many.
    """
    only_record = steps == 0 and samples.shape[0] > 0
    done, sound = 0, True
    while sound and at < step_plan.shape[0]:
        step_range = enter_step_range(run, step_plan[at], first + done, only_record)
        here, count = steps_in(step_plan[at], first + done, steps - done)
        taken = step_by_step(run, step_range, samples[done : samples.shape[0]], count)
        sound = taken == count
        done += here if sound else taken
        if done == steps:
            break
        at += 1
    put_labels(run, samples, first if only_record else first + 1, command)
    return done if sound else -1 - done


def steps_in(line: Floats, first: int, left: int) -> tuple[int, int]:
    """How many steps to take in a step range, and how many samples these make.

    Part by part of a step makes the same sample, and the last one stays.

    Args:
        line: of the step range.
        first: steps taken before.
        left: how many are wanted.
    """
    here = int(min(line[END] - first, float(left)))
    return here, max(here, 1) if left > 0 else 0


def enter_step_range(run: Run, line: Floats, first: int, only_record: bool) -> EqualSteps:
    """Begin the step range in a line of a step plan, with so many steps taken before."""
    if line[START] != run.work.smooth[0] and not only_record:
        # What a stepper remembers is of no use behind a kink.
        forget(run.work.memory)
        run.work.smooth[0] = line[START]
    for j in range(PLACE, line.size):
        run.scene.c[run.place + j - PLACE] = line[j]
    call(run.scene.prepare, run.scene.c)
    return EqualSteps(line[START], first, line[OFFSET], line[LENGTH])


def put_labels(run: Run, samples: Table, first: int, command: float) -> None:
    """STEP and TIME of samples, the first after so many steps; COMMAND if it is a number."""
    for k in range(samples.shape[0]):
        samples[k, STEP] = float(first + k)
        samples[k, TIME] = (first + k) * run.step
        if not math.isnan(command):
            samples[k, COMMAND] = command


def forget(memory: Table) -> None:
    """What a stepper remembers."""
    for i in range(memory.shape[0]):
        for j in range(memory.shape[1]):
            memory[i, j] = 0.0


def profile_time(run: Run, step_range: EqualSteps, done: int) -> float:
    """Of a sample, since the segment began [s]: after so many nominal steps of a step range."""
    return (step_range.first + done) * run.step - step_range.start


def local_time(run: Run, step_range: EqualSteps, done: int) -> float:
    """Since the segment began [s], so many nominal steps into a step range."""
    return profile_time(run, step_range, done) + step_range.offset


def time_after(run: Run, step_range: EqualSteps, done: int) -> float:
    """The same, but behind so many steps of the range, which may be the one part of a step."""
    if done > 0 and step_range.length != run.step:
        return local_time(run, step_range, done - 1) + step_range.length
    return local_time(run, step_range, done)


def step_by_step(run: Run, step_range: EqualSteps, samples: Table, steps: int) -> int:
    """Take steps along one step range, where the scene's constants say that it lies.

    Args:
        run: the Run.
        step_range: the range.
        samples: of which the rows are recorded.
        steps: how many; with none, samples may have room for the state as it is.

    Returns:
        How many were taken; fewer than asked for if the state left its bounds.
    """
    work, state, length = run.work, run.state, step_range.length
    only_record = steps == 0 and samples.shape[0] > 0
    known = False
    put_branches(run.balls)
    for k in range(steps + 1):
        begin = time_after(run, step_range, k)
        # The slope at the end of a step is the first stage of the next.
        if known:
            take_over_end(work)
        elif run.has_events:
            evaluate(run, begin, state, work.slope)
            if not only_record:
                check_branches(run, begin)
        if k > 0:
            record(run, begin, profile_time(run, step_range, k), samples[k - 1])
        elif only_record or (steps > 0 and not run.has_events):
            record(run, begin, begin, samples[0])
        if k == steps:
            break
        if run.has_events:
            end = time_after(run, step_range, k + 1)
            known = step_over_events(run, begin, length, end)
        elif run.is_implicit:
            implicit_step(run.implicit, run, begin, length)
        else:
            take_step(run, begin, length)
        if not within_bounds(work.trial, work.bounds):
            return k
        for j in range(state.size):
            state[j] = work.trial[j]
        if unwind(run):
            known = False
    return steps


def take_over_end(work: Workspace) -> None:
    """What is known of a step's end is so of the next one's start."""
    for j in range(work.slope.size):
        work.slope[j] = work.slope_ahead[j]
    for slot in range(work.value.size):
        work.value[slot] = work.value_ahead[slot]
        work.rate[slot] = work.rate_ahead[slot]
        work.force_rate[0, slot] = work.force_rate[1, slot]
    work.measured[0], work.measured[1] = work.measured[1], 0.0


def record(run: Run, time: float, profile_time: float, sample: Floats) -> None:
    """The row of a sample; without events also the slope at the state.

    Args:
        run: the Run.
        time: local time of the state [s].
        profile_time: the time at which to look on the profile: the same but for rounding, or where
            a step ends of which this is a part.
        sample: where the row goes.
    """
    c, b, balls = run.scene.c, run.balls.branches, run.balls
    # With events the slope is the evaluation's: not a digit may depend on whether all is recorded.
    slope = run.work.slope_ahead if run.has_events else run.work.slope
    row = sample[ANGLE : sample.size]
    call(run.scene.finish, c, b, run.state, slope, row, time, profile_time)
    for i in range(balls.number):
        row[run.ball_column + 2 * i] += 2.0 * math.pi * balls.discrete[i, TURNS]
    if balls.has_motor:
        row[0] += 2.0 * math.pi * balls.discrete[balls.number, TURNS]


def unwind(run: Run) -> bool:
    """Count whole turns of balls and spindle apart: an angle keeps its digits for ever.

    Returns:
        Whether that, or a quaternion made a unit one, has changed the state.
    """
    balls, state = run.balls, run.state
    changed = run.quaternion >= 0 and normalise(state, run.quaternion)
    for i in range(balls.number):
        if take_out_turns(state, balls.first_angle + i, balls.discrete, i):
            changed = True
    if balls.has_motor and take_out_turns(state, balls.spindle, balls.discrete, balls.number):
        changed = True
    return changed


def normalise(state: Floats, first: int) -> bool:
    """Make the quaternion there a unit one again; whether it was none."""
    square = square_of_quaternion(state, first)
    if abs(square - 1.0) <= DRIFT:
        return False
    scale = 1.0 / math.sqrt(square)
    for j in range(first, first + 4):
        state[j] *= scale
    return True


def square_of_quaternion(state: Floats, first: int) -> float:
    """Of its length."""
    square = 0.0
    for j in range(first, first + 4):
        square += state[j] * state[j]
    return square


def is_beyond_a_turn(angle: float) -> bool:
    """Whether an angle [rad] has a whole turn in it that is to be counted apart."""
    return abs(angle) > 2.0 * math.pi


def take_out_turns(state: Floats, at: int, discrete: IntegerTable, i: int) -> bool:
    """Bring one angle back into -2 pi .. 2 pi, counting on line i; whether it was not there.

    All turns are taken out together: a state from outside may have any number of them.
    """
    if not is_beyond_a_turn(state[at]):
        return False
    turns = int(state[at] / (2.0 * math.pi))
    state[at] = (state[at] - turns * (2.0 * math.pi)) - turns * TWO_PI_REST
    discrete[i, TURNS] += turns
    return True
