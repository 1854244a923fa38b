"""Metrics that follow from the results of other accumulators, without the samples of the runs."""

import numpy as np

from ab_sim.analysis.metrics.accumulators import (
    BandAccumulator,
    EarlierWhirlAccumulator,
    FinalCirculationAccumulator,
    FinalWhirlAccumulator,
    LastSampleAccumulator,
    PassageAccumulator,
    ResidualAccumulator,
)
from ab_sim.analysis.metrics.judging import JudgedRuns
from ab_sim.analysis.metrics.spindle import SpindleStartAccumulator, SpindleTargetAccumulator
from ab_sim.analysis.metrics.verdict import BALANCED, verdicts
from ab_sim.analysis.startup import settling_begins


class StartUpConclusion:
    """Duration of a start-up from the instant at which the spindle starts."""

    AFTER = (BandAccumulator, SpindleStartAccumulator, SpindleTargetAccumulator)

    def __init__(
        self,
        runs: JudgedRuns,
        band: BandAccumulator,
        start: SpindleStartAccumulator,
        target: SpindleTargetAccumulator,
    ) -> None:
        self.in_band: list[float | None] = [None] * len(runs)
        """Time until the whirl stays in its band [s]."""
        self.ready: list[float | None] = [None] * len(runs)
        """Time until the spindle has reached its final speed as well [s]."""
        times_of_runs = zip(band.found, start.found, target.found, strict=True)
        for run, (in_band, begins, has_speed) in enumerate(times_of_runs):
            if begins is None or in_band is None:
                continue
            self.in_band[run] = max(in_band - begins, 0.0)
            if has_speed is not None:
                self.ready[run] = max(in_band, has_speed) - begins


class SettlingConclusion:
    """Settling period of the thesis."""

    AFTER = (PassageAccumulator,)

    def __init__(self, runs: JudgedRuns, passage: PassageAccumulator) -> None:
        self.found: list[float | None] = [None] * len(runs)
        """Settling period [s]; see ``settling_begins``."""
        for run, passed in enumerate(passage.found):
            begins = None if passed is None else settling_begins(runs.scenes[run])
            if passed is not None and begins is not None:
                self.found[run] = passed - begins


class GradeConclusion:
    """Balance grade at the final speed."""

    AFTER = (ResidualAccumulator, LastSampleAccumulator)

    def __init__(
        self, runs: JudgedRuns, residual: ResidualAccumulator, last: LastSampleAccumulator
    ) -> None:
        self.found = residual.left / runs.numbers.turning * np.abs(last.speed)
        """Balance grade [m/s]: speed of the rotating mass' centre about the shaft."""


class VerdictConclusion:
    """Verdict of a run: whether it has settled, and whether the balls balance the rotor."""

    AFTER = (
        ResidualAccumulator,
        FinalWhirlAccumulator,
        EarlierWhirlAccumulator,
        FinalCirculationAccumulator,
    )

    def __init__(
        self,
        runs: JudgedRuns,
        residual: ResidualAccumulator,
        final: FinalWhirlAccumulator,
        earlier: EarlierWhirlAccumulator,
        circulation: FinalCirculationAccumulator,
    ) -> None:
        numbers = runs.numbers
        unbalance, couple = (
            np.array([np.nan if share is None else share for share in shares], dtype=float)
            for shares in (residual.unbalance, residual.couple)
        )
        within = unbalance <= numbers.most_unbalance
        # A couple that does not exist or does not count is NaN.
        within &= ~(couple > numbers.most_couple)
        circulates = np.array([bunch is not None for bunch in circulation.found])
        unbalanced = np.array([unbalance is not None for unbalance in residual.unbalance])
        has_balls = numbers.moments.shape[1] > 0
        ringing_down = (final.largest <= earlier.largest) & ~residual.rises
        self.found = verdicts(
            within, final.settled, ringing_down, circulates, unbalanced & has_balls
        )
        """Verdict in words; see ``Verdict``."""
        self.balanced = [
            name in BALANCED if has_unbalance else None
            for name, has_unbalance in zip(self.found, unbalanced.tolist(), strict=True)
        ]
        """True for each run with a balanced rotor; None without an unbalance."""
