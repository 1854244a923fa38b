"""Taylor steps along a speed profile, of one run or of eight; the scene's steps are samples.

Steps do not depend on how a run is divided into calls: the beginning of the current step and the
state there are in the run's memory, and the step's series is computed from them. No step extends
beyond the end of a profile segment. After a kink or a command, the next step begins at the present
sample. The loops over samples are those over the scene's steps in ``stepping.advance``.

Eight runs, one per SIMD lane, choose their own step lengths. They take steps together, then all
samples that fall within these steps. A run with longer steps therefore gets ahead of the others.
Runs wait for each other only at the end of a row of the plan.
"""

from typing import NamedTuple

from ab_sim.base.sample_columns import ANGLE
from ab_sim.engine.compiling.kinds import Floats, Table, call
from ab_sim.engine.events.run import Run
from ab_sim.engine.stepping.fixed_step import begin_range
from ab_sim.engine.stepping.plan import EqualSteps, LanePlan
from ab_sim.engine.stepping.side_by_side import LaneSamples, put_segment
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
    TAKEN,
    TO,
    UNTIL,
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
    record_strided: int
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
    """Memory to which samples are written that are not recorded; recording thus needs no branch."""
    sound: Floats
    """Line ``SOUND_STEPS`` of the table ``status``, shape (runs,)."""

    def enter(self, plan: LanePlan, s: int) -> None:
        """Begin row s of a plan: see ``advance.Lanes``.

        A run continues its step, or begins one where its segment begins.
        """
        clock, count, any_restart = self.clock, plan.count(s), False
        for lane in range(self.sound.size):
            steps = plan.steps_of(s, lane, clock[STEP, lane])
            clock[TO, lane] = clock[BEGIN, lane]
            if s == 0 or steps.start != clock[START, lane]:
                any_restart = True
                clock[RESTART, lane], clock[TO, lane] = 1.0, steps.time_after(0)
                clock[LOCAL, lane] = clock[TO, lane]
                put_segment(self.c, self.place, lane, plan.lines[s, lane])
            # A run without a further part takes its sample again where another one completes it.
            has_samples = steps.length > 0.0 or not plan.is_part(s)
            clock[ENDS_STEPS, lane] = 0.0 if plan.is_part(s) else 1.0
            _set_range(self, lane, steps, count if has_samples else 0)
        if any_restart:
            call(self.prepare, self.c)
            renew(self)

    def take(self, plan: LanePlan, s: int, k: int) -> bool:
        """Take the next sample of each run that has one in its current step: see ``advance.Lanes``.

        A run with longer steps gets ahead of the others, so k is not used.
        """
        return _next_samples(self, self.row[0])

    def record(self, plan: LanePlan, samples: LaneSamples, s: int, k: int) -> None:
        """Record the samples that are due: see ``advance.Lanes``."""
        c, b, clock, row, channel = self.c, self.b, self.clock, self.row, float(samples.channel)
        if not plan.is_part(s):
            put = self.record_dense if samples.channel == 1 else self.record_strided
            call(put, c, b, clock, row, samples.numbers, self.nowhere, channel)


class TaylorRun(NamedTuple):
    """Run of one drive by Taylor's method."""

    run: Run
    arrays: TaylorRuns
    """Arrays of this run; its state and turns are views of ``run``'s memory."""

    def begin(self, steps: EqualSteps, count: int, samples: Table) -> None:
        """Continue the step in memory, or begin one at the state: see ``advance.Method``."""
        run, arrays, clock = self.run, self.arrays, self.arrays.clock
        memory, balls = run.work.memory, run.balls
        if count == 0:
            begin_range(run, steps.time_after(0), 0, samples)
            return
        _set_range(arrays, 0, steps, count)
        if memory[0, _VALID] == 0.0:
            for j in range(run.state.size):
                arrays.state[j, 0] = run.state[j]
            for i in range(balls.number):
                arrays.turns[i, 0] = float(balls.discrete[i, TURNS])
            clock[RESTART, 0], clock[TO, 0] = 1.0, steps.time_after(0)
            renew(arrays)
        else:
            # Memory has the step's begin and the state there, but no series. The same state gives
            # the same series to the last bit.
            clock[BEGIN, 0] = memory[0, _BEGAN]
            _expand(arrays)
        clock[LOCAL, 0] = clock[BEGIN, 0]

    def take(self, steps: EqualSteps, k: int, sample: Floats) -> bool:
        """Take the next sample: see ``advance.Method``."""
        run, arrays, balls = self.run, self.arrays, self.run.balls
        _next_samples(arrays, sample[ANGLE:])
        if arrays.status[SOUND, 0] == 0.0:
            arrays.status[SOUND, 0] = 1.0
            for j in range(run.state.size):
                run.work.trial[j] = arrays.state[j, 0]
            return False
        for j in range(run.state.size):
            run.state[j] = arrays.state[j, 0]
        for i in range(balls.number):
            balls.discrete[i, TURNS] = int(arrays.turns[i, 0])
        run.work.memory[0, _VALID], run.work.memory[0, _BEGAN] = 1.0, arrays.clock[BEGIN, 0]
        return True


def renew(runs: TaylorRuns) -> None:
    """Begin each run's next step at TO; a run whose TO equals BEGIN keeps its step.

    The state comes from the series, or from the current sample where RESTART is set. A run that
    keeps its step gets the same series again: all lanes compute, as SIMD code has no branches.
    """
    call(runs.move, runs.c, runs.b, runs.clock, runs.series, runs.state, runs.y, runs.turns)
    _expand(runs)


def _expand(runs: TaylorRuns) -> None:
    """Compute each run's Taylor series at the beginning of its step, and the end of the step."""
    call(runs.coefficients, runs.c, runs.b, runs.clock, runs.y, runs.series)


def _set_range(runs: TaylorRuns, lane: int, steps: EqualSteps, count: int) -> None:
    """Set the samples to take of one run: those at the ends of ``count`` steps.

    A run without a step in the range keeps its current sample.
    """
    clock = runs.clock
    clock[START, lane], clock[UNTIL, lane] = steps.start, steps.until
    clock[OFFSET, lane], clock[LENGTH, lane] = steps.offset, steps.length
    clock[FIRST, lane], clock[COUNT, lane], clock[TAKEN, lane] = steps.first, count, 0.0
    clock[NEXT, lane] = steps.time_after(1) if steps.length > 0.0 else clock[LOCAL, lane]


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
