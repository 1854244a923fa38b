"""Scenes run by collocation, and by rk8, through the new core; and the old core's samples."""

import math
from typing import Any

import numpy as np

from ab_sim.collocation.assemble import (
    CollocationCode,
    collocation_code,
    collocation_of,
    drag_rates,
    method_of,
)
from ab_sim.collocation.drive import advance_by_collocation
from ab_sim.collocation.run import CollocationRun
from ab_sim.compiling import compiled
from ab_sim.drive import Drive
from ab_sim.drive.step_plan import StepPlan, StepPlanPart
from ab_sim.dynamics.assemble import (
    place_on,
    start_discrete_state,
    start_state,
    state_bounds,
    system_of,
)
from ab_sim.events.run_arrays import balls_of, workspace
from ab_sim.integrate.choose import choose_stepper
from ab_sim.integrate.registry import stepper_named
from ab_sim.integrate.steppers.collocation import EIGHT, PARTS, Setting
from ab_sim.kernels.code import Code, called, code_of
from ab_sim.scene import Scene
from ab_sim.spindle.schedule import SpeedSchedule
from ab_sim.spindle.step_ranges import StepGrid
from ab_sim.stepping.assemble import run_with


class Collocated:
    """A scene's run by collocation.

    Args:
        scene: with its step.
        tolerance, steps: of the method.
        setting: nodes and samples.
        energy_balance: whether an energy balance is kept.
        plain: whether the control runs as ordinary Python.
    """

    def __init__(
        self,
        scene: Scene,
        tolerance: float = 1e-11,
        steps: float = 0.0,
        setting: Setting = EIGHT,
        energy_balance: bool = False,
        plain: bool = False,
    ) -> None:
        self.system = system_of(scene, energy_balance)
        grid = StepGrid(scene.solver.step, cycle_of(scene))
        self.step_plan = StepPlan.along(SpeedSchedule.of_scene(scene), grid, 0)
        self.step = scene.solver.step
        self.state = start_state(scene, self.system)
        self.discrete = start_discrete_state(scene, self.system)
        self._discrete = self.discrete.copy()
        self.bounds = state_bounds(self.system, self.step / PARTS)
        self.method = method_of(setting, tolerance, steps)
        self._plain, self.taken = plain, 0
        self._runs: dict[type[Any], CollocationRun] = {}
        self._kernels: dict[type[Any], Any] = {}
        self._nodes = setting.nodes
        self._alike = len(set(drag_rates(self.system))) <= 1
        rk8: Any = stepper_named("rk8").weights
        self._tableau = rk8.a, rk8.b, rk8.c

    def of(self, kind: type[Any]) -> CollocationRun:
        """For segments of a kind; all share state and memory."""
        if kind not in self._runs:
            code: Code = code_of(self.system, kind)
            own: CollocationCode = collocation_code(code, self._nodes, self._alike)
            address = code.step(*self._tableau)
            balls = balls_of(self.system, self.discrete)
            work = workspace(balls, self.bounds, own.memory)
            run = run_with(balls, work, self.system, code, address, self.step, self.state)
            made = collocation_of(run, self.system, own, self.method)
            if self._runs:
                first = next(iter(self._runs.values()))
                shared = run.work._replace(
                    memory=first.run.work.memory,
                    smooth=first.run.work.smooth,
                    counts=first.run.work.counts,
                )
                made = made._replace(run=run._replace(work=shared), tables=first.tables)
            self._runs[kind] = made
        return self._runs[kind]

    def reset(self, scene: Scene) -> None:
        """Back to the start."""
        self.state[:], self.discrete[:] = start_state(scene, self.system), self._discrete
        for own in self._runs.values():
            own.run.work.memory[:] = 0.0
            own.run.work.smooth[:] = np.nan
            own.run.work.counts[:] = 0
        self.taken = 0

    def advance(self, steps: int, record: bool = False) -> np.ndarray:
        """Samples of so many steps."""
        samples = np.zeros((max(steps, int(record)), self.width))
        kernel = self._kernel
        done = self.step_plan.walk(kernel, self.taken, steps, np.nan, samples)
        if done < 0:
            self.taken += -1 - done
            raise FloatingPointError(f"diverged after {self.taken} steps")
        self.taken += done
        return samples

    @property
    def width(self) -> int:
        """Of a sample, without sensors."""
        run = self.of(next(iter(self.step_plan.kinds))).run
        return 2 + run.ball_column + 2 * run.balls.number + run.balls.has_motor

    def _kernel(self, part: StepPlanPart) -> Any:
        kind, own = part.kind, self.of(part.kind)
        if self._plain:
            return lambda *given: advance_by_collocation(own, part.table, *given)
        if kind not in self._kernels:
            self._kernels[kind] = compiled(advance_by_collocation).bind(own)
        return self._kernels[kind].bind(part.table)


def cycle_of(scene: Scene) -> float:
    """Of the fastest motion that its steps follow [s]."""
    return choose_stepper(scene, system_of(scene)).cycle


def old_samples(scene: Scene, steps: int, energy_balance: bool = False) -> np.ndarray:
    """What the old core records."""
    return Drive(scene, energy_balance=energy_balance).advance(steps).samples


class Runge:
    """A scene's motion by rk8, in fine steps between instants that are asked for."""

    def __init__(self, scene: Scene, most: float = 5e-4) -> None:
        self.system, self.most = system_of(scene), most
        (kind,) = StepPlan.along(
            SpeedSchedule.of_scene(scene), StepGrid(scene.solver.step, 1.0), 0
        ).kinds
        code = code_of(self.system, kind)
        rk8: Any = stepper_named("rk8").weights
        self._step, self._slope = code.step(rk8.a, rk8.b, rk8.c), code.address("slope")
        self._c, self._b = code.constants(self.system), np.zeros(code.branches())
        place = place_on(SpeedSchedule.of_scene(scene).segments[0])
        self._c[code.layout.place : code.layout.size] = [*place.segment, *place[1:]]
        called(code.address("prepare"), self._c)
        self._start = start_state(scene, self.system)

    def at(self, times: np.ndarray) -> np.ndarray:
        """States at rising times [s], a line for each; smooth scenes at a constant speed only."""
        state, now, found = self._start.copy(), 0.0, []
        slope, trial = np.empty_like(state), np.empty_like(state)
        for time in times.tolist():
            count = max(1, math.ceil((time - now) / self.most))
            for k in range(count):
                begin = now + (time - now) * k / count
                called(self._slope, self._c, self._b, state, slope, begin)
                given = self._c, self._b, state, slope, trial
                called(self._step, *given, begin, (time - now) / count)
                state[:] = trial
            now = time
            found.append(state.copy())
        return np.array(found)
