"""Functions and arrays for Taylor steps of one run, or of several side by side."""

from typing import NamedTuple

from ab_sim.engine.compiling.kinds import Floats, Table, call
from ab_sim.engine.events.run import Run
from ab_sim.engine.taylor.clock import (
    FIRST,
    HOW_MANY_DUE,
    HOW_MANY_LEFT,
    LENGTH,
    LOCAL,
    NEXT,
    OFFSET,
    START,
    STEP,
    TAKEN,
)

VALID, BEGAN, STATE = 0, 1, 2
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
    said: Table
    """Flags and counts of each run, shape (SAID, runs), lines of ``ab_sim.engine.taylor.clock``."""
    row: Table
    """Row of the current sample, shape (numbers, runs)."""
    nowhere: Floats
    """Memory for samples that are not recorded, so that recording needs no branch."""
    sound: Floats
    """Line ``SOUND_STEPS`` of the table ``said``, shape (runs,)."""


class TaylorRun(NamedTuple):
    """Single run of a drive."""

    run: Run
    own: TaylorRuns
    """Arrays of this run; its state and turns are views of ``run``'s memory."""


def renew(runs: TaylorRuns) -> None:
    """Begin each run's next step at TO; a run whose TO equals BEGIN keeps its step.

    The state comes from the series, or from the current sample where ANEW is set.
    """
    call(runs.move, runs.c, runs.b, runs.clock, runs.series, runs.state, runs.y, runs.turns)
    expand(runs)


def expand(runs: TaylorRuns) -> None:
    """Compute the series of each run at its step's beginning, and the step's end."""
    call(runs.coefficients, runs.c, runs.b, runs.clock, runs.y, runs.series)


def aim(runs: TaylorRuns, lane: int) -> None:
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


def next_samples(runs: TaylorRuns, row: Floats) -> bool:
    """Compute state and row at the next sample of each run that has one in its current step.

    Args:
        runs: the runs; those with a sample are marked on their clock.
        row: rows to fill in.

    Returns:
        Whether any run had a sample; if not, all samples of the range have been taken.
    """
    c, b, clock, signals = runs.c, runs.b, runs.clock, runs.said
    # Samples within the current steps need no new series. Only when no run has one left does each
    # run take its next step.
    while True:
        call(runs.mark, c, b, clock, signals)
        if signals[HOW_MANY_DUE, 0] > 0.0:
            series, turns, bounds = runs.series, runs.turns, runs.bounds
            call(runs.sample, c, b, clock, series, turns, bounds, runs.state, signals, row)
            return True
        if signals[HOW_MANY_LEFT, 0] == 0.0:
            return False
        renew(runs)
