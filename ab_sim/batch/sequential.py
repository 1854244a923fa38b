"""Runs one after the other."""

import math
import time
from collections.abc import Sequence

import numpy as np

from ab_sim.batch.prepared_run import BatchRun, PreparedRun, kept_at_first, step_plan_of
from ab_sim.batch.sample_room import SampleRoom
from ab_sim.drive import Drive
from ab_sim.drive.step_plan import StepPlan
from ab_sim.drive.steps import Steps
from ab_sim.dynamics.assemble import start_discrete_state, start_state
from ab_sim.errors import DivergedError

_AT_ONCE = 10_000
"""Steps whose samples are in memory at a time where they are thinned."""


def one_by_one(members: Sequence[PreparedRun], every: int) -> tuple[list[BatchRun], float]:
    """A Drive for each; runs and CPU time [s]. Each ``every``-th step is kept."""
    runs, seconds = [], 0.0
    for member in members:
        drive, failure = Drive(member.scene), ""
        begin = time.thread_time()
        try:
            taken = drive.advance(member.steps, every)
        except DivergedError as error:
            # Once more, up to where it was sound.
            failure, sound = str(error), drive.steps
            drive.reset()
            taken = drive.advance(sound, every)
        seconds += time.thread_time() - begin
        runs.append(BatchRun(member.scene, taken, failure))
    return runs, seconds


class SequentialRuns:
    """Runs of one likeness, with a stepper that takes collocation steps, and without events.

    They have in common what a Drive makes for itself, and what the stepper keeps as long as it
    serves: tables of responses, which one run takes over from another where they are the same.

    Args:
        first: one of them.
        room: for what comes out of the kernel.
    """

    def __init__(self, first: PreparedRun, room: SampleRoom) -> None:
        discrete_state = start_discrete_state(first.scene, first.system)
        self._steps = Steps(first.system, first.stepper, first.scene.solver.step, discrete_state)
        self._room = room
        self._rows = np.empty((min(first.steps, _AT_ONCE), len(first.channels)))

    def run(self, members: Sequence[PreparedRun], every: int) -> tuple[list[BatchRun], float]:
        """As ``one_by_one``."""
        runs, seconds = [], 0.0
        for member in members:
            in_kernel, samples = kept_at_first(member.scene, every), self._room.take(1)[0]
            step_plan = step_plan_of(member.course)
            self._to_start(member)
            for kind in step_plan.kinds:
                self._steps.along(kind)
            begin = time.thread_time()
            sound = self._take(step_plan, member.steps, in_kernel, samples)
            spent = time.thread_time() - begin
            if sound:
                taken = member.trajectory(samples, every // in_kernel)
                runs.append(BatchRun(member.scene, taken, ""))
            else:
                # A Drive says what went wrong, and where.
                diverged, spent = one_by_one([member], every)
                runs += diverged
            seconds += spent
        return runs, seconds

    def _to_start(self, member: PreparedRun) -> None:
        steps = self._steps
        steps.take(member.system)
        steps.state[:] = start_state(member.scene, member.system)
        steps.discrete_state[:] = start_discrete_state(member.scene, member.system)
        steps.work.smooth[0] = math.nan

    def _take(self, step_plan: StepPlan, steps: int, every: int, samples: np.ndarray) -> bool:
        """Fill in each so-many-th of a run's samples; whether all of them were sound."""
        if every == 1:
            return self._advance(step_plan, 0, samples)
        for done in range(0, steps, len(self._rows)):
            rows = self._rows[: steps - done]
            if not self._advance(step_plan, done, rows):
                return False
            chosen = rows[(-1 - done) % every :: every]
            samples[done // every :][: len(chosen)] = chosen
        return True

    def _advance(self, step_plan: StepPlan, first: int, samples: np.ndarray) -> bool:
        """Fill in samples, ``first`` steps having been taken before; whether all were sound."""
        return step_plan.walk(self._steps.along, first, len(samples), math.nan, samples) >= 0
