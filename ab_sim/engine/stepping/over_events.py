"""Fixed steps of eight runs with events, taken together unless a run may have an event.

All eight try each step together, with the branches of its start. A run that may have an event in
it repeats the step alone, by ``events.location``, and then joins the others again: the code is that
of a single run, so the results are the same to the bit. The test for all eight is slightly more
cautious than that for one run. A run may take a step alone although there is no event in it, but
no event is missed.
"""

from typing import NamedTuple

from ab_sim.engine.compiling.kinds import Cube, Floats, Table, call
from ab_sim.engine.events.balls import put_branches
from ab_sim.engine.events.event_functions import evaluate_at_start
from ab_sim.engine.events.location import (
    check_branches,
    cut_at_events,
    evaluate_at_end,
    may_have_event,
    put_functions_at_end,
)
from ab_sim.engine.events.run import Run, evaluate
from ab_sim.engine.stepping.emitted import MOVED, SOUND
from ab_sim.engine.stepping.fixed_step import take_over_end
from ab_sim.engine.stepping.plan import LanePlan
from ab_sim.engine.stepping.side_by_side import (
    BEGIN,
    END,
    LANES,
    TAKEN,
    LaneRuns,
    LaneSamples,
    enter_row,
    recorded,
    settle,
    try_step,
)
from ab_sim.model.dynamics.system import TURNS

EightRuns = tuple[Run, Run, Run, Run, Run, Run, Run, Run]


class LanesOverEvents(NamedTuple):
    """Eight runs with events: in lanes, and each of them alone for steps with an event."""

    lanes: LaneRuns
    has_contact: bool
    """True if balls can touch. Neighbours differ between runs, so each run is then tested alone."""
    event_test: int
    """Address of the function in ``event_test``, in lanes; 0 with contact."""
    seen: Table
    """Memory of ``event_test`` between steps, shape (numbers, 8)."""
    evaluate: int
    """Function evaluate(c, b, t, y, k, x, motor, table), in lanes; used with contact."""
    x: Table
    """``BallEvents.x`` of all runs, shape (K, 8)."""
    motor: Table
    """``BallEvents.motor`` of all runs, shape (3, 8)."""
    table: Cube
    """``BallEvents.table`` of all runs, shape (12 + 2 K, n, 8)."""
    suspected: Floats
    """Nonzero for a run that may have an event within the current step, shape (8,)."""
    took_alone: Floats
    """Nonzero for a run that took its step alone, shape (8,): 1, or 2 if its branches must be
    checked."""
    one: EightRuns
    """Single runs; their states, branches and turns are copies of those in the lanes."""

    def enter(self, plan: LanePlan, s: int) -> None:
        """Begin row s of a plan, in lanes and alone: see ``advance.Lanes``."""
        enter_row(self.lanes, plan, s)
        _enter_alone(self)

    def take(self, plan: LanePlan, s: int, k: int) -> bool:
        """Take the k-th step of row s, with events alone: see ``advance.Lanes``."""
        runs = self.lanes
        if k == plan.count(s):
            return False
        # All runs try the step as if there were no event. Only those in which an event is possible
        # repeat it alone, so that the common case stays vectorised.
        try_step(runs, plan, s, k)
        _mark_possible_events(self)
        if _is_any(self.suspected):
            _step_alone(self)
        settle(runs)
        # Without contact, ``event_test`` keeps the values at the step's end in ``seen``.
        if self.has_contact:
            _reuse_step_ends(self)
        if _is_any(self.took_alone) or _is_any(runs.status[MOVED]):
            join(self)
        return True

    def record(self, plan: LanePlan, samples: LaneSamples, s: int, k: int) -> None:
        """Record the samples after step k of row s if due: see ``advance.Lanes``."""
        recorded(self.lanes, plan, samples, s, k)


def _enter_alone(all_runs: LanesOverEvents) -> None:
    """Prepare the single copy of each running lane for the next row of the plan."""
    runs, lane = all_runs.lanes, 0
    for run in all_runs.one:
        if _is_going(runs, lane):
            for j in range(runs.place, run.scene.c.size):
                run.scene.c[j] = runs.c[j, lane]
            _recheck_branches(runs, run, lane)
        lane += 1
    _update_event_test(all_runs)


def _mark_possible_events(all_runs: LanesOverEvents) -> None:
    """Mark the runs that may have an event in the trial step."""
    runs, after = all_runs.lanes, all_runs.lanes.times[TAKEN:]
    c, b, trial, slopes = runs.c, runs.b, runs.trial, runs.slopes
    if not all_runs.has_contact:
        call(all_runs.event_test, c, b, after, trial, slopes, all_runs.seen, all_runs.suspected)
        return
    x, motor, table = all_runs.x, all_runs.motor, all_runs.table
    call(all_runs.evaluate, c, b, runs.times[END:], trial, slopes, x, motor, table)
    lane = 0
    for run in all_runs.one:
        all_runs.suspected[lane] = 0.0
        if _is_going(runs, lane) and _may_have_event_alone(all_runs, run, lane):
            all_runs.suspected[lane] = 1.0
        lane += 1


