"""What follows from what several watches have found; none of it looks at the runs themselves."""

import numpy as np

from ab_sim.analysis.merits.judging import JudgedRuns
from ab_sim.analysis.merits.spindle import SpindleStartWatch, SpindleTargetWatch
from ab_sim.analysis.merits.verdict import BALANCED, verdicts
from ab_sim.analysis.merits.watches import (
    BandWatch,
    EarlierWhirlWatch,
    FinalCirculationWatch,
    FinalWhirlWatch,
    LastSampleWatch,
    PassageWatch,
    ResidualWatch,
)
from ab_sim.analysis.startup import settling_begins


class StartUpConclusion:
    """How long a start-up takes, from the instant at which the spindle starts."""

    AFTER = (BandWatch, SpindleStartWatch, SpindleTargetWatch)

    def __init__(
        self,
        runs: JudgedRuns,
        band: BandWatch,
        start: SpindleStartWatch,
        target: SpindleTargetWatch,
    ) -> None:
        self.in_band: list[float | None] = [None] * len(runs)
        """Until the whirl stays in its band [s]."""
        self.ready: list[float | None] = [None] * len(runs)
        """Until the spindle has its last speed, too [s]."""
        found = zip(band.found, start.found, target.found, strict=True)
        for run, (in_band, begins, has_speed) in enumerate(found):
            if begins is None or in_band is None:
                continue
            self.in_band[run] = max(in_band - begins, 0.0)
            if has_speed is not None:
                self.ready[run] = max(in_band, has_speed) - begins


class SettlingConclusion:
    """The thesis' settling period."""

    AFTER = (PassageWatch,)

    def __init__(self, runs: JudgedRuns, passage: PassageWatch) -> None:
        self.found: list[float | None] = [None] * len(runs)
        """s; see ``settling_begins``."""
        for run, passed in enumerate(passage.found):
            begins = None if passed is None else settling_begins(runs.scenes[run])
            if passed is not None and begins is not None:
                self.found[run] = passed - begins


class GradeConclusion:
    """The balance grade at the last speed."""

    AFTER = (ResidualWatch, LastSampleWatch)

    def __init__(self, runs: JudgedRuns, residual: ResidualWatch, last: LastSampleWatch) -> None:
        self.found = residual.left / runs.numbers.turning * np.abs(last.speed)
        """m/s: the speed of the turning mass' centre about the shaft."""


class VerdictConclusion:
    """Whether a run has settled, and the balls balance the rotor in the end."""

    AFTER = (ResidualWatch, FinalWhirlWatch, EarlierWhirlWatch, FinalCirculationWatch)

    def __init__(
        self,
        runs: JudgedRuns,
        residual: ResidualWatch,
        final: FinalWhirlWatch,
        earlier: EarlierWhirlWatch,
        circulation: FinalCirculationWatch,
    ) -> None:
        numbers = runs.numbers
        unbalance, couple = (
            np.array([np.nan if share is None else share for share in shares], dtype=float)
            for shares in (residual.unbalance, residual.couple)
        )
        within = unbalance <= numbers.most_unbalance
        # A couple that there is not, or does not count, is NaN.
        within &= ~(couple > numbers.most_couple)
        circulates = np.array([found is not None for found in circulation.found])
        unbalanced = np.array([left is not None for left in residual.unbalance])
        has_balls = numbers.moments.shape[1] > 0
        ringing_down = (final.largest <= earlier.largest) & ~residual.rises
        self.found = verdicts(
            within, final.settled, ringing_down, circulates, unbalanced & has_balls
        )
        """In words; see ``Verdict``."""
        self.balanced = [
            name in BALANCED if has_unbalance else None
            for name, has_unbalance in zip(self.found, unbalanced.tolist(), strict=True)
        ]
        """None without an unbalance."""
