"""Taylor steps along a speed profile, of one run or of eight; the scene's steps are samples.

Steps do not depend on how a run is divided into calls: the beginning of the current step and the
state there are in the run's memory, and the step's series is computed from them. No step extends
beyond the end of a profile segment. After a kink or a command, the next step begins at the present
sample.

Eight runs, one per SIMD lane, choose their own step lengths. They take steps together, then all
samples that fall within these steps. A run with longer steps therefore gets ahead of the others.
Runs wait for each other only at the end of a row of the plan.
"""

from typing import NamedTuple

from ab_sim.base.sample_columns import ANGLE
from ab_sim.engine.compiling.kinds import Floats, Table, call
from ab_sim.engine.events.run import Run
from ab_sim.engine.stepping import side_by_side as lanes
from ab_sim.engine.stepping.fixed_step import (
    PLACE_UNTIL,
    EqualSteps,
    enter_step_range,
    local_time,
    put_labels,
    step_by_step,
    steps_in,
)
from ab_sim.engine.stepping.side_by_side import LanePlan, LaneSamples
from ab_sim.engine.taylor.clock import (
    BEGIN,
    COUNT,
    COUNT_DUE,
    COUNT_LEFT,
    ENDS_STEPS,
    FIRST,
    LENGTH,
    LOCAL,
    NEXT,
    OFFSET,
    RESTART,
    SOUND,
    START,
    STEP,
    STRIDE,
    TAKEN,
    TO,
    UNTIL,
    WHERE,
)
from ab_sim.model.dynamics.system import TURNS

_VALID, _BEGAN, STATE = 0, 1, 2
"""Indices in ``Workspace.memory``: flag, 1 if the memory is valid; beginning of the step [s]; the
first number of the state there, followed by the turns removed from it."""


class TaylorRuns(NamedTuple):
    """Runs along one profile each; the last axis of each array runs over them.

    Functions are addresses of machine code.
    """

    prepare: int
    """Function prepare(c), which computes derived constants."""
    coefficients: int
    move: int
    mark: int
    sample: int
    record: int
    record_dense: int
    """Functions of ``ab_sim.engine.taylor``; the last two are 0 for a single run."""
    c: Table
    """Constants, shape (constants, runs)."""
    b: Table
    """Branches of set-valued laws; none are used."""
    place: int
    """Index in c of the first number of the active profile segment."""
    clock: Table
    """Lines of ``ab_sim.engine.taylor.clock``, shape (lines, runs)."""
    y: Table
    """State at the step's beginning, shape (states, runs)."""
    turns: Table
    """Turns removed from the balls' angles until then, shape (n, runs)."""
    series: Floats
    """Taylor coefficients of the state at the step's beginning."""
    state: Table
    """State at the current sample, shape (states, runs)."""
    bounds: Table
    """Magnitudes of the states beyond which a run counts as diverged, shape (states, runs)."""
    status: Table
    """Flags and counts of each run, shape (STATUS_LINES, runs), lines as in ``clock``."""
    row: Table
    """Row of the current sample, shape (numbers, runs)."""
    nowhere: Floats
    """Memory for samples that are not recorded, so that recording needs no branch."""
    sound: Floats
    """Line ``SOUND_STEPS`` of the table ``status``, shape (runs,)."""


class TaylorRun(NamedTuple):
    """Run of one drive by Taylor's method."""

    run: Run
    arrays: TaylorRuns
    """Arrays of this run; its state and turns are views of ``run``'s memory."""


def renew(runs: TaylorRuns) -> None:
    """Begin each run's next step at TO; a run whose TO equals BEGIN keeps its step.

    The state comes from the series, or from the current sample where RESTART is set. A run that
    keeps its step gets the same series again: all lanes compute, as SIMD code has no branches.
    """
    call(runs.move, runs.c, runs.b, runs.clock, runs.series, runs.state, runs.y, runs.turns)
    _expand(runs)


def _expand(runs: TaylorRuns) -> None:
    """Compute the series of each run at its step's beginning, and the step's end."""
    call(runs.coefficients, runs.c, runs.b, runs.clock, runs.y, runs.series)


