"""Runs of a group that go eight side by side: where each starts, and what they run on."""

import functools
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.batch.lanes import merged
from ab_sim.batch.prepared_run import PreparedRun, StepPlanKey
from ab_sim.compiling import BoundFunction, compiled
from ab_sim.dynamics.assemble import start_discrete_state, start_state, state_bounds
from ab_sim.dynamics.layout import layout_of
from ab_sim.dynamics.system import TURNS
from ab_sim.integrate.side_by_side import (
    LANES,
    LanePlan,
    LaneRuns,
    LaneSamples,
    advance_side_by_side,
    stacked,
)
from ab_sim.kernels.code import code_of
from ab_sim.kernels.constants import numbers_of


class LaneStarts(NamedTuple):
    """What runs of a group begin with, a row for each."""

    constants: np.ndarray
    """Raw ones, shape (runs, constants): see ``kernels.constants.numbers_of``."""
    bounds: np.ndarray
    """Magnitudes that no sound run reaches, shape (runs, states)."""
    state: np.ndarray
    """Shape (runs, states)."""
    turns: np.ndarray
    """Taken out of the balls' angles, shape (runs, balls)."""

    @classmethod
    def of(cls, runs: Sequence[PreparedRun]) -> "LaneStarts":
        """Of prepared runs of one group."""
        rows = [_start_of(run) for run in runs]
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))

    def rows(self, which: slice) -> "LaneStarts":
        """Those of some of the runs."""
        return LaneStarts(*(column[which] for column in self))


def _start_of(run: PreparedRun) -> tuple[np.ndarray, ...]:
    n, system = len(run.system.balls), run.system
    return (
        numbers_of(system),
        state_bounds(system, run.scene.solver.step),
        start_state(run.scene, system),
        start_discrete_state(run.scene, system)[:n, TURNS],
    )


class LaneGroup:
    """What runs of one group run on, side by side.

    Args:
        first: one of them; any.
        every: steps from one sample to the next.
    """

    def __init__(self, first: PreparedRun, every: int) -> None:
        self._first, self._every = first, every
        self._made: dict[type, tuple[LaneRuns, BoundFunction]] = {}

    def run(
        self, starts: LaneStarts, keys: Sequence[StepPlanKey], samples: LaneSamples
    ) -> tuple[np.ndarray, float]:
        """Run up to eight.

        Args:
            starts: of these runs.
            keys: their step plans; or one, if it is that of all.
            samples: filled in, of eight; lanes without a run of their own repeat the last one.

        Returns:
            How many steps of each were sound, shape (8,); CPU time [s].
        """
        kind, plan = _plan(tuple(keys), self._first.steps)
        if kind not in self._made:
            runs = self._work(kind)
            self._made[kind] = runs, compiled(advance_side_by_side).bind(runs)
        runs, kernel = self._made[kind]
        _begin(runs, starts)
        begin = time.thread_time()
        kernel(plan, samples)
        return runs.sound[1], time.thread_time() - begin

    def _work(self, kind: type) -> LaneRuns:
        """Work arrays, not at any start yet."""
        first = self._first
        code, layout, n = code_of(first.system, kind), layout_of(first.system), first.balls
        column = len(code.emission.roots["sample"])
        tableau = first.stepper.weights
        return LaneRuns(
            prepare=code.address("prepare", LANES),
            slope=code.address("slope", LANES),
            step=code.step(tableau.a, tableau.b, tableau.c, LANES),
            finish=code.address("finish", LANES),
            c=_room(code.size),
            b=np.zeros(code.branches()),
            place=code.layout.place,
            first_angle=layout.angles.start,
            balls=n,
            ball_column=column,
            step_length=first.scene.solver.step,
            every=self._every,
            bounds=_room(layout.size),
            state=_room(layout.size),
            turns=_room(n),
            sound=_room(2),
            slopes=_room(layout.size),
            trial=_room(layout.size),
            row=_room(column + 2 * n),
            times=_room(2),
        )


def _room(lines: int) -> np.ndarray:
    return stacked([np.zeros(lines)] * LANES)


def _begin(runs: LaneRuns, starts: LaneStarts) -> None:
    """Put runs at their start."""
    count = len(starts.constants)
    places = runs.c[: runs.place], runs.bounds, runs.state, runs.turns
    for place, column in zip(places, starts, strict=True):
        place[:, :count] = column.T
        place[:, count:] = column[-1:].T
    runs.sound[0], runs.sound[1] = 1.0, 0.0


@functools.lru_cache(maxsize=8)
def _plan(keys: tuple[StepPlanKey, ...], steps: int) -> tuple[type, LanePlan]:
    """The merged plan of eight runs, made once for runs whose profiles are equal."""
    lanes = [*keys, *[keys[-1]] * (LANES - len(keys))]
    return merged([key.step_ranges(steps) for key in lanes], keys[0].grid.step)
