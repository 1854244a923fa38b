"""Curves over time that are derived from the channels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr

from ab_sim.conventions import in_one_turn
from ab_sim.drive.orientation import tilt_of
from ab_sim.drive.trajectory import Trajectory
from ab_sim.recording.colours import BALANCED, DARK, GREY, UNBALANCE, hue
from ab_sim.recording.explanation import Explanation
from ab_sim.recording.layout import SAMPLES, Array, vector_columns
from ab_sim.recording.plots import PlottedCurves, lines

FRAMES = "/plot/frames"
"""The entity of curves that have a row for each frame of the pictures, and not for each sample."""
_WHIRL, _FELT = "whirl", "felt"
_ALONE, _TILT, _BALLS, _LEVELS, _DRIVING = "alone", "tilt", "balls", "balls_levels", "driving"
_SPEED_LEVEL, _REAL_TIME = "speed_level", "real_time"


@dataclass(frozen=True)
class Curves:
    """Which curves there are."""

    balls: int
    eccentricity: float
    """e [mm]."""
    tilts: bool
    explained: Explanation

    @property
    def levels(self) -> tuple[float, ...]:
        """Angles of the balanced positions [deg]; none where there are many, or -180 is the one."""
        balance = self.explained.balance
        if balance is None or balance.many or balance.residual > 0.0:
            return ()
        angles = in_one_turn(np.array(balance.angles))
        return tuple(sorted({round(angle, 9) for angle in angles.tolist()} - {-180.0}))

    def whirl(self) -> list[PlottedCurves]:
        """W/e, or W where there is no e, and of a deck in space the height."""
        names = ["W/e", "z/e"] if self.eccentricity else ["W [mm]", "z [mm]"]
        names = names if self.tilts else names[:1]
        look = lines(names, [2.0] * len(names), swings=self.tilts)
        curves = [PlottedCurves.derived(SAMPLES, _WHIRL, look)]
        if self.explained.alone is not None:
            look = lines(["without balls, speed held"], colors=[GREY])
            curves.append(PlottedCurves.derived(FRAMES, _ALONE, look))
        return curves

    def vector_lengths(self, channels: Sequence[str]) -> list[PlottedCurves]:
        """Lengths of the deck's acceleration and of readings."""
        names = [
            "|a| of the deck" if name == "deck_acceleration" else name.removeprefix("sensor_")
            for name in vector_columns(channels)
        ]
        look = lines(names, [1.0] * len(names), colors=[hue(i) for i in range(len(names))])
        return [PlottedCurves.derived(SAMPLES, _FELT, look)] if names else []

    def speed_level(self) -> PlottedCurves:
        """The critical speed."""
        # Where there is none, the plot is to reach down to 0 at least.
        known = self.explained.critical_speed is not None
        name, color = ("critical speed", UNBALANCE) if known else ("standstill", DARK)
        return PlottedCurves.derived(FRAMES, _SPEED_LEVEL, lines([name], colors=[color]))

    @staticmethod
    def real_time() -> PlottedCurves:
        """What keeps up."""
        return PlottedCurves.derived(
            FRAMES, _REAL_TIME, rr.SeriesLines(names="real time", colors=GREY)
        )

    def tilt(self) -> PlottedCurves:
        """Of a deck in space."""
        return PlottedCurves.derived(FRAMES, _TILT, lines(["alpha", "beta", "gamma"], swings=True))

    def angles(self) -> list[PlottedCurves]:
        """Of the balls, and those where they balance."""
        names, widths, colors = self._of_balls()
        look = lines(["opposite, -180", *["balanced"] * len(self.levels)],
                     colors=[GREY, *[BALANCED] * len(self.levels)])  # fmt: skip
        return [
            PlottedCurves.derived(FRAMES, _LEVELS, look),
            PlottedCurves.derived(FRAMES, _BALLS, lines(names, widths, colors=colors)),
        ]

    def driving(self) -> PlottedCurves:
        """Forces on the balls."""
        names, widths, colors = self._of_balls()
        return PlottedCurves.derived(
            FRAMES, _DRIVING, lines(names, widths, swings=True, colors=colors)
        )

    def of_samples(self, run: Trajectory, channels: Sequence[str], rows: Array) -> dict[str, Array]:
        """Values that every sample has, shape (rows, series).

        Args:
            run: the rows, with the channels that pictures use.
            channels: of ``rows``.
            rows: as they were recorded.
        """
        unit = self.eccentricity or 1.0
        whirl = [1e3 * run.whirl / unit]
        if self.tilts:
            whirl.append(1e3 * run["z"] / unit)
        values = {_WHIRL: np.column_stack(whirl)}
        lengths = [
            np.linalg.norm(rows[:, columns], axis=1)
            for columns in vector_columns(channels).values()
        ]
        if lengths:
            values[_FELT] = np.column_stack(lengths)
        return values

    def of_frames(self, run: Trajectory) -> dict[str, Array]:
        """Values that every frame has."""
        explained, rows = self.explained, len(run)
        # Lines at one height, in every row: a plot spans the data that it holds.
        values = {
            _REAL_TIME: np.ones((rows, 1)),
            _SPEED_LEVEL: np.full((rows, 1), explained.critical_speed or 0.0),
        }
        if self.tilts:
            values[_TILT] = 1e3 * tilt_of(run.turn)
        if explained.alone is not None:
            alone = 1e3 * explained.alone.whirl(run["speed"]) / (self.eccentricity or 1.0)
            values[_ALONE] = alone[:, None]
        if self.balls:
            values[_LEVELS] = np.tile((-180.0, *self.levels), (rows, 1))
            values[_BALLS] = in_one_turn(run.ball_angles)
            if explained.driven is not None:
                values[_DRIVING] = explained.driven.forces(run)
        return values

    def _of_balls(self) -> tuple[list[str], list[float], list[tuple[int, int, int]]]:
        """Names, widths and colours."""
        # Where curves coincide, the first ones show on both sides of the last ones.
        widths = np.linspace(4.0, 1.5, self.balls).tolist()
        balls = range(self.balls)
        return [f"ball {ball}" for ball in balls], widths, [hue(ball) for ball in balls]