def _set_first_sample(runs: TaylorRuns, lane: int) -> None:
    """Set the time of the first sample of a run's range, as in ``fixed_step.time_after``.

    A run without a step in the range keeps its current sample.
    """
    clock = runs.clock
    first, step, length = clock[FIRST, lane], clock[STEP, lane], clock[LENGTH, lane]
    clock[TAKEN, lane] = 0.0
    if length == 0.0:
        clock[NEXT, lane] = clock[LOCAL, lane]
    elif length == step:
        clock[NEXT, lane] = (first + 1.0) * step - clock[START, lane] + clock[OFFSET, lane]
    else:
        clock[NEXT, lane] = first * step - clock[START, lane] + clock[OFFSET, lane] + length


def _next_samples(runs: TaylorRuns, row: Floats) -> bool:
    """Compute state and row at the next sample of each run that has one in its current step.

    Parameters
    ----------
    runs
        The runs; those with a sample are marked on their clock.
    row
        Rows to fill in.

    Returns
    -------
    bool
        Whether any run had a sample; if not, all samples of the range have been taken.
    """
    c, b, clock, signals = runs.c, runs.b, runs.clock, runs.status
    # Samples within the current steps need no new series. Only when no run has one left does each
    # run take its next step.
    while True:
        call(runs.mark, c, b, clock, signals)
        if signals[COUNT_DUE, 0] > 0.0:
            series, turns, bounds = runs.series, runs.turns, runs.bounds
            call(runs.sample, c, b, clock, series, turns, bounds, runs.state, signals, row)
            return True
        if signals[COUNT_LEFT, 0] == 0.0:
            return False
        renew(runs)


def advance_by_taylor(
    one: TaylorRun,
    step_plan: Table,
    at: int,
    first: int,
    steps: int,
    command: float,
    samples: Table,
) -> int:
    """Take steps along a step plan by Taylor's method: see ``fixed_step.advance``."""
    run = one.run
    only_record = steps == 0 and samples.shape[0] > 0
    done, sound = 0, True
    while sound and at < step_plan.shape[0]:
        step_range = enter_step_range(run, step_plan[at], first + done, only_record)
        here, count = steps_in(step_plan[at], first + done, steps - done)
        if count > 0:
            begin(one, step_range, step_plan[at, step_plan.shape[1] - PLACE_UNTIL], count)
            taken = _take_range(one, samples[done : samples.shape[0]], count)
        else:
            taken = step_by_step(run, step_range, samples, 0)
        sound = taken == count
        done += here if sound else taken
        if done == steps:
            break
        at += 1
    put_labels(run, samples, first if only_record else first + 1, command)
    return done if sound else -1 - done


def begin(one: TaylorRun, step_range: EqualSteps, until: float, count: int) -> None:
    """Continue the step in memory; without one, begin a step at the present state.

    Parameters
    ----------
    one
        The run.
    step_range
        Range of the scene's steps to take.
    until
        Local time at which the segment of the schedule ends [s].
    count
        Number of the scene's steps to take.
    """
    run, lane_runs = one.run, one.arrays
    clock, memory, balls = lane_runs.clock, run.work.memory, run.balls
    clock[START, 0], clock[OFFSET, 0] = step_range.start, step_range.offset
    clock[LENGTH, 0], clock[UNTIL, 0] = step_range.length, until
    clock[FIRST, 0], clock[COUNT, 0] = float(step_range.first), float(count)
    if memory[0, _VALID] == 0.0:
        for j in range(run.state.size):
            lane_runs.state[j, 0] = run.state[j]
        for i in range(balls.number):
            lane_runs.turns[i, 0] = float(balls.discrete[i, TURNS])
        clock[RESTART, 0], clock[TO, 0] = 1.0, local_time(run, step_range, 0)
        renew(lane_runs)
    else:
        # Memory has the step's begin and the state there, but no series. The same state gives the
        # same series to the last bit.
        clock[BEGIN, 0] = memory[0, _BEGAN]
        _expand(lane_runs)
    clock[LOCAL, 0] = clock[BEGIN, 0]
    _set_first_sample(lane_runs, 0)


