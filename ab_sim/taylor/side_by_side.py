"""Taylor steps of eight runs at once, each in a lane of its own, with steps of its own length.

Lanes take their steps together, and their samples, as far as they have any in these; so a run lags
behind others that take longer steps, and waits for no more than the end of a row of the plan.
"""

from ab_sim.compiling.kinds import call
from ab_sim.stepping.side_by_side import FINISHES, FIRST, STEPS, LanePlan, LaneSamples
from ab_sim.stepping.side_by_side import LENGTH as PLAN_LENGTH
from ab_sim.stepping.side_by_side import OFFSET as PLAN_OFFSET
from ab_sim.stepping.side_by_side import START as PLAN_START
from ab_sim.taylor.drive import PLACE_UNTIL
from ab_sim.taylor.run import (
    ANEW,
    BEGIN,
    COUNT,
    DUE,
    LENGTH,
    LOCAL,
    OFFSET,
    START,
    TAKEN,
    TO,
    UNTIL,
    TaylorRuns,
    aim_at_next,
    next_samples,
    renew,
)


def advance_by_taylor_side_by_side(
    runs: TaylorRuns, plan: LanePlan, samples: LaneSamples
) -> None:
    """See ``stepping.side_by_side.advance_side_by_side``."""
    clock, lanes = runs.clock, runs.lengths.size
    for s in range(plan.rows.shape[0]):
        first = plan.rows[s, FIRST]
        enter(runs, plan, s)
        while next_samples(runs, first, runs.row[0]) > 0:
            for lane in range(lanes):
                if clock[DUE, lane] > 0.0:
                    if runs.said[0, lane] == 0.0:
                        runs.fine[lane] = 0.0
                    if plan.rows[s, FINISHES] != 0:
                        runs.sound[lane] += runs.fine[lane]
                        put_sample(runs, samples, first + int(clock[TAKEN, lane]), lane)


def enter(runs: TaylorRuns, plan: LanePlan, s: int) -> None:
    """Begin a row of a plan: with the steps at hand, or anew where another piece begins."""
    clock, lanes, last = runs.clock, runs.lengths.size, plan.places.shape[1]
    any_anew = False
    for lane in range(lanes):
        start, length = plan.times[s, PLAN_START, lane], plan.times[s, PLAN_LENGTH, lane]
        clock[TO, lane] = clock[BEGIN, lane]
        if s == 0 or start != clock[START, lane]:
            any_anew = True
            since = plan.rows[s, FIRST] * runs.step - start
            clock[ANEW, lane], clock[TO, lane] = 1.0, since + plan.times[s, PLAN_OFFSET, lane]
            clock[LOCAL, lane] = clock[TO, lane]
            clock[UNTIL, lane] = plan.places[s, last - PLACE_UNTIL, lane]
            for j in range(last):
                runs.c[runs.place + j, lane] = plan.places[s, j, lane]
        clock[START, lane], clock[LENGTH, lane] = start, length
        clock[OFFSET, lane] = plan.times[s, PLAN_OFFSET, lane]
        steps = plan.rows[s, STEPS] if length > 0.0 else plan.rows[s, FINISHES]
        clock[TAKEN, lane], clock[COUNT, lane] = 0.0, float(steps)
        aim_at_next(runs, plan.rows[s, FIRST], lane)
    if any_anew:
        call(runs.prepare, runs.c)
        renew(runs)


def put_sample(runs: TaylorRuns, samples: LaneSamples, steps: int, lane: int) -> None:
    """The row at hand, as a run's sample after so many steps, if it is to be recorded."""
    if steps % runs.every == 0:
        at = (steps // runs.every - 1) * samples.sample + lane * samples.run
        samples.numbers[at] = steps
        samples.numbers[at + samples.channel] = steps * runs.step
        for j in range(runs.row.shape[0]):
            samples.numbers[at + (2 + j) * samples.channel] = runs.row[j, lane]
