"""Groups of runs computed eight side by side: merged step plans, start data and work arrays."""

import bisect
import functools
import itertools
import time
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.design.batch.prepared_run import PreparedRun, StepPlanKey
from ab_sim.engine.compiling import BoundFunction, compiled
from ab_sim.engine.events.run import Run
from ab_sim.engine.integrate.steppers.taylor import TaylorParameters
from ab_sim.engine.kernels.code import Code, code_of
from ab_sim.engine.stepping.advance import advance_side_by_side
from ab_sim.engine.stepping.assemble import flags_of, run_of
from ab_sim.engine.stepping.emitted import SOUND, event_test_address, settle_address, size_of_seen
from ab_sim.engine.stepping.over_events import EightRuns, LanesOverEvents
from ab_sim.engine.stepping.plan import LanePlan, plan_line
from ab_sim.engine.stepping.side_by_side import LANES, LaneRuns, LaneSamples, stacked
from ab_sim.engine.taylor.assemble import lanes_of
from ab_sim.engine.taylor.clock import STRIDE, WHERE
from ab_sim.engine.taylor.driver import TaylorRuns
from ab_sim.model.dynamics.assemble import (
    active_segment,
    start_discrete_state,
    start_state,
    state_bounds,
)
from ab_sim.model.dynamics.system import FIRST_TURNS, TURNS, layout_of
from ab_sim.model.equations.motion import ActiveSegment
from ab_sim.model.spindle.schedule import RampAndCosine
from ab_sim.model.spindle.step_ranges import StepRange


def merged(step_plans: Sequence[Sequence[StepRange]], step: float) -> tuple[type, LanePlan]:
    """Return one plan of steps for eight runs, cut at the breakpoints of every run.

    A run that divides a step into fewer parts than another gets additional parts of zero length,
    which do not change its state.

    Parameters
    ----------
    step_plans
        Step ranges of each run, all over the same steps.
    step
        Length of a step [s].

    Returns
    -------
    tuple[type, LanePlan]
        The type of all segments, and the plan.
    """
    rows = [row for ranges in _ranges_between_cuts(step_plans) for row in _plan_rows(ranges, step)]
    same_type = (
        len({type(step_range.scheduled.law) for _, lanes in rows for step_range in lanes}) == 1
    )
    lines = [
        [plan_line(step_range, end, _place(step_range, same_type)) for step_range in lanes]
        for end, lanes in rows
    ]
    return type(_place(rows[0][1][0], same_type).law), LanePlan(np.array(lines, float))


def _place(step_range: StepRange, same_type: bool) -> ActiveSegment:
    """Return the segment of a step range for the kernel, in a common type if types differ."""
    place = active_segment(step_range.scheduled)
    return place if same_type else place._replace(law=RampAndCosine.of(place.law))


def _ranges_between_cuts(
    step_plans: Sequence[Sequence[StepRange]],
) -> Iterator[list[list[StepRange]]]:
    """Yield, for each interval between the cuts of all runs, the step ranges of each run.

    The ranges of a run in an interval are whole steps, or all parts of a single step.
    """
    grouped = [
        [
            list(group)
            for _, group in itertools.groupby(step_plan, key=lambda step_range: step_range.first)
        ]
        for step_plan in step_plans
    ]
    firsts = [[group[0].first for group in groups] for groups in grouped]
    cuts = sorted(set().union(*firsts))
    last = step_plans[0][-1]
    for first, end in itertools.pairwise([*cuts, last.first + max(last.steps, 1)]):
        ranges = []
        for starts, groups in zip(firsts, grouped, strict=True):
            parts = groups[bisect.bisect_right(starts, first) - 1]
            if parts[0].steps:
                parts = [parts[0]._replace(first=first, steps=end - first)]
            ranges.append(parts)
        yield ranges


def _plan_rows(ranges: list[list[StepRange]], step: float) -> Iterator[tuple[int, list[StepRange]]]:
    """Yield the rows of a plan for one interval between cuts.

    Parameters
    ----------
    ranges
        Step ranges of each run in the interval.
    step
        Length of a step [s].

    Yields
    ------
    tuple[int, list[StepRange]]
        Number of steps taken after the row, and the step range of each run.
    """
    most, first = max(len(parts) for parts in ranges), ranges[0][0].first
    for k in range(most):
        lanes = [
            parts[k] if k < len(parts) else parts[-1]._replace(offset=step, length=0.0)
            for parts in ranges
        ]
        # The last part of a step completes it.
        steps = max(1, *(step_range.steps for step_range in lanes)) if k + 1 == most else 0
        yield first + steps, lanes


