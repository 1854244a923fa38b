"""Content of a recording for the viewer: drawings and plots, or only plots of unknown positions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ab_sim.base.errors import RecordingError
from ab_sim.base.presentation import NOTATION, in_one_turn
from ab_sim.drive.closed_forms import WhirlWithoutBalls
from ab_sim.drive.trajectory import Trajectory, channels_for
from ab_sim.drive.turn_vector import TurnVector
from ab_sim.record.recording.blueprint import blueprint, plain_blueprint
from ab_sim.record.recording.curves import FRAMES
from ab_sim.record.recording.drawing import Drawing
from ab_sim.record.recording.explanation import Explanation
from ab_sim.record.recording.layout import Array, layout_of, plotted_columns
from ab_sim.record.recording.signals import Final, FinalRms, FrameRate
from ab_sim.record.recording.vibration import Sent, SpindlePhase, VibrationCurves

ALWAYS = ("step", "time")
"""First channels of every recording."""
PERIOD = 1e-2
"""Shortest time between two frames [s]. A screen shows no more, and a frame takes as much space as
three samples. Channels are recorded at every step."""

_PLANE = ("x", "y", "ax", "ay")
_SPACE = ("x", "y", "z", "ax", "ay", "az", "qw", "qx", "qy", "qz")


def _legend_text(drawing: Drawing, final: Final | None, without_balls: Final | None) -> str:
    """Return the text next to the drawings, in Markdown.

    Parameters
    ----------
    drawing
        Drawing of the drive.
    final
        Final whirl [m]; None if unknown.
    without_balls
        Final whirl of the drive without balls [m]; None if unknown.
    """
    explanation = drawing.explanation
    parts = [
        *_final_text(drawing, final, without_balls),
        "**Play**: space. For a tenth of the speed, click 1.00x below and type 0.1; in a narrow "
        "window show the time panel first, by its button at the top.",
        f"**{_balls_text(drawing.balls)}**, R = {drawing.race_radius:g} mm, e = "
        f"{drawing.eccentricity:g} mm. {_space_text(drawing)}; grey: the deck at rest.",
        *_arrows_text(drawing),
        *_balance_text(explanation),
        *_without_balls_text(explanation),
        f"{NOTATION}.",
    ]
    return "\n\n".join(parts) + "\n"


def _final_text(drawing: Drawing, final: Final | None, without_balls: Final | None) -> list[str]:
    """Return a sentence on the final whirl; empty if it is unknown."""
    if final is None:
        return []
    e = 1e-3 * drawing.eccentricity
    text = f"W/e = {final.rms / e:.3g}" if e else f"W = {1e3 * final.rms:.3g} mm"
    share = ""
    if without_balls and without_balls.rms:
        share = f", {final.rms / without_balls.rms:.3g} times that without balls"
    return [f"**At the end**: {text}{share} (r.m.s. from {final.begin:.4g} to {final.end:.4g} s)."]


def _space_text(drawing: Drawing) -> str:
    """Return the sentence on the exaggeration of the drawing in space."""
    what = "displacement and tilt" if drawing.tilts else "displacement"
    times = drawing.space.factor
    return f"In space: {what} {'to scale' if times == 1.0 else f'{times:g} times as large'}"


def _balls_text(count: int) -> str:
    return {0: "No balls", 1: "1 ball"}.get(count, f"{count} balls")


def _arrows_text(drawing: Drawing) -> list[str]:
    """Return the sentences on the arrows; without arrows, on the mark of the unbalance."""
    if drawing.top.arrows is None:
        return ["Red: the unbalance."]
    if not drawing.balls:
        return ["**Arrow**: the unbalance M0 e."]
    return [
        "**Arrows**: red, the unbalance M0 e; green, from its tip, the balls' sum of m R; blue, "
        "their sum, the residual unbalance. Balls at one place are drawn in different sizes."
    ]


def _balance_text(explanation: Explanation) -> list[str]:
    """Return the legend's sentences on the rings at balanced positions, or why there are none."""
    balance = explanation.balance
    if balance is None:
        why = explanation.left_out.get("balance")
        return [f"No balanced positions are marked: {why}."] if why else []
    turned = np.degrees(in_one_turn(np.array(balance.angles))).tolist()
    angles = sorted({round(angle, 1) for angle in turned})
    places = ", ".join(f"{angle:g}" for angle in angles) + " deg"
    if balance.residual > 0.0 and explanation.unbalance:
        share = 100.0 * balance.residual / explanation.unbalance
        whose = "This ball" if len(balance.angles) == 1 else "These balls"
        return [
            f"**{whose} cannot balance the rotor**: green rings mark the best place ({places}), "
            f"which leaves {share:.3g} % of the unbalance."
        ]
    if balance.residual > 0.0:
        return ["**A rotor without unbalance**: a ball can only make it worse."]
    many = " This is one of many positions that balance." if balance.many else ""
    return [f"**Rings**: positions in which the balls balance the rotor ({places}).{many}"]


def _without_balls_text(explanation: Explanation) -> list[str]:
    """Return the legend's sentence on the whirl without balls, or why that is not drawn."""
    if explanation.without_balls is not None:
        return ["**Whirl**: grey, the same drive without balls, at this run's speed."]
    why = explanation.left_out.get("without_balls")
    return [f"Whirl without balls is not drawn: {why}."] if why else []


