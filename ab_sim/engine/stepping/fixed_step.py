"""Fixed steps along a speed profile.

A sample has the columns of ``sample_columns``, the deck's channels, each ball's angle and rate, and
a motor's torque. A *row* is the part from ANGLE to the torque. The sensor readings after it are
filled in by the caller.
"""

import math
from typing import NamedTuple

from ab_sim.base.sample_columns import ANGLE, COMMAND, STEP, TIME
from ab_sim.engine.compiling.kinds import Floats, IntegerTable, Table, call
from ab_sim.engine.events.balls import put_branches
from ab_sim.engine.events.location import check_branches, step_over_events, within_bounds
from ab_sim.engine.events.run import Run, Workspace, evaluate, take_step
from ab_sim.engine.stepping.implicit import implicit_step
from ab_sim.model.dynamics.system import TURNS

FIRST, END, START, OFFSET, LENGTH, PLACE = range(6)
"""Columns of a step plan, with one line per step range:

- FIRST: steps taken before the range.
- END: steps taken after it, including a step that its part completes.
- START: beginning of its profile segment [s].
- OFFSET: offset of a part within its step [s].
- LENGTH: length of each step, or of the part [s].
- PLACE: first of the numbers of the active profile segment, in the order of ``SceneFunctions.c``.
"""
PLACE_UNTIL = 2
"""Position, counted from the last column, of the local time at which the segment ends."""
TWO_PI_REST = 2.4492935982947064e-16
"""Difference of 2 pi and the floating-point number nearest to it."""
DRIFT = 1e-12
"""Deviation of a quaternion's squared norm from 1 at which it is normalised. The equations do not
depend on the norm; only its rounding does."""


class EqualSteps(NamedTuple):
    """Times of consecutive steps of one length.

    Times are products of step and number, not sums, so that they do not depend on how a run is
    divided into calls. The offset is added last, so that a part of microseconds keeps its digits.
    """

    start: float
    """Beginning of the profile segment [s]."""
    first: int
    """Number of steps of the run before these."""
    offset: float
    """Offset of the first step within its nominal step [s]."""
    length: float
    """Length of each step [s]: the nominal length, or part of it next to a breakpoint."""


def advance(
    run: Run, step_plan: Table, at: int, first: int, steps: int, command: float, samples: Table
) -> int:
    """Take steps along a step plan, at most to its end, and record each of them.

    With ``steps`` 0, update only the branches of the set-valued laws. If ``samples`` then has room,
    record the present state instead, without changing anything.

    Parameters
    ----------
    run
        The Run; its arrays change.
    step_plan
        Consecutive step ranges, shape (step ranges, columns as above).
    at
        Index of the step range that contains the first step, or the first of its parts.
    first
        Steps taken before.
    steps
        Number of steps to take.
    command
        Requested speed [rad/s]; NaN for that of the profile.
    samples
        Shape (steps, channels), or more lines; columns as above.

    Returns
    -------
    int
        Number n of steps taken; -1 - n if the state left its bounds in the next one.
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


def steps_in(line: Floats, first: int, remaining: int) -> tuple[int, int]:
    """Return the number of steps to take in a step range, and the number of their samples.

    All parts of a step write the same sample, so that of the last part remains.

    Parameters
    ----------
    line
        Line of the step plan.
    first
        Steps taken before.
    remaining
        Number of steps still to take.
    """
    here = int(min(line[END] - first, float(remaining)))
    return here, max(here, 1) if remaining > 0 else 0


def enter_step_range(run: Run, line: Floats, first: int, only_record: bool) -> EqualSteps:
    """Begin the step range of a step plan's line; ``first`` steps were taken before."""
    if line[START] != run.work.smooth[0] and not only_record:
        # A stepper's memory extrapolates a smooth motion: it is not valid after a kink.
        forget(run.work.memory)
        run.work.smooth[0] = line[START]
    for j in range(PLACE, line.size):
        run.scene.c[run.place + j - PLACE] = line[j]
    call(run.scene.prepare, run.scene.c)
    return EqualSteps(line[START], first, line[OFFSET], line[LENGTH])


def put_labels(run: Run, samples: Table, first: int, command: float) -> None:
    """Fill in STEP and TIME of samples, the first after ``first`` steps; COMMAND unless NaN."""
    for k in range(samples.shape[0]):
        samples[k, STEP] = float(first + k)
        samples[k, TIME] = (first + k) * run.step
        if not math.isnan(command):
            samples[k, COMMAND] = command


def forget(memory: Table) -> None:
    """Set a stepper's memory to zeros, so that the stepper restarts."""
    for i in range(memory.shape[0]):
        for j in range(memory.shape[1]):
            memory[i, j] = 0.0


def profile_time(run: Run, step_range: EqualSteps, done: int) -> float:
    """Return a sample's time since the segment began [s], after ``done`` nominal steps."""
    return (step_range.first + done) * run.step - step_range.start