class LaneStarts(NamedTuple):
    """Start data of runs, a row each."""

    constants: np.ndarray
    """Raw constants, shape (runs, constants): see ``kernels.constants.numbers_of``."""
    bounds: np.ndarray
    """Magnitudes beyond which a run has diverged, shape (runs, states)."""
    state: np.ndarray
    """Initial states, shape (runs, states)."""
    discrete: np.ndarray
    """Branches and turns, shape (runs, balls + 1, columns): see ``BallEvents.discrete``."""
    contacts: np.ndarray
    """Neighbours along the race, shape (runs, contacts, 2): see ``BallEvents.contacts``."""

    @classmethod
    def of(cls, runs: Sequence[PreparedRun]) -> "LaneStarts":
        """Return the start data of prepared runs of one group."""
        rows = [_start_of(run) for run in runs]
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))

    @classmethod
    def of_columns(cls, run: PreparedRun, runs: int) -> "LaneStarts":
        """Return the start data of ``runs`` runs from a prepared run with columns."""
        starts = zip(_start_of(run), (1, 1, 1, 2, 2), strict=True)
        return cls(*(np.broadcast_to(x, (runs, *x.shape[x.ndim - axes :])) for x, axes in starts))

    def rows(self, which: slice) -> "LaneStarts":
        """Return the start data of some of the runs."""
        return LaneStarts(*(column[which] for column in self))


def _start_of(run: PreparedRun) -> tuple[np.ndarray, ...]:
    """Return the fields of ``LaneStarts`` for one run."""
    system = run.system
    return (
        run.numbers,
        state_bounds(system, run.scene.solver.step / run.stepper.parts),
        start_state(run.scene, system),
        start_discrete_state(run.scene, system),
        system.contacts,
    )


class _Work(NamedTuple):
    """Work arrays of eight runs along one kind of segment."""

    lanes: LaneRuns | TaylorRuns
    """Work arrays of the lanes."""
    alone: tuple[Run, ...]
    """Separate work for each run if the scene has events; otherwise empty."""
    advance: BoundFunction
    """Function that takes the steps of a plan."""
    code: Code
    """Compiled code; the reference keeps the functions alive."""


