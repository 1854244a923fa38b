"""Phase of the spindle's motion (such as standstill or speeding up), determined from its speed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import rerun as rr

from ab_sim.base.palette import GREEN, GREY, PURPLE, SKY, Colour
from ab_sim.drive.trajectory import Trajectory
from ab_sim.record.recording.layout import Array, scalar_columns
from ab_sim.record.recording.windows import SlidingWindows

HOP = 0.02
"""Length and spacing of the windows in which the acceleration is determined [s]."""
STILL, STEADY = 1e-3, 0.02
"""Speed below which the spindle counts as standing [1], and acceleration below which it counts as
steady [1/s], relative to the top speed."""
PERIOD = "variable-speed period"
PHASES: Mapping[str, Colour] = {
    "standstill": GREY,
    "speeding up": SKY,
    PERIOD: GREEN,
    "steady": GREY,
    "slowing down": PURPLE,
}
LABELS = ("still", "up", "v", "steady", "down")
"""Labels of the phases, short enough for half a second of a run."""

Sent = tuple[str, Array, Any]


class SpindlePhase:
    """Determines the phases of the spindle's motion from samples.

    Args:
        channels: channels of the samples, with ``speed`` [rad/s].
        top_speed: top speed [rad/s]; None: unknown.
        period: variable-speed period, as in `Explanation`; None: none. It is recognised by its
            speed and acceleration, because the start of a live profile is unknown.
    """

    def __init__(
        self,
        channels: tuple[str, ...],
        top_speed: float | None,
        period: Mapping[str, float] | None,
    ) -> None:
        self._channels, self._period = channels, period
        self._scale = top_speed or 1.0
        self._windows = SlidingWindows(HOP, HOP)
        self._phase = ""

    def scenery(self) -> Iterator[tuple[str, Any]]:
        """Yield static archetypes, by entity."""
        yield (
            "/state/spindle",
            rr.StateConfiguration(
                values=list(PHASES),
                labels=LABELS,
                colors=list(PHASES.values()),
            ),
        )
        if self._period is not None:
            yield (
                "/plot/speed/period",
                rr.SeriesLines(names=PERIOD, colors=(*GREEN, 110), widths=9.0),
            )

    def of(self, rows: Array) -> Iterator[Sent]:
        """Process the next samples, and yield the changes of the phase."""
        changes, names, ends, within = [], [], [], []
        for window in self._windows.of(rows):
            if len(window) < 2:
                continue
            run = Trajectory(self._channels, window)
            before, self._phase = self._phase, self.phase_of(run["time"], run["speed"])
            if self._phase != before:
                changes.append(window[0])
                names.append(self._phase)
            if PERIOD in (self._phase, before):
                ends.append(window[-1])  # a NaN ends the line
                within.append(run["speed"][-1] if self._phase == PERIOD else np.nan)
        if changes:
            yield "/state/spindle", np.array(changes), rr.StateChange.columns(state=names)
        if ends and self._period is not None:
            yield "/plot/speed/period", np.array(ends), scalar_columns(np.array(within)[:, None])

    def phase_of(self, time: Array, speed: Array) -> str:
        """Return the phase, one of ``PHASES``, from times [s] and speeds [rad/s] of a window."""
        slope = (speed[-1] - speed[0]) / (time[-1] - time[0])
        if np.max(np.abs(speed)) < STILL * self._scale:
            return "standstill"
        if self._period is not None and self._in_period(self._period, slope, speed):
            return PERIOD
        if not abs(slope) > STEADY * self._scale:
            return "steady"
        return "speeding up" if slope * speed[-1] > 0.0 else "slowing down"

    def _in_period(self, period: Mapping[str, float], slope: float, speed: Array) -> bool:
        apart = abs(period["around"] - period["acceleration"])
        low, high = sorted((period["start_speed"], period["end_speed"]))
        near = 2.0 * HOP * period["around"]
        return bool(
            abs(slope - period["acceleration"]) < 0.25 * apart
            and speed.min() > low - near
            and speed.max() < high + near
        )
