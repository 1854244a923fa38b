"""Prepared runs with samples, computed eight side by side if possible."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from ab_sim.design.batch.lane_group import LaneGroup, LaneStarts
from ab_sim.design.batch.prepared_run import (
    BatchRun,
    PreparedRun,
    grouped,
    kernel_stride,
    sample_buffer_for,
)
from ab_sim.design.batch.sample_buffer import SampleBuffer
from ab_sim.design.batch.sequential import run_one_by_one
from ab_sim.engine.stepping.side_by_side import LANES, LaneSamples


class DoneRuns(NamedTuple):
    """Finished runs; see ``Batch``."""

    runs: tuple[BatchRun, ...]
    in_lanes: int
    integration_seconds: float


def run_prepared(
    prepared: Sequence[PreparedRun],
    every: int,
    progress: Callable[[int, int], None] | None = None,
) -> DoneRuns:
    """Run prepared runs, equal kinds side by side if possible.

    Args:
        prepared: runs in the order of the results.
        every, progress: see ``simulate_batch``.
    """
    runs: list[BatchRun | None] = [None] * len(prepared)
    seconds, done, in_lanes = 0.0, 0, 0
    for members in grouped(prepared).values():
        first = prepared[members[0]]
        sample_buffer = sample_buffer_for([prepared[i] for i in members], every)
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

    Args:
        lane_group: lane group of the runs.
        members: up to eight runs.
        every: keep every ``every``-th step.
        sample_buffer: memory for their samples.
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
