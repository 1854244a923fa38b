"""Steps of a drive: plan along a schedule, machine code and arrays, and errors of divergence."""

import contextlib
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import groupby, pairwise
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import DivergedError
from ab_sim.engine.compiling import BoundFunction, KeptArray, compiled
from ab_sim.engine.compiling.kinds import aligned
from ab_sim.engine.events.run_arrays import balls_of, workspace
from ab_sim.engine.integrate.registry import Stepper
from ab_sim.engine.integrate.steppers.generalized_alpha import Alpha
from ab_sim.engine.integrate.steppers.taylor import TaylorParameters
from ab_sim.engine.kernels.code import Code, code_of
from ab_sim.engine.kernels.constants import numbers_of
from ab_sim.engine.kernels.runge_kutta import EMITTED
from ab_sim.engine.stepping.advance import Method, advance
from ab_sim.engine.stepping.assemble import NOWHERE, flags_of, implicit_steps, run_with
from ab_sim.engine.stepping.fixed_step import FixedSteps
from ab_sim.engine.stepping.plan import plan_line
from ab_sim.engine.taylor.assemble import memory_size, run_by_taylor
from ab_sim.model.dynamics.assemble import active_segment, state_bounds
from ab_sim.model.dynamics.system import System
from ab_sim.model.spindle import Ramp, ScheduledSegment, SpeedSchedule
from ab_sim.model.spindle.step_ranges import StepRange, StepResolution, step_ranges

FOREVER = 2**52
"""Number of steps that no run exceeds; step numbers up to it are exact as floats."""


class StepPlanPart(NamedTuple):
    """Step ranges along segments of one kind, which one call of the driver can take."""

    kind: type
    """Class of the law of speed over time in the part's segments."""
    table: np.ndarray
    """Rows of step ranges, with columns as in ``stepping.plan``."""
    first: int
    """Index, in the whole plan, of the part's first step range."""


DriverOf = Callable[[StepPlanPart], Callable[..., int]]


class StepPlan:
    """Plan of all steps ahead, created once, so that a call only has to find its first step range.

    Parameters
    ----------
    ahead
        The step ranges, at least one, with all parts of whole steps.
    """

    def __init__(self, ahead: Iterable[StepRange]) -> None:
        taken = list(ahead)
        self._firsts = [step_range.first for step_range in taken]
        self._places: list[tuple[StepPlanPart, int]] = []
        """Part that contains each step range, and the step range's index in the part."""
        lines = [_line(*pair) for pair in pairwise([*taken, _END])]
        alike = groupby(zip(taken, lines, strict=True), lambda pair: type(pair[0].scheduled.law))
        for kind, pairs in alike:
            table = np.array([line for _, line in pairs], float)
            part = StepPlanPart(kind, table, len(self._places))
            self._places += [(part, at) for at in range(len(table))]

    @classmethod
    def along(cls, schedule: SpeedSchedule, resolution: StepResolution, first: int) -> "StepPlan":
        """Return the plan of all steps along a schedule after the first ``first`` ones."""
        return cls(step_ranges(schedule, resolution, first, FOREVER))

    def after(self, steps: int) -> Iterator[tuple[StepPlanPart, int]]:
        """Yield the parts after ``steps`` steps, and the step range at which each is entered."""
        at = bisect_left(self._firsts, steps)
        if at == len(self._firsts) or self._firsts[at] != steps:
            at = max(at - 1, 0)
        while at < len(self._places):
            part, begun = self._places[at]
            yield part, begun
            at = part.first + len(part.table)

    def walk(
        self,
        driver: DriverOf,
        first: int,
        steps: int,
        command: float,
        samples: np.ndarray | KeptArray,
    ) -> int:
        """Take steps after the first ``first`` ones.

        Arguments and result are those of ``stepping.advance``.

        Parameters
        ----------
        driver
            Function that returns the function for steps along a part; see ``Steps.along``.
        samples
            Receives the samples; a KeptArray has room for at most one step.
        """
        done = 0
        for part, begun in self.after(first):
            rest = samples[done:] if done and isinstance(samples, np.ndarray) else samples
            taken = driver(part)(begun, first + done, steps - done, command, rest)
            if taken < 0:
                return taken - done
            done += taken
            if done == steps:
                break
        return done


_END = StepRange(ScheduledSegment(0.0, 0.0, 0.0, Ramp(0.0, 0.0)), -1, 0, 0.0, 0.0)
"""Sentinel after the last step range."""


def _line(step_range: StepRange, next_: StepRange) -> list[float]:
    """Return the row of a step range in ``StepPlanPart.table``; ``next_`` is the range after it."""
    # The last part of a step completes it.
    ended = step_range.steps or int(next_.first != step_range.first)
    return plan_line(step_range, step_range.first + ended, active_segment(step_range.scheduled))