def _take_range(one: TaylorRun, samples: Table, count: int) -> int:
    """Take the steps of a range; return their number, fewer if the state left its bounds."""
    run, lane_runs, balls = one.run, one.arrays, one.run.balls
    for done in range(count):
        _next_samples(lane_runs, samples[done, ANGLE:])
        if lane_runs.status[SOUND, 0] == 0.0:
            lane_runs.status[SOUND, 0] = 1.0
            for j in range(run.state.size):
                run.work.trial[j] = lane_runs.state[j, 0]
            return done
        for j in range(run.state.size):
            run.state[j] = lane_runs.state[j, 0]
        for i in range(balls.number):
            balls.discrete[i, TURNS] = int(lane_runs.turns[i, 0])
    run.work.memory[0, _VALID], run.work.memory[0, _BEGAN] = 1.0, lane_runs.clock[BEGIN, 0]
    return count


PAGE = 512
"""Doubles per page of memory."""


def advance_by_taylor_side_by_side(runs: TaylorRuns, plan: LanePlan, samples: LaneSamples) -> None:
    """Take Taylor steps along a plan: see ``stepping.side_by_side.advance_side_by_side``."""
    clock = runs.clock
    touch(samples.numbers)
    for lane in range(runs.sound.size):
        clock[WHERE, lane] = float(lane * samples.run)
        clock[STRIDE, lane] = float(samples.sample)
    for s in range(plan.rows.shape[0]):
        enter(runs, plan, s)
        while _next_samples(runs, runs.row[0]):
            if plan.rows[s, lanes.FINISHES] != 0:
                record(runs, samples)


def touch(numbers: Floats) -> None:
    """Write to each page of new memory, which the operating system maps at its first use.

    This is done beforehand, because page faults between steps would evict code and series from the
    caches.
    """
    for k in range(0, numbers.size, PAGE):
        numbers[k] = 0.0


def enter(runs: TaylorRuns, plan: LanePlan, s: int) -> None:
    """Begin a row of a plan: continue the current steps, or restart where a segment begins."""
    clock, last = runs.clock, plan.places.shape[1]
    any_restart = False
    for lane in range(runs.sound.size):
        start, offset = plan.times[s, lanes.START, lane], plan.times[s, lanes.OFFSET, lane]
        if s == 0 or start != clock[START, lane]:
            any_restart = True
            since = plan.rows[s, lanes.FIRST] * clock[STEP, lane] - start
            clock[RESTART, lane], clock[TO, lane] = 1.0, since + offset
            clock[LOCAL, lane] = clock[TO, lane]
            clock[UNTIL, lane] = plan.places[s, last - PLACE_UNTIL, lane]
            for j in range(last):
                runs.c[runs.place + j, lane] = plan.places[s, j, lane]
        else:
            clock[TO, lane] = clock[BEGIN, lane]
        length = plan.times[s, lanes.LENGTH, lane]
        clock[START, lane], clock[OFFSET, lane], clock[LENGTH, lane] = start, offset, length
        clock[ENDS_STEPS, lane] = float(plan.rows[s, lanes.FINISHES])
        clock[FIRST, lane] = float(plan.rows[s, lanes.FIRST])
        steps = plan.rows[s, lanes.STEPS] if length > 0.0 else plan.rows[s, lanes.FINISHES]
        clock[COUNT, lane] = float(steps)
        _set_first_sample(runs, lane)
    if any_restart:
        call(runs.prepare, runs.c)
        renew(runs)


def record(runs: TaylorRuns, samples: LaneSamples) -> None:
    """Write the current rows as samples of the runs that have one due."""
    c, b, clock, row, channel = runs.c, runs.b, runs.clock, runs.row, float(samples.channel)
    if samples.channel == 1:
        call(runs.record_dense, c, b, clock, row, samples.numbers, runs.nowhere, channel)
    else:
        call(runs.record, c, b, clock, row, samples.numbers, runs.nowhere, channel)
