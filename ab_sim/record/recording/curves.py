"""Curves over time that are computed from the channels, and the style of plots."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping

from ab_sim.base.palette import (
    BALANCED,
    GREY,
    LIMIT,
    RUN,
    WITHOUT_BALLS,
    Colour,
    ball_colour,
    series_colours,
)
from ab_sim.base.presentation import in_one_turn
from ab_sim.drive.trajectory import Trajectory, tilt_of
from ab_sim.record.recording.explanation import Explanation
from ab_sim.record.recording.layout import CHANNELS, DERIVED, SAMPLES, Array, vector_columns
from ab_sim.record.recording.shapes import ROTOR

_BALL = re.compile(r"ball[_ ](\d+)")


class PlottedCurves(NamedTuple):
    """Curves of a plot: a component, which may have several series, and their style."""

    entity: str
    """Entity with the component."""
    component: str
    style: rr.SeriesLines
    """Names, colours and widths of the series."""

    @classmethod
    def of_channels(cls, group: str, style: rr.SeriesLines) -> PlottedCurves:
        """Return the curves of a group of channels."""
        return cls(SAMPLES, f"{CHANNELS}:{group}", style)

    @classmethod
    def derived(cls, entity: str, name: str, style: rr.SeriesLines) -> PlottedCurves:
        """Return the computed curves ``name`` of an entity."""
        return cls(entity, f"{DERIVED}:{name}", style)


def plot(
    name: str,
    *curves: PlottedCurves | str,
    corner: rrb.Corner2D = rrb.Corner2D.RightTop,
    legend: bool = True,
    span: tuple[float, float] | None = None,
) -> rrb.View:
    """Return a plot over time.

    Parameters
    ----------
    name
        Title of the plot.
    curves
        Curves, or entities whose scalars are plotted with their own style.
    corner
        Corner of the legend.
    legend
        Whether there is a legend.
    span
        Range of the vertical axis; None: automatic.
    """
    drawn: dict[Any, Any] = {}
    for curve in curves:
        if isinstance(curve, PlottedCurves):
            source = VisualizerComponentMapping(
                "Scalars:scalars",
                ComponentSourceKind.SourceComponent,
                source_component=curve.component,
            )
            drawn.setdefault(curve.entity, []).append(curve.style.visualizer(mappings=[source]))
    entities = [curve.entity if isinstance(curve, PlottedCurves) else curve for curve in curves]
    return rrb.TimeSeriesView(
        name=name,
        contents=list(dict.fromkeys(entities)),
        overrides=drawn,
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),  # zooming one plot zooms all
        axis_y=rrb.ScalarAxis(range=span) if span else None,
        # On the right, where the legend covers the end: the beginning of a run matters most.
        plot_legend=rrb.PlotLegend(corner, visible=legend),
    )


def lines(
    names: Sequence[str],
    widths: Sequence[float] | None = None,
    swings: bool = False,
    colors: Sequence[Colour] | None = None,
) -> rr.SeriesLines:
    """Return the style of the series of a component.

    Parameters
    ----------
    names
        Names of the series.
    widths
        Widths of the lines; None: default.
    swings
        Whether the signals oscillate about 0. If there are more samples than pixels, Rerun then
        shows their range instead of their mean, which is about 0.
    colors
        Colours of the lines; None: default.
    """
    if colors is None:
        colors = _colours(names)
    if widths is None:
        widths = [3.0 if name == "speed" else 1.5 for name in names]  # the command covers the speed
    policy = rr.components.AggregationPolicy.MinMax if swings else None
    return rr.SeriesLines(
        names=list(names), colors=list(colors), widths=list(widths), aggregation_policy=policy
    )


def _colours(names: Sequence[str]) -> list[Colour]:
    """Return a colour per series: that of the ball, grey for the command, else one of a cycle."""
    balls = [_BALL.match(name) for name in names]
    return [
        ball_colour(int(ball[1])) if ball else GREY if name == "command" else other
        for name, ball, other in zip(names, balls, series_colours(len(names)), strict=True)
    ]


FRAMES = ROTOR
"""Entity of curves with a row for each frame of the drawings, not for each sample. It is that of
the rotor, which moves in each frame: a viewer without a GPU can process few messages at a time."""
_LEAST = 1e-4
"""Whirl, in e or mm, below which the logarithmic plot of the whirl has no points."""
_WHIRL, _LENGTHS = "whirl", "vector_lengths"
_WITHOUT_BALLS, _TILT, _HEIGHT, _BALLS = "without_balls", "tilt", "height", "balls"
_LEVELS, _DRIVING = "balls_levels", "driving"
_PHASE = "phase"
_SPEED_LEVEL, _REAL_TIME = "speed_level", "real_time"


@dataclass(frozen=True)
class Curves:
    """Computed curves of a drive: their styles and values."""

    balls: int
    """Number of balls."""
    eccentricity: float
    """Eccentricity e [mm]."""
    tilts: bool
    """True if the deck moves in space."""
    explanation: Explanation
    """Quantities that some of the curves show."""

    @property
    def levels(self) -> tuple[float, ...]:
        """Ball angles of the balanced position [deg], except -180, sorted.

        They are empty if there are many such positions, or none.
        """
        balance = self.explanation.balance
        if balance is None or balance.many or balance.residual > 0.0:
            return ()
        angles = np.degrees(in_one_turn(np.array(balance.angles)))
        return tuple(sorted({round(angle, 9) for angle in angles.tolist()} - {-180.0}))

    def whirl(self) -> list[PlottedCurves]:
        """Return the curves of log10 of the whirl: of this run, and without balls if known."""
        style = lines(["this run"], [2.0])
        curves = [PlottedCurves.derived(SAMPLES, _WHIRL, style)]
        if self.explanation.without_balls is not None:
            style = lines(["without balls"], colors=[WITHOUT_BALLS])
            curves.insert(0, PlottedCurves.derived(FRAMES, _WITHOUT_BALLS, style))
        return curves

    def vector_lengths(self, channels: Sequence[str]) -> list[PlottedCurves]:
        """Return the curves of the lengths of the deck's acceleration and of sensor readings."""
        names = [
            "|a| of the deck" if name == "deck_acceleration" else name.removeprefix("sensor_")
            for name in vector_columns(channels)
        ]
        style = lines(names, [1.0] * len(names))
        return [PlottedCurves.derived(SAMPLES, _LENGTHS, style)] if names else []

    def speed_level(self) -> PlottedCurves:
        """Return the line of the critical speed."""
        # Without a critical speed, the line is at 0, so that the plot includes standstill.
        is_known = self.explanation.critical_speed is not None
        name = "critical speed" if is_known else "standstill"
        return PlottedCurves.derived(FRAMES, _SPEED_LEVEL, lines([name], colors=[LIMIT]))

    @staticmethod
    def real_time() -> PlottedCurves:
        """Return the reference line of real time."""
        return PlottedCurves.derived(
            FRAMES, _REAL_TIME, rr.SeriesLines(names="real time", colors=GREY)
        )

    @staticmethod
    def tilt() -> PlottedCurves:
        """Return the tilt curves of a deck in space."""
        return PlottedCurves.derived(FRAMES, _TILT, lines(["alpha", "beta", "gamma"], swings=True))

    @staticmethod
    def height() -> PlottedCurves:
        """Return the curve of the shaft's height, for a deck in space."""
        return PlottedCurves.derived(SAMPLES, _HEIGHT, lines(["z"], swings=True))

    def angles(self) -> list[PlottedCurves]:
        """Return the curves of the balls' angles, and of the balanced positions."""
        style = lines(["opposite, -180", *["balanced"] * len(self.levels)],
                      colors=[LIMIT, *[BALANCED] * len(self.levels)])  # fmt: skip
        return [
            PlottedCurves.derived(FRAMES, _LEVELS, style),
            PlottedCurves.derived(FRAMES, _BALLS, lines(*self._names_and_widths())),
        ]

    def driving(self) -> PlottedCurves:
        """Return the curves of the driving forces on the balls."""
        style = lines(*self._names_and_widths(), swings=True)
        return PlottedCurves.derived(FRAMES, _DRIVING, style)

    @staticmethod
    def phase() -> PlottedCurves:
        """Return the curve of the phase of the whirl's once-per-turn part."""
        return PlottedCurves.derived(FRAMES, _PHASE, lines(["phase"], [2.0], colors=[RUN]))

    def of_samples(self, run: Trajectory, channels: Sequence[str], rows: Array) -> dict[str, Array]:
        """Return the values of curves with a row per sample, by name, of shape (rows, series).

        Parameters
        ----------
        run
            Samples, with the channels that drawings use.
        channels
            Channels of ``rows``.
        rows
            Recorded samples, of shape (rows, channels).
        """
        values = {_WHIRL: self._logarithm(run.whirl)}
        if self.tilts:
            values[_HEIGHT] = 1e6 * run["z"][:, None]
        lengths = [
            np.linalg.norm(rows[:, columns], axis=1)
            for columns in vector_columns(channels).values()
        ]
        if lengths:
            values[_LENGTHS] = np.column_stack(lengths)
        return values

    def of_frames(
        self, run: Trajectory, phase: Array, without_balls: Array | None
    ) -> dict[str, Array]:
        """Return the values of curves with a row per frame, by name, of shape (frames, series).

        Parameters
        ----------
        run
            Samples of the frames.
        phase
            Angle of `ab_sim.drive.turn_vector.TurnVector` [rad], shape (frames,).
        without_balls
            Whirl without balls [m], shape (frames,); None: unknown.
        """
        explanation, rows = self.explanation, len(run)
        # Constant lines have a value in every row, because the time axis of a plot spans its data.
        values = {
            _REAL_TIME: np.ones((rows, 1)),
            _SPEED_LEVEL: np.full((rows, 1), explanation.critical_speed or 0.0),
            _PHASE: np.degrees(in_one_turn(phase))[:, None],
        }
        if self.tilts:
            values[_TILT] = 1e3 * tilt_of(run.turn)
        if without_balls is not None:
            values[_WITHOUT_BALLS] = self._logarithm(without_balls)
        if self.balls:
            values[_LEVELS] = np.tile((-180.0, *self.levels), (rows, 1))
            values[_BALLS] = np.degrees(in_one_turn(run.ball_angles))
            if explanation.driven is not None:
                values[_DRIVING] = explanation.driven.forces(run)
        return values

    def _logarithm(self, whirl: Array) -> Array:
        """Return log10 of W/e, or of W in mm, as a column; below ``_LEAST``, NaN is not drawn."""
        values = 1e3 * whirl[:, None] / (self.eccentricity or 1.0)
        return np.log10(np.where(values >= _LEAST, values, np.nan))

    def _names_and_widths(self) -> tuple[list[str], list[float]]:
        """Return names and widths of the curves with a line per ball."""
        # Earlier curves are wider, so that they are visible next to later curves that coincide.
        widths = np.linspace(4.0, 1.5, self.balls).tolist()
        return [f"ball {ball}" for ball in range(self.balls)], widths