def local_time(run: Run, step_range: EqualSteps, done: int) -> float:
    """Return the time since the segment began [s], ``done`` nominal steps into a step range."""
    return profile_time(run, step_range, done) + step_range.offset


def time_after(run: Run, step_range: EqualSteps, done: int) -> float:
    """Return the local time [s] after ``done`` steps of a range, which may be part of a step."""
    if done > 0 and step_range.length != run.step:
        return local_time(run, step_range, done - 1) + step_range.length
    return local_time(run, step_range, done)


def step_by_step(run: Run, step_range: EqualSteps, samples: Table, steps: int) -> int:
    """Take steps along one step range, in the profile segment of the scene's constants.

    Parameters
    ----------
    run
        The Run.
    step_range
        The range.
    samples
        Samples whose rows are recorded.
    steps
        Number of steps; with 0, the present state is recorded if ``samples`` has room.

    Returns
    -------
    int
        Number of steps taken; fewer than requested if the state left its bounds.
    """
    work, state, length = run.work, run.state, step_range.length
    only_record = steps == 0 and samples.shape[0] > 0
    end_is_evaluated = False
    put_branches(run.balls)
    for k in range(steps + 1):
        begin = time_after(run, step_range, k)
        # The slope at the end of a step is the first stage of the next (FSAL). It is evaluated
        # again if a branch is in doubt, or if unwinding has changed the state.
        if end_is_evaluated:
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
            end_is_evaluated = step_over_events(run, begin, length, end)
        elif run.is_implicit:
            implicit_step(run.implicit, run, begin, length)
        else:
            take_step(run, begin, length)
        if not within_bounds(work.trial, work.bounds):
            return k
        for j in range(state.size):
            state[j] = work.trial[j]
        if unwind(run):
            end_is_evaluated = False
    return steps


def take_over_end(work: Workspace) -> None:
    """Reuse the slope and event functions at a step's end as those of the next one's start."""
    for j in range(work.slope.size):
        work.slope[j] = work.slope_ahead[j]
    for slot in range(work.value.size):
        work.value[slot] = work.value_ahead[slot]
        work.rate[slot] = work.rate_ahead[slot]
        work.force_rate[0, slot] = work.force_rate[1, slot]
    work.measured[0], work.measured[1] = work.measured[1], 0.0


def record(run: Run, time: float, profile_time: float, sample: Floats) -> None:
    """Record the row of a sample; without events, compute also the slope at the state.

    Parameters
    ----------
    run
        The Run.
    time
        Local time of the state [s].
    profile_time
        Time at which the profile is evaluated [s]. It equals ``time`` up to rounding, except in
        part of a step, where it is the end of the whole step.
    sample
        Sample to fill in.
    """
    c, b, balls = run.scene.c, run.balls.branches, run.balls
    # With events the slope comes from the evaluation, which recording must not overwrite: results
    # must not depend on which samples are recorded.
    slope = run.work.slope_ahead if run.has_events else run.work.slope
    row = sample[ANGLE : sample.size]
    call(run.scene.finish, c, b, run.state, slope, row, time, profile_time)
    for i in range(balls.number):
        row[run.ball_column + 2 * i] += 2.0 * math.pi * balls.discrete[i, TURNS]
    if balls.has_motor:
        sample[ANGLE] += 2.0 * math.pi * balls.discrete[balls.number, TURNS]


def unwind(run: Run) -> bool:
    """Move whole turns of balls and spindle into counters, so that angles keep their precision.

    Returns
    -------
    bool
        Whether the state changed, by that or by normalising a quaternion.
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
    """Normalise the quaternion at index ``first``; return whether it changed."""
    square = _square_of_quaternion(state, first)
    if abs(square - 1.0) <= DRIFT:
        return False
    scale = 1.0 / math.sqrt(square)
    for j in range(first, first + 4):
        state[j] *= scale
    return True


def _square_of_quaternion(state: Floats, first: int) -> float:
    """Return the squared norm of the quaternion at index ``first``."""
    square = 0.0
    for j in range(first, first + 4):
        square += state[j] * state[j]
    return square


def _is_beyond_a_turn(angle: float) -> bool:
    """Return whether an angle [rad] contains a whole turn."""
    return abs(angle) > 2.0 * math.pi


def take_out_turns(state: Floats, at: int, discrete: IntegerTable, i: int) -> bool:
    """Move an angle's whole turns to line i of ``discrete``; return whether there were any.

    The angle is then in -2 pi .. 2 pi. All turns are removed at once: a state from outside may have
    any number of them.
    """
    if not _is_beyond_a_turn(state[at]):
        return False
    turns = int(state[at] / (2.0 * math.pi))
    state[at] = (state[at] - turns * (2.0 * math.pi)) - turns * TWO_PI_REST
    discrete[i, TURNS] += turns
    return True