def _update_event_test(all_runs: LanesOverEvents) -> None:
    """Update the memory of ``event_test`` to the present states."""
    runs, now = all_runs.lanes, all_runs.lanes.times[TAKEN:]
    if not all_runs.has_contact:
        c, b, state, slopes = runs.c, runs.b, runs.state, runs.slopes
        call(all_runs.event_test, c, b, now, state, slopes, all_runs.seen, all_runs.suspected)


def _is_going(runs: LaneRuns, lane: int) -> bool:
    """Return whether a run takes the current step."""
    return runs.times[TAKEN, lane] > 0.0 and runs.status[SOUND, lane] != 0.0


def _may_have_event_alone(all_runs: LanesOverEvents, run: Run, lane: int) -> bool:
    """Return whether one run may have an event in its step, from its values at the step's end."""
    balls, work, times = run.balls, run.work, all_runs.lanes.times
    _take_out(work.trial, all_runs.lanes.trial, lane)
    _take_out(work.slope_ahead, all_runs.lanes.slopes, lane)
    _take_out(balls.x, all_runs.x, lane)
    _take_out(balls.motor, all_runs.motor, lane)
    for line in range(balls.table.shape[0]):
        _take_out(balls.table[line], all_runs.table[line], lane)
    put_functions_at_end(run)
    return may_have_event(run, times[BEGIN, lane], times[TAKEN, lane], times[END, lane])


def _step_alone(all_runs: LanesOverEvents) -> None:
    """Repeat the current step, run by run, for each run that may have an event in the step."""
    runs, lane = all_runs.lanes, 0
    for run in all_runs.one:
        if all_runs.suspected[lane] != 0.0 and _is_going(runs, lane):
            if not all_runs.has_contact:
                _evaluate_at_step_ends(runs, run, lane)
            is_resolved = _step_of_one(runs, run, lane)
            all_runs.took_alone[lane] = 1.0 if is_resolved else 2.0
        lane += 1


def _evaluate_at_step_ends(runs: LaneRuns, run: Run, lane: int) -> None:
    """Evaluate one run's event functions at both ends of the step tried in the lanes."""
    work = run.work
    _copy_from_lanes(runs, run, lane)
    evaluate(run, runs.times[BEGIN, lane], run.state, work.slope)
    evaluate_at_start(run)
    _take_out(work.trial, runs.trial, lane)
    evaluate_at_end(run, runs.times[END, lane])


def _step_of_one(runs: LaneRuns, run: Run, lane: int) -> bool:
    """Take one run's step alone, cut at its events, and copy the result into the lanes.

    Returns
    -------
    bool
        The result of ``cut_at_events``: False if the branches must be checked at the step's end.
    """
    work, times = run.work, runs.times
    is_resolved = cut_at_events(run, times[BEGIN, lane], times[TAKEN, lane], times[END, lane])
    _put_in(runs.trial, work.trial, lane)
    _put_in(runs.slopes, work.slope_ahead, lane)
    _put_in(runs.b, run.balls.branches, lane)
    return is_resolved


def join(all_runs: LanesOverEvents) -> None:
    """Check the branches of runs whose step was not resolved, or whose angles were unwound.

    Then update the memory of ``event_test``, because states or branches have changed.
    """
    runs, lane = all_runs.lanes, 0
    for run in all_runs.one:
        doubtful = all_runs.took_alone[lane] == 2.0 or runs.status[MOVED, lane] != 0.0
        if doubtful and _is_going(runs, lane):
            _recheck_branches(runs, run, lane)
        all_runs.took_alone[lane] = 0.0
        lane += 1
    _update_event_test(all_runs)


def _is_any(flags: Floats) -> bool:
    """Return whether any run's flag is nonzero."""
    total = 0.0
    for lane in range(LANES):
        total += abs(flags[lane])
    return total != 0.0


def _recheck_branches(runs: LaneRuns, run: Run, lane: int) -> None:
    """Check one run's branches, as a single run does before its first step."""
    _copy_from_lanes(runs, run, lane)
    put_branches(run.balls)
    time = runs.times[END, lane]
    evaluate(run, time, run.state, run.work.slope)
    check_branches(run, time)
    _put_in(runs.state, run.state, lane)
    _put_in(runs.slopes, run.work.slope, lane)
    _put_in(runs.b, run.balls.branches, lane)


def _copy_from_lanes(runs: LaneRuns, run: Run, lane: int) -> None:
    """Copy one run's state and turns from the lanes."""
    _take_out(run.state, runs.state, lane)
    for i in range(runs.turns.shape[0]):
        run.balls.discrete[i, TURNS] = int(runs.turns[i, lane])


def _take_out(values: Floats, table: Table, lane: int) -> None:
    """Copy a lane of a table, shape (numbers, 8), to ``values``."""
    for j in range(values.size):
        values[j] = table[j, lane]


def _put_in(table: Table, values: Floats, lane: int) -> None:
    """Copy ``values`` to a lane of a table, shape (numbers, 8)."""
    for j in range(values.size):
        table[j, lane] = values[j]


def _reuse_step_ends(all_runs: LanesOverEvents) -> None:
    """Reuse the values at the end of each run's step as those at the start of its next step."""
    lane = 0
    for run in all_runs.one:
        if _is_going(all_runs.lanes, lane) and all_runs.took_alone[lane] != 2.0:
            for j in range(run.state.size):
                run.state[j] = run.work.trial[j]
            take_over_end(run.work)
        lane += 1
