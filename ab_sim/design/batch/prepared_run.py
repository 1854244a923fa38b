"""Prepared run of a batch: scene, system, stepper and speed schedule."""

import copy
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.drive.observation import RowReader, channels_of
from ab_sim.drive.trajectory import Trajectory
from ab_sim.engine.integrate.choose import Choice, choose_stepper, top_speed
from ab_sim.engine.kernels.constants import numbers_of, pattern
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.dynamics.system import System
from ab_sim.model.spindle import Ramp, ScheduledSegment, SpeedSchedule
from ab_sim.model.spindle.step_ranges import StepRange, StepResolution, step_ranges
from ab_sim.scene import Scene


class BatchRun(NamedTuple):
    """Finished run of a batch."""

    scene: Scene
    """Scene of the run."""
    trajectory: Trajectory
    """Every ``every``-th step; if the run diverged, up to the last finite one.

    Samples may be a view of memory shared with other runs: copy them to keep a few of many runs.
    """
    failure: str
    """Reason of the early end; empty if the run is complete."""
    aborted: str = ""
    """Reason why a profile controlled during the run went to standstill; empty if it did not."""


class StepPlanKey(NamedTuple):
    """Inputs of a step plan: runs with equal keys have the same step ranges."""

    scheduled_segments: tuple[ScheduledSegment, ...]
    """Segments of the speed schedule."""
    grid: StepResolution
    """Step, and the cycle that limits the step along curved segments."""

    def step_ranges(self, steps: int) -> list[StepRange]:
        """Return the step ranges of the first ``steps`` steps."""
        return list(
            step_ranges(SpeedSchedule.of_scheduled(self.scheduled_segments), self.grid, 0, steps)
        )


@dataclass(frozen=True)
class _StepperRequest:
    """Request for the choice of a stepper, comparable with other requests."""

    by: Any
    """Numbers and settings that determine the choice; the only ones that are compared."""
    scene: Scene = field(compare=False)
    """Scene for the choice."""
    system: System = field(compare=False)
    """System of the scene."""


@functools.lru_cache(maxsize=64)
def _chosen(request: _StepperRequest) -> Choice:
    """Return the chosen stepper, cached for runs that differ only in their start or profile."""
    return choose_stepper(request.scene, request.system)


class PreparedRun:
    """Scene with the objects that its run needs.

    Parameters
    ----------
    scene
        Checked scene; a requested accuracy is resolved to a solver by measurement.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, _ = resolve_accuracy(scene)
        self.system = system_of(self.scene)
        self.numbers = numbers_of(self.system)
        """Raw constants for the kernel."""
        self._pattern = pattern(self.system)
        choice = _chosen(_StepperRequest(self._choice_inputs(), self.scene, self.system))
        self.stepper, self.steps = choice.stepper, steps_of(self.scene)
        self._controlled = self.scene.is_controlled
        schedule = SpeedSchedule.at_start if self._controlled else SpeedSchedule.of_scene
        scheduled_segments = schedule(self.scene).segments
        # Step ranges of ramps do not depend on the cycle, which differs with mass and stiffness.
        curved = any(not isinstance(scheduled.law, Ramp) for scheduled in scheduled_segments)
        self.step_plan_key = StepPlanKey(
            scheduled_segments,
            StepResolution(self.scene.solver.step, choice.cycle if curved else 0.0),
        )
        # With a profile that is controlled during the run, each drive is commanded separately.
        self.fits_lane = self.stepper.takes_lanes and not self._controlled

    def with_numbers_of(self, scene: Scene) -> "PreparedRun":
        """Return the run of a scene that differs in numbers only, including its start angle.

        Stepper, step and step ranges are kept. The run may therefore diverge although it would
        not with its own stepper and step.

        Parameters
        ----------
        scene
            Checked scene with the same profile and start speed; its numbers may be columns of
            runs, see ``system_of``.
        """
        other = copy.copy(self)
        other.scene, other.system = scene, system_of(scene)
        other.numbers = numbers_of(other.system, self.system)
        if scene.start.angle != self.scene.start.angle:
            segments = SpeedSchedule.of_scene(scene).segments
            other.step_plan_key = self.step_plan_key._replace(scheduled_segments=segments)
        return other

    @property
    def group_key(self) -> Any:
        """Key of runs that share machine code and thus a group."""
        names = tuple(self.scene.effects), tuple(self.scene.pickups)
        solver = self.stepper, self.scene.solver.step
        return names, self._pattern, self.scene.balls.count, solver, self.steps, self._controlled

    def _choice_inputs(self) -> Any:
        """Return all inputs of the choice of a stepper."""
        solver = self.scene.solver
        named = solver.stepper, solver.step, tuple(sorted(solver.parameters.items()))
        return self._pattern, self.balls, self.numbers.tobytes(), named, top_speed(self.scene)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channel names of the samples."""
        return channels_of(self.scene, self.system)

    @property
    def balls(self) -> int:
        """Number of balls n."""
        return len(self.system.balls)

    def failure_after(self, sound: int) -> str:
        """Return the reason of an early end after ``sound`` steps; empty if the run is complete."""
        if sound >= self.steps:
            return ""
        return (
            f"went beyond all bounds at t = {(sound + 1) * self.scene.solver.step:.9g} s; run "
            "this scene with a Drive to get the cause"
        )

    def trajectory(self, samples: np.ndarray, stride: int) -> Trajectory:
        """Return every ``stride``-th sample; sensors are computed from all samples first."""
        if not self.scene.pickups:
            return Trajectory(self.channels, samples).decimated(stride)
        return RowReader(self.scene, self.system).trajectory(samples).decimated(stride)


def grouped(prepared: Sequence[PreparedRun]) -> dict[Any, list[int]]:
    """Return the indices of runs by ``group_key``, in the order of the runs."""
    groups: dict[Any, list[int]] = {}
    for i, run in enumerate(prepared):
        groups.setdefault(run.group_key, []).append(i)
    return groups


def steps_of(scene: Scene) -> int:
    """Return the number of steps of a scene's run."""
    return max(1, math.ceil(scene.duration / scene.solver.step - 1e-9))
