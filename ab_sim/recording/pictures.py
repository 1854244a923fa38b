"""All that is derived from rows while they come in, so that a viewer shows what they mean."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ab_sim.drive.trajectory import Trajectory, channels_for
from ab_sim.recording.curves import FRAMES
from ab_sim.recording.drawing import Drawing
from ab_sim.recording.layout import Array, plotted_columns
from ab_sim.recording.spindle_phase import SpindlePhase
from ab_sim.recording.vibration import VibrationCurves
from ab_sim.recording.windows import FrameRate

PERIOD = 1e-2
"""s: pictures move no more often, however short the steps are: screens do not either, and a frame
takes as much room as three samples. The channels are all kept."""

_PLANE = ("x", "y", "ax", "ay")
_SPACE = ("x", "y", "z", "ax", "ay", "az", "qw", "qx", "qy", "qz")

Sent = tuple[str, Array, Any]  # entity, the rows that say when, columns


class Pictures:
    """Takes a run's rows in turn; what it gives does not depend on how they are cut.

    Args:
        drawing: what is drawn.
        channels: of the rows. What pictures use beyond ``drawing.needs``, such as speed and
            acceleration, is not a number where there is no such channel.
    """

    def __init__(self, drawing: Drawing, channels: Sequence[str]) -> None:
        self._drawing = drawing
        self._channels = tuple(channels)
        self._names = channels_for(_SPACE if drawing.tilts else _PLANE, drawing.balls)
        at = {name: column for column, name in enumerate(channels)}
        self._columns = [at.get(name, len(channels)) for name in self._names]
        self._frames = FrameRate(PERIOD)
        explained = drawing.explained
        self._vibration = VibrationCurves(self._names, explained.top_speed)
        self._phase = SpindlePhase(self._names, explained.top_speed, explained.period)

    def scenery(self) -> Iterator[tuple[str, Any]]:
        """How they look: archetypes, logged once."""
        yield from self._phase.scenery()

    def of_samples(self, rows: Array) -> list[Any]:
        """Columns that every sample gets beside its channels."""
        run = Trajectory(self._names, self._known(rows))
        return plotted_columns(self._drawing.curves.of_samples(run, self._channels, rows))

    def of(self, rows: Array) -> Iterator[Sent]:
        """What the next rows add to the pictures."""
        samples = self._known(rows)
        yield from self._vibration.of(samples)
        yield from self._phase.of(samples)
        thin = self._frames.of(samples)
        if not len(thin):
            return
        run, drawing = Trajectory(self._names, thin), self._drawing
        angle, place, balls = run["angle"], run.position, run.ball_angles
        for entity, columns in (
            *drawing.space.frames(angle, place, run.turn, balls),
            *drawing.top.frames(angle, 1e3 * place, balls),
        ):
            yield entity, thin, columns
        yield FRAMES, thin, plotted_columns(drawing.curves.of_frames(run))

    def _known(self, rows: Array) -> Array:
        """The channels that pictures use."""
        return np.column_stack([rows, np.full(len(rows), np.nan)])[:, self._columns]
