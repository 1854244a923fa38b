"""Runs of scenes that differ in numbers only, prepared once and run side by side."""

from collections.abc import Sequence

import numpy as np

from ab_sim.design.batch.lane_group import LaneGroup, LaneStarts
from ab_sim.design.batch.prepared_run import PreparedRun
from ab_sim.design.batch.sequential import run_one_by_one
from ab_sim.engine.stepping.side_by_side import LANES, LaneSamples


class AlikeRuns:
    """Runs of scenes that differ from a first one in numbers only.

    The stepper is chosen for the first scene and kept, because a change would make the objective of
    a fit discontinuous. Runs for which it is unstable diverge and count as failed.

    Args:
        first: prepared run of the first scene.
    """

    def __init__(self, first: PreparedRun) -> None:
        self.first = first
        self._lanes = LaneGroup(first, 1) if first.fits_lane else None

    def samples(self, runs: Sequence[PreparedRun]) -> np.ndarray | None:
        """Return all steps of each run, shape (runs, steps, channels); None if a run diverges."""
        steps, channels = self.first.steps, len(self.first.channels)
        if self._lanes is None:
            done, _ = run_one_by_one(runs, 1)
            if any(run.failure for run in done):
                return None
            return np.stack([run.trajectory.samples for run in done])
        samples = np.empty((-(-len(runs) // LANES) * LANES, steps, channels))
        for begin in range(0, len(runs), LANES):
            some = runs[begin : begin + LANES]
            keys = [run.step_plan_key for run in some]
            into = LaneSamples.by_sample(samples[begin : begin + LANES])
            sound, _ = self._lanes.run(LaneStarts.of(some), keys, into)
            if (sound[: len(some)] < steps).any():
                return None
        return samples[: len(runs)]
