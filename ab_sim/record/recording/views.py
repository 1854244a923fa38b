"""Content of a recording for the viewer: drawings and plots, or only plots of unknown positions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from ab_sim.base.errors import RecordingError
from ab_sim.record.recording.blueprint import blueprint, plain_blueprint
from ab_sim.record.recording.drawing import Drawing
from ab_sim.record.recording.layout import Array, layout_of
from ab_sim.record.recording.legend import legend_text
from ab_sim.record.recording.pictures import PERIOD, Pictures, Sent

ALWAYS = ("step", "time")
"""First channels of every recording."""


class DriveView:
    """View with drawings of the drive.

    Args:
        description: description of the run.
        period: shortest time between two frames [s].

    Raises:
        RecordingError: the description lacks a value for the drawing.
    """

    def __init__(self, description: Mapping[str, Any], period: float = PERIOD) -> None:
        self._drawing, self._period = Drawing.of(description), period
        self._pictures = Pictures(self._drawing, ())
        self._channels: tuple[str, ...] = ()
        self.needs: tuple[str, ...] = (*ALWAYS, *self._drawing.needs)

    def statics(self) -> Iterator[tuple[str, Any]]:
        """Yield static archetypes, by entity."""
        yield self._about()
        yield from self._drawing.scenery()
        yield from self._pictures.scenery()

    def begin(self, channels: Sequence[str]) -> None:
        """Set the channels, which determine the layout.

        Raises:
            RecordingError: the channels do not fit the number of balls.
        """
        balls = len(layout_of(channels).get("balls_angle", ()))
        if balls != self._drawing.balls:
            raise RecordingError(
                f"channels have the angles of {balls} balls, but the description has balls = "
                f"{self._drawing.balls}"
            )
        self._pictures = Pictures(self._drawing, channels, self._period)
        self._channels = tuple(channels)

    def of_samples(self, rows: Array) -> list[Any]:
        """Return the columns of computed curves with a row per sample."""
        return self._pictures.of_samples(rows)

    def frames(self, rows: Array) -> Iterator[Sent]:
        """Yield the frames of the drawings for the next samples."""
        return self._pictures.frames(rows)

    def slow_curves(self, rows: Array) -> Iterator[Sent]:
        """Yield the curves with few points, such as spectra, for the next samples."""
        return self._pictures.slow_curves(rows)

    def conclusion(self) -> Iterator[tuple[str, Any]]:
        """Yield the static archetypes that change at the end of a run, by entity."""
        yield self._about()

    def blueprint(self, scalars: Sequence[str], live: bool) -> rrb.Blueprint:
        """Return the layout of the viewer."""
        return blueprint(self._drawing, self._channels, scalars, live=live)

    def _about(self) -> tuple[str, Any]:
        pictures = self._pictures
        final, alone = pictures.final_whirl, pictures.final_whirl_without_balls
        text = legend_text(self._drawing, final, alone)
        return "/about", rr.TextDocument(text, media_type="text/markdown")


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
        """Return the layout of the viewer."""
        return plain_blueprint(self._channels, scalars, live=live)


def drawable(description: Mapping[str, Any], channels: Sequence[str]) -> bool:
    """Return whether description and channels suffice for drawings of the run."""
    try:
        drawn = DriveView(description)
        drawn.begin(channels)
    except RecordingError:
        return False
    return set(drawn.needs) <= set(channels)
