"""What is plotted over time of each sample, beside the channels themselves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ab_sim.drive.trajectory import Trajectory
from ab_sim.drive.turns import tilt_of
from ab_sim.recording.colours import BALANCED, DARK, GREY, UNBALANCE, hue
from ab_sim.recording.explained import Explained
from ab_sim.recording.layout import Array, scalar_columns
from ab_sim.recording.plots import lines

Parts = Iterator[tuple[str, Any]]

_BEYOND = 30.0
"""The turn that is plotted ends so far beyond 0 [deg]: balls at the unbalance are not to leap."""


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
        """Angles of the balanced positions [deg]; none where there are many, or -180 is the one."""
        balance = self.explained.balance
        if balance is None or balance.many or balance.residual > 0.0:
            return ()
        angles = in_one_turn(np.array(balance.angles))
        return tuple(sorted({round(angle, 9) for angle in angles.tolist()} - {-180.0}))

    def scenery(self) -> Parts:
        """How they look."""
        whirl = ["W/e", "z/e"] if self.eccentricity else ["W [mm]", "z [mm]"]
        whirl = whirl if self.tilts else whirl[:1]
        yield "/plot/whirl/now", lines(whirl, [2.0] * len(whirl), swings=self.tilts)
        if self.explained.alone is not None:
            yield "/plot/whirl/alone", lines(["without balls, speed held"], colors=[GREY])
        # Where there is no critical speed, its plot is to reach down to 0 at least.
        known = self.explained.critical_speed is not None
        name, color = ("critical speed", UNBALANCE) if known else ("standstill", DARK)
        yield "/plot/speed/level", lines([name], colors=[color])
        if self.tilts:
            yield "/plot/tilt", lines(["alpha", "beta", "gamma"], swings=True)
        if self.balls:
            # Where curves coincide, the first ones show on both sides of the last ones.
            widths = np.linspace(4.0, 1.5, self.balls).tolist()
            names = [f"ball {ball}" for ball in range(self.balls)]
            colors = [hue(ball) for ball in range(self.balls)]
            yield "/plot/balls/angles", lines(names, widths, colors=colors)
            names_of = ["opposite, -180", *["balanced"] * len(self.levels)]
            yield (
                "/plot/balls/levels",
                lines(names_of, colors=[GREY, *[BALANCED] * len(self.levels)]),
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
        yield "/plot/balls/angles", scalar_columns(in_one_turn(run.ball_angles))
        if self.explained.driven is not None:
            yield "/plot/driving", scalar_columns(self.explained.driven.forces(run))

    def constant(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Entities that are lines at one height each, and these heights."""
        yield "/plot/real_time", (1.0,)
        yield "/plot/speed/level", (self.explained.critical_speed or 0.0,)
        if self.balls:
            yield "/plot/balls/levels", (-180.0, *self.levels)


def in_one_turn(angles: Array) -> Array:
    """Angles [rad] in deg, from beyond -330 to 30: the way from the unbalance to its opposite."""
    return np.asarray(_BEYOND - np.remainder(_BEYOND - np.degrees(angles), 360.0))