class LaneGroup:
    """Work arrays and code shared by the runs of one group, side by side.

    Parameters
    ----------
    first
        Any run of the group.
    every
        Number of steps between samples.
    """

    def __init__(self, first: PreparedRun, every: int) -> None:
        self._first, self._every = first, every
        self.works: dict[type, _Work] = {}
        """Work arrays by type of segment; each type has its own machine code."""

    def run(
        self, starts: LaneStarts, keys: Sequence[StepPlanKey], samples: LaneSamples
    ) -> tuple[np.ndarray, float]:
        """Run up to eight runs.

        Parameters
        ----------
        starts
            Start data of the runs.
        keys
            Keys of their step plans, or one key common to all.
        samples
            Output for eight lanes; unused lanes repeat the last run.

        Returns
        -------
        tuple[np.ndarray, float]
            Number of finite steps of each run, shape (8,), and CPU time [s].
        """
        kind, plan = _plan(tuple(keys), self._first.steps)
        if kind not in self.works:
            self.works[kind] = self._work(kind)
        work = self.works[kind]
        _begin(work, starts, samples)
        begin = time.thread_time()
        work.advance(plan, samples)
        return work.lanes.sound, time.thread_time() - begin

    def _work(self, kind: type) -> _Work:
        """Return the work arrays for a type of segment, without start data."""
        system, weights = self._first.system, self._first.stepper.weights
        code = code_of(system, kind)
        if isinstance(weights, TaylorParameters):
            step = self._first.scene.solver.step
            series = lanes_of(system, code, weights, step, self._every, LANES)
            return _Work(series, (), compiled(advance_side_by_side).bind(series), code)
        lanes = self._lanes(code)
        if not code.model.has_events:
            return _Work(lanes, (), compiled(advance_side_by_side).bind(lanes), code)
        alone: Any = tuple(self._alone(code) for _ in range(LANES))
        over_events = self._over_events(lanes, code, alone)
        advance = compiled(advance_side_by_side, flags_of(alone[0]))
        return _Work(lanes, alone, advance.bind(over_events), code)

    def _over_events(self, lanes: LaneRuns, code: Code, alone: EightRuns) -> LanesOverEvents:
        """Return the work of lanes that leave a step with an event to single runs.

        Parameters
        ----------
        lanes
            Work arrays of the lanes.
        code
            Machine code of the group.
        alone
            Work of the single runs.
        """
        contact, table = code.model.has_contact, alone[0].balls.table
        return LanesOverEvents(
            lanes,
            has_contact=contact,
            event_test=0 if contact else event_test_address(code, LANES),
            seen=_lane_array(size_of_seen(code)),
            evaluate=code.address("evaluate", LANES) if contact else 0,
            x=_lane_array(len(alone[0].balls.x)),
            motor=_lane_array(len(alone[0].balls.motor)),
            table=_lane_array(table.size).reshape(*table.shape, LANES),
            suspected=np.zeros(LANES),
            took_alone=np.zeros(LANES),
            one=alone,
        )

    def _alone(self, code: Code) -> Run:
        """Return the work of a single run, for steps with events."""
        first = self._first
        states, system = layout_of(first.system).size, first.system
        system_here = system._replace(balls=system.balls.copy(), contacts=system.contacts.copy())
        return run_of(
            system_here,
            code,
            code.step(first.stepper.weights, parts=first.stepper.parts),
            first.scene.solver.step,
            np.zeros(states),
            start_discrete_state(first.scene, first.system),
            np.zeros(states),
        )

    def _lanes(self, code: Code) -> LaneRuns:
        """Return the work arrays of eight lanes."""
        first = self._first
        layout, n = layout_of(first.system), first.balls
        quaternion = type(first.system.deck_model).UNIT_AT
        return LaneRuns(
            prepare=code.address("prepare", LANES),
            slope=0 if code.model.has_events else code.address("slope", LANES),
            step=code.step(first.stepper.weights, LANES, first.stepper.parts),
            settle=settle_address(code, layout, quaternion, LANES),
            finish=code.address("finish", LANES),
            c=_lane_array(code.size),
            b=_lane_array(code.branches()),
            place=code.layout.place,
            step_length=first.scene.solver.step,
            every=self._every,
            bounds=_lane_array(layout.size),
            state=_lane_array(layout.size),
            turns=_lane_array(n + code.model.has_motor),
            status=_lane_array(2),
            sound=np.zeros(LANES),
            slopes=_lane_array(layout.size),
            trial=_lane_array(layout.size),
            row=_lane_array(code.emission.row_channels),
            times=_lane_array(4),
        )


def _lane_array(lines: int) -> np.ndarray:
    """Return zeros for eight lanes, shape (lines, lanes)."""
    return stacked([np.zeros(lines)] * LANES)


def _begin(work: _Work, starts: LaneStarts, samples: LaneSamples) -> None:
    """Copy start data of runs into work arrays; unused lanes repeat the last run."""
    lanes, count = work.lanes, len(starts.constants)
    turns = starts.discrete[:, : len(lanes.turns), TURNS]
    places = lanes.c[: lanes.place], lanes.bounds, lanes.state, lanes.turns
    columns = starts.constants, starts.bounds, starts.state, turns
    for place, column in zip(places, columns, strict=True):
        place[:, :count] = column.T
        place[:, count:] = column[-1:].T
    lanes.status[SOUND], lanes.sound[:] = 1.0, 0.0
    if isinstance(lanes, TaylorRuns):
        lanes.clock[WHERE], lanes.clock[STRIDE] = np.arange(LANES) * samples.run, samples.sample
    for lane, run in enumerate(work.alone):
        row, balls, n = min(lane, count - 1), run.balls, run.balls.number
        constants = starts.constants[row]
        run.scene.c[: len(constants)] = constants
        columns = constants[len(constants) - n * FIRST_TURNS :]
        balls.constants[:, :FIRST_TURNS] = columns.reshape(FIRST_TURNS, n).T
        balls.constants[:, FIRST_TURNS] = starts.discrete[row, :n, TURNS]
        balls.contacts[:], balls.discrete[:] = starts.contacts[row], starts.discrete[row]
        run.work.bounds[:], run.work.counts[:] = starts.bounds[row], 0


@functools.lru_cache(maxsize=8)
def _plan(keys: tuple[StepPlanKey, ...], steps: int) -> tuple[type, LanePlan]:
    """Return the merged plan of eight runs, cached for runs with equal profiles."""
    lanes = [*keys, *[keys[-1]] * (LANES - len(keys))]
    return merged([key.step_ranges(steps) for key in lanes], keys[0].grid.step)
