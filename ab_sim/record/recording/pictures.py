"""Frames of the drawings, and curves, computed from the samples of a run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ab_sim.drive.rotor_without_balls import WhirlWithoutBalls
from ab_sim.drive.trajectory import Trajectory, channels_for
from ab_sim.drive.turn_vector import TurnVector
from ab_sim.record.recording.curves import FRAMES
from ab_sim.record.recording.drawing import Drawing
from ab_sim.record.recording.layout import Array, plotted_columns
from ab_sim.record.recording.signals import Final, FinalRms
from ab_sim.record.recording.spindle_phase import SpindlePhase
from ab_sim.record.recording.vibration import VibrationCurves
from ab_sim.record.recording.windows import FrameRate

PERIOD = 1e-2
"""Shortest time between two frames [s]. A screen shows no more, and a frame takes as much space as
three samples. Channels are recorded at every step."""

_PLANE = ("x", "y", "ax", "ay")
_SPACE = ("x", "y", "z", "ax", "ay", "az", "qw", "qx", "qy", "qz")

Sent = tuple[str, Array, Any]  # entity, rows with the times, columns


class Pictures:
    """Converts samples to frames and curves; the result does not depend on the size of blocks.

    Args:
        drawing: drawing of the drive.
        channels: channels of the samples. Channels that ``drawing.needs`` does not contain may be
            missing, such as speed and acceleration; they are then NaN.
        period: shortest time between two frames [s].
    """

    def __init__(self, drawing: Drawing, channels: Sequence[str], period: float = PERIOD) -> None:
        self._drawing = drawing
        self._channels = tuple(channels)
        self._names = channels_for(_SPACE if drawing.tilts else _PLANE, drawing.balls)
        at = {name: column for column, name in enumerate(channels)}
        self._columns = [at.get(name, len(channels)) for name in self._names]
        self._frames, self._turn = FrameRate(period), TurnVector()
        explained = drawing.explained
        self._vibration = VibrationCurves(self._names, explained.top_speed)
        self._phase = SpindlePhase(self._names, explained.top_speed, explained.period)
        self._alone = None if explained.alone is None else WhirlWithoutBalls(explained.alone)
        self._final, self._final_alone = FinalRms(), FinalRms()  # final whirls [m]

    def scenery(self) -> Iterator[tuple[str, Any]]:
        """Yield static archetypes, by entity."""
        yield from self._phase.scenery()

    def of_samples(self, rows: Array) -> list[Any]:
        """Return the columns of computed curves with a row per sample."""
        run = Trajectory(self._names, self._selected(rows))
        self._final.take(run["time"], run.whirl)
        return plotted_columns(self._drawing.curves.of_samples(run, self._channels, rows))

    def slow_curves(self, rows: Array) -> Iterator[Sent]:
        """Yield the curves of the vibration and of the spindle's phase for the next rows."""
        samples = self._selected(rows)
        yield from self._vibration.of(samples)
        yield from self._phase.of(samples)

    def frames(self, rows: Array) -> Iterator[Sent]:
        """Yield the frames of the next rows."""
        every = Trajectory(self._names, self._selected(rows))
        phase = np.angle(self._turn.of(every["angle"], every["x"], every["y"]))
        thin = self._frames.of(np.column_stack([every.samples, phase]))
        if not len(thin):
            return
        thin, phase = thin[:, :-1], thin[:, -1]
        run, drawing = Trajectory(self._names, thin), self._drawing
        angle, place, balls = run["angle"], run.position, run.ball_angles
        for entity, columns in drawing.space.frames(angle, place, run.turn, balls):
            yield entity, thin, columns
        alone = None if self._alone is None else self._alone.along(run["time"], run["speed"])
        if alone is not None:
            self._final_alone.take(run["time"], alone)
        curves = plotted_columns(drawing.curves.of_frames(run, phase, alone))
        yield FRAMES, thin, [*drawing.top.frames(angle, 1e3 * place, balls), *curves]

    @property
    def final_whirl(self) -> Final | None:
        """Final whirl [m]."""
        return self._final.value

    @property
    def final_whirl_without_balls(self) -> Final | None:
        """Final whirl of the drive without balls [m]; None if unknown."""
        return self._final_alone.value

    def _selected(self, rows: Array) -> Array:
        """Return the channels that drawings and curves use; missing ones are NaN."""
        return np.column_stack([rows, np.full(len(rows), np.nan)])[:, self._columns]
