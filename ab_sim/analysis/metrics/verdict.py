"""Metrics that follow from the results of other accumulators, without the samples of the runs.

Among them is the verdict: whether a run has settled, and whether the balls balance the rotor.
"""

from enum import Enum

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
from ab_sim.analysis.startup import settling_begins


class Verdict(str, Enum):
    """Verdict of a run, in the words of every command, file and picture."""

    BALANCED = "balanced"
    RINGING_DOWN = "balanced, ringing down"
    """Balls balance the rotor and the whirl still falls: its final value is an upper bound."""
    NOT_BALANCED = "not balanced"
    CHANGING = "not balanced, still changing"
    CIRCULATES = "not balanced, balls circulate"
    SETTLED = "settled"
    """Settled run without balls or without an unbalance."""
    UNSETTLED = "still changing"


BALANCED = (Verdict.BALANCED.value, Verdict.RINGING_DOWN.value)
"""Verdicts of runs whose balls balance the rotor."""
SETTLED = (*BALANCED, Verdict.NOT_BALANCED.value, Verdict.SETTLED.value)
"""Verdicts of runs whose final whirl is, or bounds from above, the whirl that they approach."""


def verdicts(
    within: np.ndarray,
    settled: np.ndarray,
    ringing_down: np.ndarray,
    circulates: np.ndarray,
    can_balance: np.ndarray,
) -> list[str]:
    """Return verdicts from booleans of shape (runs,).

    Parameters
    ----------
    within
        Whether the residual unbalance is within the scene's limit.
    settled
        Whether the whirl has settled.
    ringing_down
        Whether the whirl is no larger than before, and the residual unbalance does not rise.
    circulates
        Whether a ball circulates on the race.
    can_balance
        Whether the scene has an unbalance and balls.
    """
    labels = np.where(settled, Verdict.NOT_BALANCED.value, Verdict.CHANGING.value)
    labels = np.where(within & ringing_down, Verdict.RINGING_DOWN.value, labels)
    labels = np.where(within & settled, Verdict.BALANCED.value, labels)
    without = np.where(settled, Verdict.SETTLED.value, Verdict.UNSETTLED.value)
    labels = np.where(can_balance, labels, without)
    names: list[str] = np.where(circulates, Verdict.CIRCULATES.value, labels).tolist()
    return names


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
        """Time from the spindle's start until the whirl stays in its band [s]; None if never."""
        self.ready: list[float | None] = [None] * len(runs)
        """Time from the spindle's start to final speed and whirl in its band [s]; None if never."""
        times_of_runs = zip(band.times, start.each("begin"), target.each("reached"), strict=True)
        for run, (in_band, begin, at_speed) in enumerate(times_of_runs):
            if begin is None or in_band is None:
                continue
            self.in_band[run] = max(in_band - begin, 0.0)
            if at_speed is not None:
                self.ready[run] = max(in_band, at_speed) - begin


class SettlingConclusion:
    """Settling period of the thesis."""

    AFTER = (PassageAccumulator,)

    def __init__(self, runs: JudgedRuns, passage: PassageAccumulator) -> None:
        self.periods: list[float | None] = [None] * len(runs)
        """Settling period of each run [s], from ``settling_begins``; None if it does not end."""
        for run, passed in enumerate(passage.times):
            begin = None if passed is None else settling_begins(runs.scenes[run])
            if passed is not None and begin is not None:
                self.periods[run] = passed - begin


class GradeConclusion:
    """Balance grade at the final speed."""

    AFTER = (ResidualAccumulator, LastSampleAccumulator)

    def __init__(
        self, runs: JudgedRuns, residual: ResidualAccumulator, last: LastSampleAccumulator
    ) -> None:
        self.grades = residual.moments / runs.numbers.turning * np.abs(last.speed)
        """Balance grade of each run [m/s]: speed of the rotating mass' centre about the shaft."""


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
            for shares in (residual.unbalance.shares, residual.couple.shares)
        )
        within = unbalance <= numbers.most_unbalance
        # A couple that does not exist or does not count is NaN.
        within &= ~(couple > numbers.most_couple)
        circulates = np.array([bunch is not None for bunch in circulation.circulations])
        unbalanced = np.array([share is not None for share in residual.unbalance.shares])
        has_balls = numbers.moments.shape[1] > 0
        ringing_down = (final.largest <= earlier.largest) & ~residual.rises
        self.verdicts = verdicts(
            within, final.settled, ringing_down, circulates, unbalanced & has_balls
        )
        """Verdict of each run in words; see ``Verdict``."""
        self.balanced = [
            name in BALANCED if has_unbalance else None
            for name, has_unbalance in zip(self.verdicts, unbalanced.tolist(), strict=True)
        ]
        """True for each run with a balanced rotor; None without an unbalance."""
