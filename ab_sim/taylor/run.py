"""What Taylor steps are taken with: functions, and arrays of one run or of several side by side."""

from typing import NamedTuple

from ab_sim.compiling.kinds import Floats, Table, call
from ab_sim.events.run import Run
from ab_sim.taylor.clock import (
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
"""Numbers of ``Workspace.memory``: 1 if the others mean something; when the step began; the first
of the state there, behind which are the turns taken out of it."""


class TaylorRuns(NamedTuple):
    """Runs along one profile each; the last axis of each array is theirs."""

    prepare: int
    """prepare(c)."""
    coefficients: int
    move: int
    mark: int
    sample: int
    record: int
    record_dense: int
    """See ``ab_sim.taylor``; the last two of runs side by side, else 0."""
    c: Table
    """Constants, shape (constants, runs)."""
    b: Table
    """Branches of set-valued laws, of which there are none."""
    place: int
    """Where in c the place on the speed profile begins."""
    clock: Table
    """Lines as of ``clock``, shape (lines, runs)."""
    y: Table
    """State at the step's beginning, shape (states, runs)."""
    turns: Table
    """Taken out of the balls' angles until then, shape (n, runs)."""
    series: Floats
    """Coefficients of the state there."""
    state: Table
    """At the sample at hand, shape (states, runs)."""
    bounds: Table
    """Magnitudes that no sound run reaches, shape (states, runs)."""
    said: Table
    """Shape (SAID, runs), lines as of ``clock``."""
    row: Table
    """Of the sample at hand, shape (numbers, runs)."""
    nowhere: Floats
    """Where what is not recorded goes."""
    sound: Floats
    """Its line SOUND_STEPS."""


class TaylorRun(NamedTuple):
    """One run of a drive."""

    run: Run
    own: TaylorRuns
    """Of the one; its state and its turns are views of ``run``'s memory."""


def renew(own: TaylorRuns) -> None:
    """Begin a step where each run is to: at TO, or anew; runs whose TO is BEGIN keep theirs."""
    call(own.move, own.c, own.b, own.clock, own.series, own.state, own.y, own.turns)
    expand(own)


def expand(own: TaylorRuns) -> None:
    """Find the series of each run where its step begins, and how far it goes."""
    call(own.coefficients, own.c, own.b, own.clock, own.y, own.series)


def aim(own: TaylorRuns, lane: int) -> None:
    """Say when the first sample of a run's range is: as ``fixed_step.time_after`` does.

    A run without a step of its own there has the sample that it had.
    """
    clock = own.clock
    first, step, length = clock[FIRST, lane], clock[STEP, lane], clock[LENGTH, lane]
    clock[TAKEN, lane] = 0.0
    if length == 0.0:
        clock[NEXT, lane] = clock[LOCAL, lane]
    elif length == step:
        clock[NEXT, lane] = (first + 1.0) * step - clock[START, lane] + clock[OFFSET, lane]
    else:
        clock[NEXT, lane] = first * step - clock[START, lane] + clock[OFFSET, lane] + length


def next_samples(own: TaylorRuns, row: Floats) -> bool:
    """States and rows at the next sample of each run that has one in its step at hand.

    Args:
        own: the runs; those with a sample are marked on their clock.
        row: where rows go.

    Returns:
        Whether there are any; if not, all samples of the range have been taken.
    """
    c, b, clock, said = own.c, own.b, own.clock, own.said
    while True:
        call(own.mark, c, b, clock, said)
        if said[HOW_MANY_DUE, 0] > 0.0:
            series, turns, bounds = own.series, own.turns, own.bounds
            call(own.sample, c, b, clock, series, turns, bounds, own.state, said, row)
            return True
        if said[HOW_MANY_LEFT, 0] == 0.0:
            return False
        renew(own)
