"""What follows from what several watches have found; none of it looks at the run itself."""

import math

from ab_sim.analysis.merits.judging import JudgedRun
from ab_sim.analysis.merits.spindle import SpindleStartWatch, SpindleTargetWatch
from ab_sim.analysis.merits.watches import (
    BandWatch,
    FinalCirculationWatch,
    FinalWhirlWatch,
    LastSampleWatch,
    PassageWatch,
    ResidualWatch,
)
from ab_sim.analysis.startup import settling_begins
from ab_sim.scene.sections import Balanced


class StartUpConclusion:
    """How long a start-up takes, from the instant at which the spindle starts."""

    AFTER = (BandWatch, SpindleStartWatch, SpindleTargetWatch)

    def __init__(
        self,
        run: JudgedRun,
        band: BandWatch,
        start: SpindleStartWatch,
        target: SpindleTargetWatch,
    ) -> None:
        self.in_band: float | None = None
        """Until the whirl stays in its band [s]."""
        self.ready: float | None = None
        """Until the spindle has its last speed, too [s]."""
        if start.found is None or band.found is None:
            return
        self.in_band = max(band.found - start.found, 0.0)
        if target.found is not None:
            self.ready = max(band.found, target.found) - start.found


class SettlingConclusion:
    """The thesis' settling period."""

    AFTER = (PassageWatch,)

    def __init__(self, run: JudgedRun, passage: PassageWatch) -> None:
        begins = None if passage.found is None else settling_begins(run.scene)
        self.found: float | None = None
        """s; see ``settling_begins``."""
        if passage.found is not None and begins is not None:
            self.found = passage.found - begins


class GradeConclusion:
    """The balance grade at the last speed."""

    AFTER = (ResidualWatch, LastSampleWatch)

    def __init__(self, run: JudgedRun, residual: ResidualWatch, last: LastSampleWatch) -> None:
        turning = run.scene.eccentric_mass + math.fsum(run.scene.balls.masses)
        self.found = residual.left / turning * abs(last.speed)
        """m/s: the speed of the turning mass' centre about the shaft."""


class BalancedConclusion:
    """Whether the balls balance the rotor in the end."""

    AFTER = (ResidualWatch, FinalWhirlWatch, FinalCirculationWatch)

    def __init__(
        self,
        run: JudgedRun,
        residual: ResidualWatch,
        final: FinalWhirlWatch,
        circulation: FinalCirculationWatch,
    ) -> None:
        left, couple = residual.unbalance.value_if_any, residual.couple.value_if_any
        limits = run.scene.balanced or Balanced()
        within = left is not None and left <= limits.residual_unbalance
        if limits.residual_couple is not None and couple is not None:
            within = within and couple <= limits.residual_couple
        self.found = None if left is None else within and final.settled and not circulation.found
        """None without an unbalance."""
