"""What is plotted over time of each sample, beside the channels themselves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr

from ab_sim.drive.trajectory import Trajectory
from ab_sim.drive.turns import tilt_of
from ab_sim.recording.colours import BALANCED, GREY, UNBALANCE, WHITE, hue
from ab_sim.recording.explained import Explained
from ab_sim.recording.layout import scalar_columns
from ab_sim.recording.plots import level, lines

Parts = Iterator[tuple[str, Any]]

_BEYOND = 30.0
"""Lines are drawn in the turn in which the first ball is, which ends so far beyond 0 [deg]: balls
that rest at the unbalance are not to make them leap."""


@dataclass(frozen=True)
class Curves:
    """Which curves there are."""

    balls: int
    eccentricity: float
    """e [mm]."""
    tilts: bool
    explained: Explained

    @property
    def levels(self) -> tuple[float, ...]:
        """Angles of the balanced positions in one turn, from -360 to 0 [deg]; none of many."""
        balance = self.explained.balance
        if balance is None or balance.many or balance.residual > 0.0:
            return ()
        angles = {round(float(np.degrees(angle)) % 360.0, 9) - 360.0 for angle in balance.angles}
        return tuple(sorted(angles - {-180.0}))

    def scenery(self) -> Parts:
        """How they look."""
        whirl = ["W/e", "z/e"] if self.eccentricity else ["W [mm]", "z [mm]"]
        whirl = whirl if self.tilts else whirl[:1]
        yield "/plot/whirl/now", lines(whirl, [2.0] * len(whirl), swings=self.tilts)
        if self.explained.alone is not None:
            yield "/plot/whirl/alone", level("without balls, speed held", GREY)
        if self.explained.critical_speed is not None:
            yield "/plot/speed/critical", level("critical speed", UNBALANCE)
        if self.tilts:
            yield "/plot/tilt", lines(["alpha", "beta", "gamma"], swings=True)
        if self.balls:
            # Where curves coincide, the first ones show on both sides of the last ones.
            widths = np.linspace(4.0, 1.5, self.balls).tolist()
            names = [f"ball {ball}" for ball in range(self.balls)]
            colors = [hue(ball) for ball in range(self.balls)]
            yield "/plot/balls/angles", lines(names, widths, colors=colors)
            yield "/plot/balls/opposite", level("-180 (opposite)", WHITE)
            if self.levels:
                yield (
                    "/plot/balls/balanced",
                    rr.SeriesLines(
                        names=["balanced"] * len(self.levels), colors=BALANCED, widths=1.5
                    ),
                )
            if self.explained.driven is not None:
                yield "/plot/driving", lines(names, widths, swings=True, colors=colors)

    def frames(self, run: Trajectory) -> Parts:
        """Columns, one row per sample."""
        unit = self.eccentricity or 1.0
        whirl = [1e3 * run.whirl / unit]
        if self.tilts:
            whirl.append(1e3 * run["z"] / unit)
            yield "/plot/tilt", scalar_columns(1e3 * tilt_of(run.turn))
        yield "/plot/whirl/now", scalar_columns(np.column_stack(whirl))
        if self.explained.alone is not None:
            alone = 1e3 * self.explained.alone.whirl(run["speed"]) / unit
            yield "/plot/whirl/alone", scalar_columns(alone[:, None])
        if not self.balls:
            return
        angles = np.degrees(run.ball_angles)
        yield "/plot/balls/angles", scalar_columns(angles)
        turn = 360.0 * np.ceil((angles[:, :1] - _BEYOND) / 360.0)
        yield "/plot/balls/opposite", scalar_columns(turn - 180.0)
        if self.levels:
            yield "/plot/balls/balanced", scalar_columns(turn + np.array(self.levels))
        if self.explained.driven is not None:
            yield "/plot/driving", scalar_columns(self.explained.driven.forces(run))

    def constant(self) -> Iterator[tuple[str, float]]:
        """Entities that are lines at one height, and that height."""
        if self.explained.critical_speed is not None:
            yield "/plot/speed/critical", self.explained.critical_speed
        yield "/plot/real_time", 1.0
