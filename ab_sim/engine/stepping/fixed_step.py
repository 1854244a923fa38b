"""Steps of a fixed length along a speed profile, and the samples at their ends.

A sample has the columns of ``sample_columns``, the deck's channels, each ball's angle and rate, and
a motor's torque. A *row* is the part from ANGLE to the torque. The sensor readings after it are
filled in by the caller.
"""

import math
from typing import NamedTuple

from ab_sim.base.sample_columns import ANGLE
from ab_sim.engine.compiling.kinds import Floats, IntegerTable, Table, call
from ab_sim.engine.events.balls import put_branches
from ab_sim.engine.events.location import check_branches, step_over_events, within_bounds
from ab_sim.engine.events.run import Run, Workspace, evaluate, take_step
from ab_sim.engine.stepping.plan import EqualSteps
from ab_sim.model.dynamics.system import TURNS

TWO_PI_REST = 2.4492935982947064e-16
"""2 pi minus the floating-point number nearest to 2 pi [rad]."""
DRIFT = 1e-12
"""Deviation of a quaternion's squared norm from 1 at which it is normalised. The equations do not
depend on the norm; only its rounding does."""


class FixedSteps(NamedTuple):
    """Run with steps of an explicit method, cut at events where there are set-valued laws."""

    run: Run

    def begin(self, steps: EqualSteps, count: int, samples: Table) -> None:
        """Evaluate the equations at the present state: see ``advance.Method``."""
        begin_range(self.run, steps.time_after(0), count, samples)

    def take(self, steps: EqualSteps, k: int, sample: Floats) -> bool:
        """Take and record the k-th step: see ``advance.Method``."""
        run, is_evaluated = self.run, False
        if run.has_events:
            begin, end = steps.time_after(k), steps.time_after(k + 1)
            is_evaluated = step_over_events(run, begin, steps.length, end)
        else:
            take_step(run, steps.time_after(k), steps.length)
        return complete_step(run, steps, k + 1, is_evaluated, sample)


def begin_range(run: Run, time: float, count: int, samples: Table) -> None:
    """Evaluate the equations at the present state and local time [s], where ``count`` steps begin.

    If no step begins, and ``samples`` has room, record the state without changing anything.
    """
    only_record = count == 0 and samples.shape[0] > 0
    put_branches(run.balls)
    if run.has_events:
        evaluate(run, time, run.state, run.work.slope)
        if not only_record:
            check_branches(run, time)
    # Without events, recording also computes the slope, the first stage of the first step.
    if samples.shape[0] > 0 and (only_record or not run.has_events):
        record(run, time, time, samples[0])


def complete_step(
    run: Run, steps: EqualSteps, done: int, is_evaluated: bool, sample: Floats
) -> bool:
    """Accept the trial state after ``done`` steps, and record it; return False if out of bounds.

    ``is_evaluated`` tells whether the workspace holds slope and event functions at that state.
    """
    work, state, time = run.work, run.state, steps.time_after(done)
    if not within_bounds(work.trial, work.bounds):
        return False
    for j in range(state.size):
        state[j] = work.trial[j]
    changed = unwind(run)
    # The slope at the end of a step is the first stage of the next (FSAL). It is evaluated again if
    # a branch is in doubt, or if unwinding has changed the state.
    if is_evaluated and not changed:
        take_over_end(work)
    elif run.has_events:
        evaluate(run, time, state, work.slope)
        check_branches(run, time)
    record(run, time, steps.profile_time(done), sample)
    return True


def take_over_end(work: Workspace) -> None:
    """Reuse slope and event functions at a step's end as the values at the next step's start."""
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
