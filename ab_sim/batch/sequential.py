"""Runs of a batch that are computed one after the other."""

import math
import time
from collections.abc import Sequence

import numpy as np

from ab_sim.batch.prepared_run import BatchRun, PreparedRun, cached_step_plan, kernel_stride
from ab_sim.batch.sample_buffer import SampleBuffer
from ab_sim.drive import Drive
from ab_sim.drive.step_plan import StepPlan
from ab_sim.drive.steps import Steps
from ab_sim.dynamics.assemble import start_discrete_state, start_state
from ab_sim.errors import DivergedError

_AT_ONCE = 10_000
"""Number of steps whose samples are in memory at a time before decimation."""


def run_one_by_one(members: Sequence[PreparedRun], every: int) -> tuple[list[BatchRun], float]:
    """Run each with its own Drive, keep every ``every``-th step; return runs and CPU time [s]."""
    runs, seconds = [], 0.0
    for member in members:
        drive, failure = Drive(member.scene), ""
        begin = time.thread_time()
        try:
            taken = drive.advance(member.steps, every)
        except DivergedError as error:
            # Repeat the run up to the last finite state to get its samples.
            failure, sound = str(error), drive.steps
            drive.reset()
            taken = drive.advance(sound, every)
        seconds += time.thread_time() - begin
        aborted = drive.leader.aborted if drive.leader is not None else None
        why = "" if aborted is None else aborted.text
        runs.append(BatchRun(member.scene, taken, failure, why))
    return runs, seconds


class SequentialRuns:
    """Runs of one group with a stepper that takes collocation steps, without events.

    They share one ``Steps`` object and thus the stepper's response tables. Tables are computed
    again only if a run's constants differ.

    Args:
        first: any of the runs.
        buffer: memory for the samples that the kernel writes.
    """

    def __init__(self, first: PreparedRun, buffer: SampleBuffer) -> None:
        discrete_state = start_discrete_state(first.scene, first.system)
        self._steps = Steps(first.system, first.stepper, first.scene.solver.step, discrete_state)
        self._buffer = buffer
        self._rows = np.empty((min(first.steps, _AT_ONCE), len(first.channels)))

    def run(self, members: Sequence[PreparedRun], every: int) -> tuple[list[BatchRun], float]:
        """Compute the runs one by one, see ``run_one_by_one``."""
        runs, seconds = [], 0.0
        for member in members:
            in_kernel, samples = kernel_stride(member.scene, every), self._buffer.take(1)[0]
            step_plan = cached_step_plan(member.step_plan_key)
            self._to_start(member)
            for kind in step_plan.kinds:
                self._steps.along_segments(kind)
            begin = time.thread_time()
            sound = self._take(step_plan, member.steps, in_kernel, samples)
            spent = time.thread_time() - begin
            if sound:
                taken = member.trajectory(samples, every // in_kernel)
                runs.append(BatchRun(member.scene, taken, ""))
            else:
                # Repeat with a Drive, which reports the diverged state and its time.
                diverged, spent = run_one_by_one([member], every)
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
        """Write every ``every``-th sample of a run; return whether all steps were finite."""
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
        """Write samples after ``first`` steps; return whether all steps were finite."""
        return step_plan.walk(self._steps.along, first, len(samples), math.nan, samples) >= 0
