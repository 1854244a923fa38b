"""One run of a batch: its scene, system, stepper and speed schedule."""

import copy
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ab_sim.accuracy import resolve_accuracy
from ab_sim.batch.sample_buffer import SampleBuffer
from ab_sim.drive.rows import RowReader, channels_of
from ab_sim.drive.step_plan import StepPlan
from ab_sim.drive.trajectory import Trajectory
from ab_sim.dynamics.assemble import system_of
from ab_sim.dynamics.system import System, has_events
from ab_sim.integrate.choose import Choice, choose_stepper, top_speed
from ab_sim.kernels.constants import numbers_of, pattern
from ab_sim.scene import Scene
from ab_sim.spindle import Ramp, ScheduledSegment, SpeedSchedule
from ab_sim.spindle.step_ranges import StepGrid, StepRange, step_ranges


class BatchRun(NamedTuple):
    """One run of a batch, with its result."""

    scene: Scene
    trajectory: Trajectory
    """Every ``every``-th step; if the run diverged, up to the last finite one. The samples may be a
    view of memory shared with other runs: copy them to keep a few of many runs."""
    failure: str
    """Why the run ended early; empty if it did not."""
    aborted: str = ""
    """Why its profile, which decides while it runs, ran down to standstill; empty if it did not."""


class StepPlanKey(NamedTuple):
    """What a step plan depends on: runs with equal keys have the same step ranges."""

    scheduled_segments: tuple[ScheduledSegment, ...]
    grid: StepGrid

    def step_ranges(self, steps: int) -> list[StepRange]:
        """Step ranges of a number of steps from the start."""
        return list(
            step_ranges(SpeedSchedule.of_scheduled(self.scheduled_segments), self.grid, 0, steps)
        )


@functools.lru_cache(maxsize=8)
def cached_step_plan(key: StepPlanKey) -> StepPlan:
    """The step plan of a speed schedule, made once for runs with equal keys."""
    return StepPlan.along(SpeedSchedule.of_scheduled(key.scheduled_segments), key.grid, 0)


@dataclass(frozen=True)
class _Asked:
    """A scene whose stepper is to be chosen: equal to others for which it is the same."""

    by: Any
    """What the choice follows from."""
    scene: Scene = field(compare=False)
    system: System = field(compare=False)


@functools.lru_cache(maxsize=64)
def _chosen(asked: _Asked) -> Choice:
    """The choice, made once for runs that differ in their start or profile only."""
    return choose_stepper(asked.scene, asked.system)


class PreparedRun:
    """A scene with the objects that its run needs.

    Args:
        scene: checked; if it asks for an accuracy, the solver is found by measurement.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, _ = resolve_accuracy(scene)
        self.system = system_of(self.scene)
        self.numbers = numbers_of(self.system)
        """Its raw constants, for the kernel."""
        self._pattern = pattern(self.system)
        choice = _chosen(_Asked(self._asked(), self.scene, self.system))
        self.stepper, self.steps = choice.stepper, steps_of(self.scene)
        self._led = self.scene.is_led
        schedule = SpeedSchedule.at_start if self._led else SpeedSchedule.of_scene
        scheduled_segments = schedule(self.scene).segments
        # Step ranges of ramps do not depend on the cycle, which differs with mass and stiffness.
        curved = any(not isinstance(scheduled.segment, Ramp) for scheduled in scheduled_segments)
        self.step_plan_key = StepPlanKey(
            scheduled_segments, StepGrid(self.scene.solver.step, choice.cycle if curved else 0.0)
        )
        # Where the profile decides while it runs, each drive is commanded for itself.
        smooth = not self._led and not has_events(self.system.effects)
        self.fits_lane = self.stepper.takes_lanes and not self._led
        self.takes_collocation_steps = self.stepper.collocation_steps and smooth

    def with_numbers_of(self, scene: Scene) -> "PreparedRun":
        """The run of a scene that differs in numbers only, of its start angle too.

        Stepper, step and step ranges stay: with them the other may diverge where it would not with
        those that it would be given by itself.

        Args:
            scene: checked; with this one's profile and start speed.
        """
        other = copy.copy(self)
        other.scene, other.system = scene, system_of(scene)
        other.numbers = numbers_of(other.system)
        if scene.start.angle != self.scene.start.angle:
            segments = SpeedSchedule.of_scene(scene).segments
            other.step_plan_key = self.step_plan_key._replace(scheduled_segments=segments)
        return other

    @property
    def group_key(self) -> Any:
        """Runs with equal keys run on the same machine code, in one group."""
        names = tuple(self.scene.effects), tuple(self.scene.pickups)
        solver = self.stepper, self.scene.solver.step
        return names, self._pattern, self.scene.balls.count, solver, self.steps, self._led

    def _asked(self) -> Any:
        """All that the choice of a stepper follows from."""
        solver = self.scene.solver
        named = solver.stepper, solver.step, tuple(sorted(solver.parameters.items()))
        return self._pattern, self.balls, self.numbers.tobytes(), named, top_speed(self.scene)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channel names of its samples."""
        return channels_of(self.scene, self.system)

    @property
    def balls(self) -> int:
        """n."""
        return len(self.system.balls)

    def failure_after(self, sound: int) -> str:
        """Why it ended early, after so many sound steps; empty if these are all."""
        if sound >= self.steps:
            return ""
        return (
            f"went beyond all bounds at t = {(sound + 1) * self.scene.solver.step:.9g} s; a Drive "
            "of this scene says what did, and why"
        )

    def trajectory(self, samples: np.ndarray, stride: int) -> Trajectory:
        """Every ``stride``-th sample. Sensors are computed from all samples, before thinning."""
        if not self.scene.pickups:
            return Trajectory(self.channels, samples).thinned(stride)
        return RowReader(self.scene, self.system).trajectory(samples).thinned(stride)


def grouped(prepared: Sequence[PreparedRun]) -> dict[Any, list[int]]:
    """Which of them are of one group, by its key."""
    groups: dict[Any, list[int]] = {}
    for i, one in enumerate(prepared):
        groups.setdefault(one.group_key, []).append(i)
    return groups


def steps_of(scene: Scene) -> int:
    """Number of steps of a scene's run."""
    return max(1, math.ceil(scene.duration / scene.solver.step - 1e-9))


def sample_buffer_for(members: Sequence[PreparedRun], every: int) -> SampleBuffer:
    """Memory for the samples that the kernel writes for a group of runs."""
    first = members[0]
    # If they are thinned afterwards, the memory of each run is released after it was thinned.
    runs = len(members) if kernel_stride(first.scene, every) == every else 0
    samples = first.steps // kernel_stride(first.scene, every)
    return SampleBuffer(runs, (samples, len(first.channels)))


def kernel_stride(scene: Scene, every: int) -> int:
    """Stride of the samples that the kernel writes; with sensors 1: filters need every step."""
    return 1 if scene.pickups else every
