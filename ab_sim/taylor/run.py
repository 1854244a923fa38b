"""What Taylor steps are taken with: functions, and arrays of one run or of several side by side."""

from typing import NamedTuple

from ab_sim.compiling.kinds import Floats, Table, call
from ab_sim.events.run import Run

LOCAL, PROFILE, BEGIN, AIM, PER_LENGTH, TO, ANEW = range(7)
"""Lines of ``TaylorRuns.clock``, times in s since a piece of the profile began: of the sample at
hand, and where it is on the profile; when the step began; base-2 logarithm of the tolerance; what
displacement is divided by, inverted [1/m]; where the next step begins, and 1 if it does so anew at
the sample at hand, else 0."""
END, UNTIL, NEXT, TAKEN, DUE = 7, 8, 9, 10, 11
"""When the step ends, and the piece of the profile; the next sample; how many samples of the step
range at hand have been taken; 1 if one is at hand, else 0."""
START, OFFSET, LENGTH, COUNT = 12, 13, 14, 15
"""Of the step range at hand: when its piece of the profile begins, counted from the run's
beginning; where it begins in its nominal step; how long each of its steps is; how many they are."""
LINES = 16
VALID, BEGAN, STATE = 0, 1, 2
"""Numbers of ``Workspace.memory``: 1 if the others mean something; when the step began; the first
of the state there, behind which are the turns taken out of it."""


class TaylorRuns(NamedTuple):
    """Runs along one profile each; the last axis of each array is theirs."""

    prepare: int
    """prepare(c)."""
    coefficients: int
    move: int
    sample: int
    """See ``ab_sim.taylor``."""
    c: Table
    """Constants, shape (constants, runs)."""
    b: Table
    """Branches of set-valued laws, of which there are none."""
    place: int
    """Where in c the place on the speed profile begins."""
    step: float
    """Of the scene [s]."""
    shortest: float
    """A step of the method's own [s], however large the error."""
    clock: Table
    """Shape (LINES, runs), lines as above."""
    y: Table
    """State at the step's beginning, shape (states, runs)."""
    turns: Table
    """Taken out of the balls' angles until then, shape (n, runs)."""
    series: Floats
    """Coefficients of the state there."""
    lengths: Floats
    """How long the step may be [s], shape (runs,)."""
    state: Table
    """At the sample at hand, shape (states, runs)."""
    bounds: Table
    """Magnitudes that no sound run reaches, shape (states, runs)."""
    said: Table
    """1 of a run that is within them there, else 0; shape (1, runs)."""
    row: Table
    """Of the sample at hand, shape (numbers, runs)."""
    fine: Floats
    """1 of a run that has been within its bounds all the time, else 0; shape (runs,)."""
    sound: Floats
    """How many steps each was so, shape (runs,)."""
    every: int
    """Steps from one recorded sample to the next."""


class TaylorRun(NamedTuple):
    """One run of a drive."""

    run: Run
    own: TaylorRuns
    """Of the one; its state and its turns are views of ``run``'s memory."""


def renew(own: TaylorRuns) -> None:
    """Begin a step where each run is to: at TO, or anew; runs whose TO is BEGIN keep theirs."""
    clock = own.clock
    call(own.move, own.c, own.b, clock[BEGIN:], own.series, own.state, own.y, own.turns)
    for lane in range(own.lengths.size):
        clock[BEGIN, lane] = clock[TO, lane]
        clock[ANEW, lane] = 0.0
    expand(own)


def expand(own: TaylorRuns) -> None:
    """Find the series of each run where its step begins, and how far it goes."""
    clock = own.clock
    call(own.coefficients, own.c, own.b, clock[BEGIN:], own.y, own.series, own.lengths)
    for lane in range(own.lengths.size):
        end = clock[BEGIN, lane] + max(own.lengths[lane], own.shortest)
        clock[END, lane] = end if end < clock[UNTIL, lane] else clock[UNTIL, lane]


def aim_at_next(own: TaylorRuns, first: int, lane: int) -> None:
    """Say when a run's next sample is: ``fixed_step.time_after``, of a range with so many before.

    A run without a step of its own in this range has the sample that it had.
    """
    clock, done = own.clock, first + int(own.clock[TAKEN, lane])
    length = clock[LENGTH, lane]
    if length == 0.0:
        clock[NEXT, lane] = clock[LOCAL, lane]
    elif length == own.step:
        since = (done + 1) * own.step - clock[START, lane]
        clock[NEXT, lane] = since + clock[OFFSET, lane]
    else:
        since = done * own.step - clock[START, lane]
        clock[NEXT, lane] = since + clock[OFFSET, lane] + length


def next_samples(own: TaylorRuns, first: int, row: Floats) -> int:
    """States and rows at the next sample of each run that has one in its step at hand.

    Args:
        own: the runs.
        first: steps taken before the range.
        row: where rows go.

    Returns:
        Of how many runs, marked in the line DUE; 0 if all samples of the range have been taken.
    """
    clock, runs = own.clock, own.lengths.size
    while True:
        due, left = 0, 0
        for lane in range(runs):
            clock[DUE, lane] = 0.0
            clock[TO, lane] = clock[BEGIN, lane]
            if clock[TAKEN, lane] < clock[COUNT, lane]:
                left += 1
                if clock[NEXT, lane] <= clock[END, lane] or clock[END, lane] >= clock[UNTIL, lane]:
                    clock[DUE, lane] = 1.0
                    due += 1
                else:
                    clock[TO, lane] = clock[END, lane]
        if due > 0:
            take(own, first, row)
        if due > 0 or left == 0:
            return due
        renew(own)


def take(own: TaylorRuns, first: int, row: Floats) -> None:
    """Evaluate the samples that are due."""
    clock = own.clock
    for lane in range(own.lengths.size):
        if clock[DUE, lane] > 0.0:
            clock[LOCAL, lane] = clock[NEXT, lane]
            clock[TAKEN, lane] += 1.0
            if clock[LENGTH, lane] > 0.0:
                done = first + int(clock[TAKEN, lane])
                clock[PROFILE, lane] = done * own.step - clock[START, lane]
            aim_at_next(own, first, lane)
    c, b, said = own.c, own.b, own.said
    call(own.sample, c, b, clock, own.series, own.turns, own.bounds, own.state, said, row)
