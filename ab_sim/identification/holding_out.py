"""Validation on recordings that were not fitted."""

from collections.abc import Sequence

import numpy as np

from ab_sim.base.presentation import Progress
from ab_sim.base.workers import Workers
from ab_sim.identification.measured import Measured
from ab_sim.identification.problem import Problem
from ab_sim.identification.residuals import noises_of, total_z, whiteness_over
from ab_sim.identification.result import HeldOut, RecordingFit
from ab_sim.identification.stages import StagedFit


def held_out(
    problem: Problem, values: np.ndarray, recordings: Sequence[Measured], seed: int, tell: Progress,
    workers: Workers,
) -> tuple[HeldOut, list[RecordingFit]]:  # fmt: skip
    """Evaluate a fit on other recordings; only their own parameters are fitted.

    Args:
        problem: problem that was fitted.
        values: values of its parameters [SI].
        recordings: recordings held out.
        seed: seed of their start angles.
        tell: progress callback.
        workers: worker processes for the search.

    Returns:
        Quality of the fit on these recordings, and the recordings that could be simulated.
    """
    count = len(problem.common)
    noise = noises_of(recordings)
    shares, comparisons = [], []
    for common in (problem.start[:count], values[:count]):
        changed = [
            parameter._replace(start=float(value))
            for parameter, value in zip(problem.common, common, strict=True)
        ]
        other = Problem(problem.scene, changed, recordings, noise)
        fit = StagedFit(other, range(count), seed, tell, workers).run()
        simulated = [other.simulated(k, fit.values) for k in range(len(recordings))]
        comparisons = [
            RecordingFit(measured, signals, True)
            for measured, signals in zip(recordings, simulated, strict=True)
            if signals is not None
        ]
        problem.runs += other.runs
        shares.append(_share(comparisons) if len(comparisons) == len(simulated) else np.inf)
    judged = whiteness_over(other, fit.values)
    return HeldOut(shares[0], shares[1], total_z(judged)), comparisons


def _share(comparisons: Sequence[RecordingFit]) -> float:
    """Return the r.m.s. of residuals relative to that of the signals."""
    parts = [
        np.nanmean(comparison.residuals**2) / comparison.measured.rms**2
        for comparison in comparisons
    ]
    return float(np.sqrt(np.mean(parts)))
