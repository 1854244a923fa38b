"""Prepared runs with samples, computed eight side by side if possible, otherwise one by one."""

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.base.errors import DivergedError
from ab_sim.base.presentation import CountProgress
from ab_sim.design.batch.lane_group import LaneGroup, LaneStarts
from ab_sim.design.batch.prepared_run import BatchRun, PreparedRun, grouped
from ab_sim.drive import Drive
from ab_sim.engine.stepping.side_by_side import LANES, LaneSamples
from ab_sim.scene import Scene

_BLOCK = 2**21
"""Number of values per block, 16 MB: large enough for huge pages, allocated three times as fast."""


class SampleBuffer:
    """Allocator of memory for samples, a block for many runs at a time.

    Parameters
    ----------
    runs
        Expected number of runs.
    shape
        Shape of the samples of one run, (samples, channels).
    """

    def __init__(self, runs: int, shape: tuple[int, int]) -> None:
        self._remaining, self._shape = runs, shape
        self._block, self._used = np.empty((0, *shape)), 0

    def take(self, runs: int) -> np.ndarray:
        """Return uninitialised memory for further runs, shape (runs, samples, channels)."""
        if self._used + runs > len(self._block):
            fit = min(_BLOCK // max(1, self._shape[0] * self._shape[1]), self._remaining)
            self._block, self._used = np.empty((max(runs, fit), *self._shape)), 0
        self._used, self._remaining = self._used + runs, self._remaining - runs
        return self._block[self._used - runs : self._used]


def run_one_by_one(members: Sequence[PreparedRun], every: int) -> tuple[list[BatchRun], float]:
    """Run each member in a Drive.

    Parameters
    ----------
    members
        Prepared runs.
    every
        Keep every ``every``-th step.

    Returns
    -------
    tuple[list[BatchRun], float]
        The finished runs, and the CPU time of their steps [s].
    """
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
        aborted = drive.controller.aborted if drive.controller is not None else None
        why = "" if aborted is None else aborted.text
        runs.append(BatchRun(member.scene, taken, failure, why))
    return runs, seconds


class DoneRuns(NamedTuple):
    """Finished runs; see ``Batch``."""

    runs: tuple[BatchRun, ...]
    """Runs in the order requested."""
    in_lanes: int
    """Number of runs computed in lanes."""
    integration_seconds: float
    """CPU time of the steps of all runs [s]."""


def run_prepared(
    prepared: Sequence[PreparedRun],
    every: int,
    progress: CountProgress | None = None,
) -> DoneRuns:
    """Run prepared runs, equal kinds side by side if possible.

    Parameters
    ----------
    prepared
        Runs in the order of the results.
    every, progress
        See ``simulate_batch``.
    """
    runs: list[BatchRun | None] = [None] * len(prepared)
    seconds, done, in_lanes = 0.0, 0, 0
    for members in grouped(prepared).values():
        first = prepared[members[0]]
        sample_buffer = _sample_buffer([prepared[i] for i in members], every)
        lane_group = (
            LaneGroup(first, kernel_stride(first.scene, every)) if first.fits_lane else None
        )
        width = LANES if lane_group else 1
        for begin in range(0, len(members), width):
            chosen = members[begin : begin + width]
            these = [prepared[i] for i in chosen]
            taken = _side_by_side(lane_group, these, every, sample_buffer) if lane_group else None
            in_lanes += len(chosen) if taken else 0
            results, spent = taken or run_one_by_one(these, every)
            for i, result in zip(chosen, results, strict=True):
                runs[i] = result
            seconds, done = seconds + spent, done + len(chosen)
            if progress is not None:
                progress(done, len(prepared))
    return DoneRuns(tuple(run for run in runs if run is not None), in_lanes, seconds)


def _side_by_side(
    lane_group: LaneGroup,
    members: list[PreparedRun],
    every: int,
    sample_buffer: SampleBuffer,
) -> tuple[list[BatchRun], float]:
    """Compute up to eight runs in lanes; return the runs and CPU time [s].

    Parameters
    ----------
    lane_group
        Lane group of the runs.
    members
        Up to eight runs.
    every
        Keep every ``every``-th step.
    sample_buffer
        Memory for their samples.
    """
    in_kernel, samples = kernel_stride(members[0].scene, every), sample_buffer.take(LANES)
    keys = [member.step_plan_key for member in members]
    steps_sound, seconds = lane_group.run(
        LaneStarts.of(members), keys, LaneSamples.by_sample(samples)
    )
    results = []
    for lane, member in enumerate(members):
        sound = int(steps_sound[lane])
        kept = samples[lane, : sound // in_kernel]
        taken = member.trajectory(kept, every // in_kernel)
        results.append(BatchRun(member.scene, taken, member.failure_after(sound)))
    return results, seconds


def _sample_buffer(members: Sequence[PreparedRun], every: int) -> SampleBuffer:
    """Return memory for the samples that the kernel writes for a group of runs."""
    first = members[0]
    # If samples are decimated afterwards, each run has its own memory, released after decimation.
    runs = len(members) if kernel_stride(first.scene, every) == every else 0
    samples = first.steps // kernel_stride(first.scene, every)
    return SampleBuffer(runs, (samples, len(first.channels)))


def kernel_stride(scene: Scene, every: int) -> int:
    """Return the stride of the kernel's samples; 1 with sensors, whose filters need every step."""
    return 1 if scene.pickups else every