class DriveView:
    """View with drawings of the drive; its content does not depend on the size of blocks.

    Parameters
    ----------
    description
        Description of the run.
    period
        Shortest time between two frames [s].

    Raises
    ------
    RecordingError
        The description lacks a value for the drawing.
    """

    def __init__(self, description: Mapping[str, Any], period: float = PERIOD) -> None:
        self._drawing = drawing = Drawing.of(description)
        self.needs: tuple[str, ...] = (*ALWAYS, *drawing.needs)
        self._channels: tuple[str, ...] = ()
        self._columns: list[int] = []
        self._names = channels_for(_SPACE if drawing.tilts else _PLANE, drawing.balls)
        self._frames, self._turn = FrameRate(period), TurnVector()
        explanation = drawing.explanation
        self._vibration = VibrationCurves(self._names, explanation.top_speed)
        self._phase = SpindlePhase(self._names, explanation.top_speed, explanation.period)
        constants = explanation.without_balls
        self._without_balls = None if constants is None else WhirlWithoutBalls(constants)
        self._final, self._final_without_balls = (
            FinalRms(),
            FinalRms(),
        )  # with and without balls [m]

    def statics(self) -> Iterator[tuple[str, Any]]:
        """Yield static archetypes, by entity."""
        yield self._about()
        yield from self._drawing.scenery()
        yield from self._phase.scenery()

    def begin(self, channels: Sequence[str]) -> None:
        """Set the channels, which determine the layout.

        Channels that ``needs`` does not contain may be missing, such as speed and acceleration;
        they are then NaN.

        Raises
        ------
        RecordingError
            The channels do not fit the number of balls.
        """
        balls = len(layout_of(channels).get("balls_angle", ()))
        if balls != self._drawing.balls:
            raise RecordingError(
                f"channels have the angles of {balls} balls, but the description has balls = "
                f"{self._drawing.balls}"
            )
        self._channels = tuple(channels)
        at = {name: column for column, name in enumerate(channels)}
        self._columns = [at.get(name, len(channels)) for name in self._names]

    def of_samples(self, rows: Array) -> list[Any]:
        """Return the columns of computed curves with a row per sample, for recorded samples."""
        run = Trajectory(self._names, self._selected(rows))
        self._final.take(run["time"], run.whirl)
        return plotted_columns(self._drawing.curves.of_samples(run, self._channels, rows))

    def frames(self, rows: Array) -> Iterator[Sent]:
        """Yield the frames of the drawings for the next samples."""
        every = Trajectory(self._names, self._selected(rows))
        # The phase needs all samples of a revolution, so it is computed before frames are selected.
        phase = np.angle(self._turn.of(every["angle"], every["x"], every["y"]))
        chosen = self._frames.of(np.column_stack([every.samples, phase]))
        if not len(chosen):
            return
        chosen, phase = chosen[:, :-1], chosen[:, -1]
        run, drawing = Trajectory(self._names, chosen), self._drawing
        angle, place, balls = run["angle"], run.position, run.ball_angles
        for entity, columns in drawing.space.frames(angle, place, run.turn, balls):
            yield entity, chosen, columns
        without_balls = None
        if self._without_balls is not None:
            without_balls = self._without_balls.along(run["time"], run["speed"])
            self._final_without_balls.take(run["time"], without_balls)
        curves = plotted_columns(drawing.curves.of_frames(run, phase, without_balls))
        yield FRAMES, chosen, [*drawing.top.frames(angle, 1e3 * place, balls), *curves]

    def slow_curves(self, rows: Array) -> Iterator[Sent]:
        """Yield those curves of the next samples that have few points, such as spectra."""
        samples = self._selected(rows)
        yield from self._vibration.of(samples)
        yield from self._phase.of(samples)

    def conclusion(self) -> Iterator[tuple[str, Any]]:
        """Yield the static archetypes that change at the end of a run, by entity."""
        yield self._about()

    def blueprint(self, scalars: Sequence[str], live: bool) -> rrb.Blueprint:
        """Return the layout of the viewer.

        Parameters
        ----------
        scalars
            Names of the scalars, each of which gets a plot.
        live
            Whether the viewer follows a growing recording.
        """
        return blueprint(self._drawing, self._channels, scalars, live=live)

    def _about(self) -> tuple[str, Any]:
        """Return the entity and the present content of the text next to the drawings."""
        text = _legend_text(self._drawing, self._final.value, self._final_without_balls.value)
        return "/about", rr.TextDocument(text, media_type="text/markdown")

    def _selected(self, rows: Array) -> Array:
        """Return the channels that drawings and curves use; missing ones are NaN."""
        return np.column_stack([rows, np.full(len(rows), np.nan)])[:, self._columns]


class PlotsView:
    """View with plots of all channels and no drawing."""

    needs = ALWAYS

    def __init__(self) -> None:
        self._channels: tuple[str, ...] = ()

    def statics(self) -> Iterator[tuple[str, Any]]:
        """Yield no static archetypes."""
        return iter(())

    def begin(self, channels: Sequence[str]) -> None:
        """Set the channels, which determine the layout."""
        self._channels = tuple(channels)

    def of_samples(self, rows: Array) -> list[Any]:
        """Return no additional columns."""
        return []

    def frames(self, rows: Array) -> Iterator[Sent]:
        """Yield no frames."""
        return iter(())

    def slow_curves(self, rows: Array) -> Iterator[Sent]:
        """Yield no curves."""
        return iter(())

    def conclusion(self) -> Iterator[tuple[str, Any]]:
        """Yield no archetypes."""
        return iter(())

    def blueprint(self, scalars: Sequence[str], live: bool) -> rrb.Blueprint:
        """Return the layout of the viewer; see `DriveView.blueprint`."""
        return plain_blueprint(self._channels, scalars, live=live)


def drawable(description: Mapping[str, Any], channels: Sequence[str]) -> bool:
    """Return whether description and channels suffice for drawings of the run."""
    try:
        drawn = DriveView(description)
        drawn.begin(channels)
    except RecordingError:
        return False
    return set(drawn.needs) <= set(channels)
