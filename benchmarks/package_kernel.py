"""The package's compiled loop alone, without the other work of a Drive."""

import math
import time
from collections.abc import Callable

import numpy as np

from ab_sim.drive import Drive
from ab_sim.drive.steps import StepPlan
from ab_sim.model.spindle.step_ranges import StepRange
from ab_sim.scene import Scene


class PackageKernel:
    """Compiled loop that repeats the same steps of a scene within one segment of its profile.

    Parameters
    ----------
    scene
        Scene to simulate.
    first
        Number of steps taken before.
    steps
        Number of steps to take.
    """

    def __init__(self, scene: Scene, first: int, steps: int) -> None:
        drive = Drive(scene)
        drive.advance(first)
        self.drive, self.first, self.steps = drive, first, steps
        self.start = drive.snapshot()
        self.scheduled = drive.schedule.segment_at(drive.time)
        if self.scheduled.end < (first + steps) * drive.step:
            raise SystemExit(f"{scene.name}: the steps run across a breakpoint of the profile")
        step_plan = StepPlan([StepRange(self.scheduled, first, steps, 0.0, drive.step)])
        self._leg, self._at = next(step_plan.after(first))
        self._advance = drive._steps.along_segments(self._leg.kind)
        self.samples = np.zeros((steps, len(drive.channels)))

    @property
    def state(self) -> np.ndarray:
        """Return the present state."""
        return self.drive._steps.state

    def rewind(self) -> None:
        """Return to the state before the steps."""
        made = self.drive._steps
        made.state[:], made.discrete_state[:] = self.start.state, self.start.discrete_state
        made.work.smooth[0] = math.nan

    def run(self) -> None:
        """Take the steps."""
        self.rewind()
        asked = self._leg.table, self._at, self.first, self.steps, math.nan, self.samples
        assert self._advance(*asked) == self.steps


def ns_per_step(run: Callable[[], None], steps: int, runs: int) -> float:
    """Return the CPU time of some runs per step [ns]."""
    begin = time.thread_time_ns()
    for _ in range(runs):
        run()
    return (time.thread_time_ns() - begin) / (steps * runs)
