"""Taylor steps of eight runs at once, one run per SIMD lane, each with its own step lengths.

Lanes take steps together, then all samples that fall within these steps. A run with longer steps
therefore gets ahead of the others. Runs wait for each other only at the end of a row of the plan.
"""

from ab_sim.engine.compiling.kinds import Floats, call
from ab_sim.engine.stepping import side_by_side as lanes
from ab_sim.engine.stepping.fixed_step import PLACE_UNTIL
from ab_sim.engine.stepping.side_by_side import LanePlan, LaneSamples
from ab_sim.engine.taylor.clock import (
    ANEW,
    BEGIN,
    COUNT,
    ENDS_STEPS,
    FIRST,
    LENGTH,
    LOCAL,
    OFFSET,
    START,
    STEP,
    STRIDE,
    TO,
    UNTIL,
    WHERE,
)
from ab_sim.engine.taylor.run import TaylorRuns, aim, next_samples, renew

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
        while next_samples(runs, runs.row[0]):
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
    any_anew = False
    for lane in range(runs.sound.size):
        start, offset = plan.times[s, lanes.START, lane], plan.times[s, lanes.OFFSET, lane]
        if s == 0 or start != clock[START, lane]:
            any_anew = True
            since = plan.rows[s, lanes.FIRST] * clock[STEP, lane] - start
            clock[ANEW, lane], clock[TO, lane] = 1.0, since + offset
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
        aim(runs, lane)
    if any_anew:
        call(runs.prepare, runs.c)
        renew(runs)


def record(runs: TaylorRuns, samples: LaneSamples) -> None:
    """Write the current rows as samples of the runs that have one due."""
    c, b, clock, row, channel = runs.c, runs.b, runs.clock, runs.row, float(samples.channel)
    if samples.channel == 1:
        call(runs.record_dense, c, b, clock, row, samples.numbers, runs.nowhere, channel)
    else:
        call(runs.record, c, b, clock, row, samples.numbers, runs.nowhere, channel)