_MOST_NAMED = 3
"""Number of variables that the message names; it counts the others."""


def diverged(beyond: Sequence[str], stepper: Stepper, step: float, time: float) -> DivergedError:
    """Return the error that names the variables out of bounds, the likely cause, and a step to try.

    Parameters
    ----------
    beyond
        Variables of the state that are out of bounds.
    stepper
        Stepper in use.
    step
        Integration step [s].
    time
        End of the step that went out of bounds [s].
    """
    wrong = list(beyond)
    cause = "the step is too long for the scene's masses, stiffness and drag"
    if any(name.endswith("rate") for name in wrong):
        within = "one step" if stepper.parts == 1 else "a part of one step"
        cause = (
            f"a ball turns more than 3 rad along the race within {within}, which {stepper.name} "
            "cannot follow: the whirl is large for the race, or the step is too long"
        )
    if len(wrong) > _MOST_NAMED:
        wrong = [*wrong[:_MOST_NAMED], f"{len(wrong) - _MOST_NAMED} more"]
    return DivergedError(
        f"{', '.join(wrong)} went beyond all bounds at t = {time:.9g} s; likely cause: "
        f"{cause}; try solver.step = {step / 4:.2g} s"
    )


class Steps:
    """State and compiled functions of the integration of a system.

    Parameters
    ----------
    system
        System to integrate; its kind is fixed, its numbers may change.
    stepper
        Integration method.
    step
        Integration step [s].
    discrete_state
        Active branches at the start, shape (n + 1, MODES); events change them.

    Attributes
    ----------
    state
        State of the system, shape (states,).
    discrete_state
        The array that was passed.
    work
        Workspace of a step.
    """

    def __init__(
        self, system: System, stepper: Stepper, step: float, discrete_state: np.ndarray
    ) -> None:
        bounds = state_bounds(system, step / stepper.parts)
        self._system, self._stepper, self._step = system, stepper, step
        self.discrete_state, self.state = discrete_state, aligned(bounds.shape)
        self._balls = balls_of(system, discrete_state)
        self.work = workspace(self._balls, bounds, self._memory(len(bounds)))
        self._made: dict[type[Any], tuple[Method, BoundFunction, Code]] = {}
        self._part: StepPlanPart | None = None
        """Part of the plan that ``_taken`` is bound to."""

    def along(self, part: StepPlanPart) -> BoundFunction:
        """Return the function that takes steps along a part of a plan, ``stepping.advance``."""
        if part is not self._part:
            self._part, self._taken = part, self.along_segments(part.kind).bind(part.table)
        return self._taken

    def along_segments(self, kind: type[Any]) -> BoundFunction:
        """Return the function that takes steps along segments of a kind, without a table."""
        if kind not in self._made:
            code = code_of(self._system, kind)
            method = self._method(code)
            taken = compiled(advance, flags_of(method.run)).bind(method)
            self._made[kind] = method, taken, code
        return self._made[kind][1]

    def take(self, system: System) -> None:
        """Continue with another system that differs from this one in numbers only."""
        self._system = system
        self._balls.constants[:] = system.balls
        self._balls.contacts[:] = system.contacts
        numbers = numbers_of(system)
        for method, *_ in self._made.values():
            method.run.scene.c[: len(numbers)] = numbers

    @contextlib.contextmanager
    def left_unchanged(self) -> Iterator[None]:
        """Return a context that restores state and workspace on exit."""
        work = self.work
        changed = self.state, self.discrete_state, work.counts, work.memory, work.smooth
        kept = [array.copy() for array in changed]
        try:
            yield
        finally:
            for array, values in zip(changed, kept, strict=True):
                array[:] = values

    def _memory(self, states: int) -> tuple[int, int]:
        """Return the shape of the values that the stepper carries from step to step."""
        if isinstance(self._stepper.weights, TaylorParameters):
            return 1, memory_size(self._system)
        return self._stepper.memory, states

    def _method(self, code: Code) -> Method:
        """Return the method along segments of one kind; all share state and workspace."""
        weights, parts = self._stepper.weights, self._stepper.parts
        step = code.step(weights, parts=parts) if isinstance(weights, EMITTED) else NOWHERE
        arguments = self._balls, self.work, self._system, code, step, self._step, self.state
        run = run_with(*arguments)
        if isinstance(weights, TaylorParameters):
            return run_by_taylor(run, self._system, code, weights)
        return implicit_steps(run, weights, code) if isinstance(weights, Alpha) else FixedSteps(run)
