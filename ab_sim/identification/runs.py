"""Many runs of one kind of scene, whose numbers differ: prepared once, run side by side."""

from collections.abc import Sequence

import numpy as np

from ab_sim.batch.lane_group import LaneGroup, LaneStarts
from ab_sim.batch.prepared_run import PreparedRun
from ab_sim.batch.sample_buffer import SampleBuffer
from ab_sim.batch.sequential import SequentialRuns
from ab_sim.stepping.side_by_side import LANES, LaneSamples


class AlikeRuns:
    """Runs of scenes that differ from one in numbers only.

    The stepper is chosen for that one, and stays: a fit would not be smooth otherwise. Runs with
    which it is not stable diverge, and are refused as such.

    Args:
        first: the one, prepared.
    """

    def __init__(self, first: PreparedRun) -> None:
        self.first = first
        shape = first.steps, len(first.channels)
        self._lanes = LaneGroup(first, 1) if first.fits_lane else None
        self._one_by_one = (
            None if first.fits_lane else SequentialRuns(first, SampleBuffer(0, shape))
        )

    def samples(self, runs: Sequence[PreparedRun]) -> np.ndarray | None:
        """All steps of each, shape (runs, steps, channels); None where one of them diverged."""
        steps, channels = self.first.steps, len(self.first.channels)
        if self._lanes is None:
            assert self._one_by_one is not None
            done, _ = self._one_by_one.run(runs, 1)
            if any(run.failure for run in done):
                return None
            return np.stack([run.trajectory.samples for run in done])
        found = np.empty((-(-len(runs) // LANES) * LANES, steps, channels))
        for begin in range(0, len(runs), LANES):
            some = runs[begin : begin + LANES]
            keys = [run.step_plan_key for run in some]
            into = LaneSamples.by_sample(found[begin : begin + LANES])
            sound, _ = self._lanes.run(LaneStarts.of(some), keys, into)
            if (sound[: len(some)] < steps).any():
                return None
        return found[: len(runs)]
