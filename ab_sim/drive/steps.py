"""Machine code and arrays with which a stepper integrates a system."""

import contextlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from ab_sim.drive.step_plan import StepPlanPart
from ab_sim.engine.compiling import BoundFunction, compiled
from ab_sim.engine.compiling.kinds import aligned
from ab_sim.engine.events.run import ImplicitWork, Run
from ab_sim.engine.events.run_arrays import balls_of, workspace
from ab_sim.engine.integrate.stepper import Stepper
from ab_sim.engine.integrate.steppers.generalized_alpha import Alpha
from ab_sim.engine.integrate.steppers.taylor import TaylorParameters
from ab_sim.engine.kernels.code import Code, code_of
from ab_sim.engine.kernels.constants import numbers_of
from ab_sim.engine.kernels.runge_kutta import EMITTED
from ab_sim.engine.kernels.tangent import lanes_for, tangent_address
from ab_sim.engine.stepping.assemble import NOWHERE, known_of, run_with
from ab_sim.engine.stepping.fixed_step import advance
from ab_sim.engine.taylor.assemble import memory_size, run_by_taylor
from ab_sim.engine.taylor.drive import advance_by_taylor
from ab_sim.model.dynamics.assemble import state_bounds
from ab_sim.model.dynamics.system import System


class Steps:
    """State and compiled functions of the integration of a system.

    Args:
        system: system to integrate; its kind is fixed, its numbers may change.
        stepper: integration method.
        step: integration step [s].
        discrete_state: active branches at the start, shape (n + 1, MODES); events change them.

    Attributes:
        state: state of the system, shape (states,).
        discrete_state: the array that was passed.
        work: workspace of a step.
    """

    def __init__(
        self, system: System, stepper: Stepper, step: float, discrete_state: np.ndarray
    ) -> None:
        bounds = state_bounds(system, step / stepper.parts)
        self._system, self._stepper, self._step = system, stepper, step
        self.discrete_state, self.state = discrete_state, aligned(bounds.shape)
        self._balls = balls_of(system, discrete_state)
        self.work = workspace(self._balls, bounds, self._memory(len(bounds)))
        self._made: dict[type[Any], tuple[Run, BoundFunction, Code]] = {}
        self._part: StepPlanPart | None = None
        """Part of the plan that ``_taken`` is bound to."""

    def along(self, part: StepPlanPart) -> BoundFunction:
        """Return the function that takes steps along a part of a plan, ``fixed_step.advance``."""
        if part is not self._part:
            self._part, self._taken = part, self.along_segments(part.kind).bind(part.table)
        return self._taken

    def along_segments(self, kind: type[Any]) -> BoundFunction:
        """Return the function that takes steps along segments of a kind, without a table."""
        if kind not in self._made:
            code = code_of(self._system, kind)
            run = self._run(code)
            fixed, weights = known_of(run), self._stepper.weights
            if isinstance(weights, TaylorParameters):
                one = run_by_taylor(run, self._system, code, weights)
                taken = compiled(advance_by_taylor, fixed).bind(one)
            else:
                taken = compiled(advance, fixed).bind(run)
            self._made[kind] = run, taken, code
        return self._made[kind][1]

    def take(self, system: System) -> None:
        """Continue with the numbers of another system of the same kind."""
        self._system = system
        self._balls.constants[:] = system.balls
        self._balls.contacts[:] = system.contacts
        numbers = numbers_of(system)
        for run, *_ in self._made.values():
            run.scene.c[: len(numbers)] = numbers

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

    def _run(self, code: Code) -> Run:
        weights, parts = self._stepper.weights, self._stepper.parts
        step = code.step(weights, parts=parts) if isinstance(weights, EMITTED) else NOWHERE
        arguments = self._balls, self.work, self._system, code, step, self._step, self.state
        run = run_with(*arguments)
        if isinstance(weights, Alpha):
            implicit = implicit_of(weights, code, len(self.state))
            run = run._replace(is_implicit=True, implicit=implicit)
        return run


def implicit_of(weights: Alpha, code: Code, states: int) -> ImplicitWork:
    """Return the workspace of an implicit step of the generalized-alpha method."""
    lanes = lanes_for(code.model.count)
    return ImplicitWork(
        code.address("slope"),
        tangent_address(code),
        *weights,
        time=np.zeros(1),
        at=aligned((states,)),
        slope_there=aligned((states,)),
        change=aligned((states,)),
        along=aligned((states + 1, lanes)),
        rates=aligned((states, lanes)),
        jacobian=aligned((states, states)),
        equations=aligned((states, states + 1)),
    )
