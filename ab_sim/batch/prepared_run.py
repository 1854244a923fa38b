"""A scene with what its run in a batch needs."""

import functools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.accuracy import resolve_accuracy
from ab_sim.batch.sample_room import SampleRoom
from ab_sim.drive.rows import RowReader, channels_of
from ab_sim.drive.step_plan import StepPlan
from ab_sim.drive.trajectory import Trajectory
from ab_sim.dynamics.assemble import system_of
from ab_sim.dynamics.system import has_events
from ab_sim.integrate.choose import choose_stepper
from ab_sim.kernels.constants import pattern
from ab_sim.scene import Scene
from ab_sim.spindle import Ramp, ScheduledSegment, SpeedSchedule
from ab_sim.spindle.step_ranges import StepGrid, StepRange, step_ranges


class BatchRun(NamedTuple):
    """One of the runs."""

    scene: Scene
    trajectory: Trajectory
    """Every ``every``-th step; up to the last sound one, if the run diverged. Its samples may share
    a block of memory with others'; who keeps few of many runs copies theirs."""
    failure: str
    """Why it ended early; empty if it did not."""


class StepPlanKey(NamedTuple):
    """What stretches follow from: where it is the same, they need not be found again."""

    scheduled_segments: tuple[ScheduledSegment, ...]
    grid: StepGrid

    def step_ranges(self, steps: int) -> list[StepRange]:
        """Of so many steps from the start."""
        return list(
            step_ranges(SpeedSchedule.of_scheduled(self.scheduled_segments), self.grid, 0, steps)
        )


@functools.lru_cache(maxsize=8)
def step_plan_of(course: StepPlanKey) -> StepPlan:
    """The way of all steps along a course."""
    return StepPlan.along(SpeedSchedule.of_scheduled(course.scheduled_segments), course.grid, 0)


class PreparedRun:
    """A scene with what its run needs.

    Args:
        scene: checked; an accuracy that it asks for is measured.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, _ = resolve_accuracy(scene)
        self.system = system_of(self.scene)
        choice = choose_stepper(self.scene, self.system)
        self.stepper, self.steps = choice.stepper, steps_of(self.scene)
        scheduled_segments = SpeedSchedule.of_scene(self.scene).segments
        # Ramps do not ask for the cycle, which is another one for each mass and stiffness.
        curved = any(not isinstance(scheduled.segment, Ramp) for scheduled in scheduled_segments)
        self.course = StepPlanKey(
            scheduled_segments, StepGrid(self.scene.solver.step, choice.cycle if curved else 0.0)
        )
        smooth = not has_events(self.system.effects)
        self.fits_a_lane = self.stepper.takes_lanes and smooth
        self.takes_collocation_steps = self.stepper.collocation_steps and smooth

    @property
    def likeness(self) -> Any:
        """Runs in which this is the same go together."""
        names = tuple(self.scene.effects), tuple(self.scene.sensors)
        constants = pattern(self.system)
        solver = self.stepper, self.scene.solver.step
        return names, constants, self.scene.balls.count, solver, self.steps

    @property
    def channels(self) -> tuple[str, ...]:
        """Of its samples."""
        return channels_of(self.scene, self.system)

    def trajectory(self, samples: np.ndarray, thinned: int) -> Trajectory:
        """Each so-many-th of some samples from the start, with sensors of all there are."""
        if not self.scene.sensors:
            return Trajectory(self.channels, samples).thinned(thinned)
        return RowReader(self.scene, self.system).trajectory(samples).thinned(thinned)


def steps_of(scene: Scene) -> int:
    """How many steps a scene's run has."""
    return max(1, math.ceil(scene.duration / scene.solver.step - 1e-9))


def room_for(members: Sequence[PreparedRun], every: int) -> SampleRoom:
    """For the samples that come out of the kernel, of runs of one likeness."""
    first = members[0]
    # Where not all of them are kept, each run's are let go when it has been thinned.
    runs = len(members) if kept_at_first(first.scene, every) == every else 0
    samples = first.steps // kept_at_first(first.scene, every)
    return SampleRoom(runs, (samples, len(first.channels)))


def kept_at_first(scene: Scene, every: int) -> int:
    """Each so-manieth step comes out of the kernel: an accelerometer's filter takes all of them."""
    return 1 if scene.sensors else every
