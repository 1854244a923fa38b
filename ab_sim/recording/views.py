"""What a viewer is shown of a run: the drive in pictures, or plots where positions are unknown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from ab_sim.errors import RecordingError
from ab_sim.recording.about import about
from ab_sim.recording.blueprint import blueprint, plain_blueprint
from ab_sim.recording.drawing import Drawing
from ab_sim.recording.layout import Array, layout_of
from ab_sim.recording.pictures import Pictures, Sent

ALWAYS = ("step", "time")
"""Channels that every recording has, first of all."""


class DriveView:
    """The drive in pictures; `RecordingError` where a description does not say what is drawn."""

    def __init__(self, description: Mapping[str, Any]) -> None:
        self._drawing = Drawing.of(description)
        self._pictures = Pictures(self._drawing, ())
        self._channels: tuple[str, ...] = ()
        self.needs: tuple[str, ...] = (*ALWAYS, *self._drawing.needs)

    def statics(self) -> Iterator[tuple[str, Any]]:
        """What stays: archetypes, logged once."""
        yield "/about", rr.TextDocument(about(self._drawing), media_type="text/markdown")
        yield from self._drawing.scenery()
        yield from self._pictures.scenery()

    def begin(self, channels: Sequence[str]) -> None:
        """Now the channels are known; by that the viewer is laid out anew."""
        balls = len(layout_of(channels).get("balls_angle", ()))
        if balls != self._drawing.balls:
            raise RecordingError(
                f"channels give the angles of {balls} balls, but the description says balls: "
                f"{self._drawing.balls}"
            )
        self._pictures, self._channels = Pictures(self._drawing, channels), tuple(channels)

    def of_samples(self, rows: Array) -> list[Any]:
        """Columns that every sample gets beside its channels, for plots."""
        return self._pictures.of_samples(rows)

    def of(self, rows: Array) -> Iterator[Sent]:
        """What the next rows add to the pictures."""
        return self._pictures.of(rows)

    def blueprint(self, scalars: Sequence[str]) -> rrb.Blueprint:
        """How the viewer is laid out."""
        return blueprint(self._drawing, self._channels, scalars)


class PlotsView:
    """A plot of each entity, once these are known."""

    needs = ALWAYS

    def __init__(self) -> None:
        self._channels: tuple[str, ...] = ()

    def statics(self) -> Iterator[tuple[str, Any]]:
        """Nothing stays."""
        return iter(())

    def begin(self, channels: Sequence[str]) -> None:
        """Now the channels are known; by that the viewer is laid out anew."""
        self._channels = tuple(channels)

    def of_samples(self, rows: Array) -> list[Any]:
        """Nothing is added to samples."""
        return []

    def of(self, rows: Array) -> Iterator[Sent]:
        """Nothing is added to them."""
        return iter(())

    def blueprint(self, scalars: Sequence[str]) -> rrb.Blueprint:
        """How the viewer is laid out."""
        return plain_blueprint(self._channels, scalars)


def drawable(description: Mapping[str, Any], channels: Sequence[str]) -> bool:
    """Whether there can be pictures of a run that is described so and has these channels."""
    try:
        drawn = DriveView(description)
        drawn.begin(channels)
    except RecordingError:
        return False
    return set(drawn.needs) <= set(channels)
