"""Slow curves of a run: the deck's vibration, and the phase of the spindle's motion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr

from ab_sim.base.palette import GREEN, GREY, PURPLE, RUN, SKY, UNBALANCE, Colour
from ab_sim.base.sample_columns import STEP
from ab_sim.drive.trajectory import Trajectory
from ab_sim.record.recording.curves import PlottedCurves, lines
from ab_sim.record.recording.layout import Array, plotted_columns, scalar_columns
from ab_sim.record.recording.signals import SlidingWindows, once_per_turn, rms, spectrum

_PHASE_HOP = 0.02
"""Length and spacing of the windows in which the acceleration is determined [s]."""
STILL, _STEADY = 1e-3, 0.02
"""Speed below which the spindle counts as standing, relative to the top speed; and acceleration
below which it counts as steady, relative to the top speed per second."""
PERIOD = "variable-speed period"
"""Name of the phase with the variable speed of `Explanation.period`."""
_PHASES: Mapping[str, Colour] = {
    "standstill": GREY,
    "speeding up": SKY,
    PERIOD: GREEN,
    "steady": GREY,
    "slowing down": PURPLE,
}
"""Colours of the phases by name."""
_LABELS = ("still", "up", "v", "steady", "down")
"""Labels of the phases, short enough for half a second of a run."""


class SpindlePhase:
    """Determines the phases of the spindle's motion from samples.

    Parameters
    ----------
    channels
        Channels of the samples, with ``speed`` [rad/s].
    top_speed
        Top speed [rad/s]; None: unknown.
    period
        Variable-speed period, as in `Explanation`; None: none. It is recognised by its speed and
        acceleration, because the start of a live profile is unknown.
    """

    def __init__(
        self,
        channels: tuple[str, ...],
        top_speed: float | None,
        period: Mapping[str, float] | None,
    ) -> None:
        self._channels, self._period = channels, period
        self._scale = top_speed or 1.0
        self._windows = SlidingWindows(_PHASE_HOP, _PHASE_HOP)
        self._phase = ""

    def scenery(self) -> Iterator[tuple[str, Any]]:
        """Yield static archetypes, by entity."""
        yield (
            "/state/spindle",
            rr.StateConfiguration(
                values=list(_PHASES),
                labels=_LABELS,
                colors=list(_PHASES.values()),
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
        """Return the phase, one of ``_PHASES``, from times [s] and speeds [rad/s] of a window."""
        slope = (speed[-1] - speed[0]) / (time[-1] - time[0])
        if np.max(np.abs(speed)) < STILL * self._scale:
            return "standstill"
        if self._period is not None and self._in_period(self._period, slope, speed):
            return PERIOD
        if not abs(slope) > _STEADY * self._scale:
            return "steady"
        return "speeding up" if slope * speed[-1] > 0.0 else "slowing down"

    def _in_period(self, period: Mapping[str, float], slope: float, speed: Array) -> bool:
        """Return whether speeds and slope [rad/s^2] in a window fit the variable-speed period.

        Twice the length of a window is allowed for at the ends of the speed's range.
        """
        apart = abs(period["around"] - period["acceleration"])
        low, high = sorted((period["start_speed"], period["end_speed"]))
        near = 2.0 * _PHASE_HOP * period["around"]
        return bool(
            abs(slope - period["acceleration"]) < 0.25 * apart
            and speed.min() > low - near
            and speed.max() < high + near
        )


HOP, SPAN = 0.1, 0.25
"""Spacing and length of the windows for r.m.s. values [s]."""
_SPECTRUM_HOP, SPECTRUM_SPAN = 0.5, 0.5
"""Spacing and length of the windows for spectra [s]; they are longer, to separate close
frequencies."""
ORDERS, _MOST_LINES = 5.0, 500
"""Highest frequency of a spectrum as a multiple of the top speed, and largest number of lines of a
spectrum."""
SIZES = "/plot/vibration"
"""Entity of curves with a row for each ``HOP``."""
_RMS, _ORDERS = "rms", "orders"
_CHARTS = {"/plot/spectrum/once": UNBALANCE, "/plot/spectrum/rest": GREEN}
"""Colours of the two bar charts of a spectrum by entity: lines once per turn, and other lines."""
_FEWEST = 4
"""Smallest number of rows of a window."""

Sent = tuple[str, Array, Any]  # entity, rows with the times, columns


def size_curves() -> list[PlottedCurves]:
    """Return the curves of the vibration's r.m.s.: once per turn, the rest, and both."""
    names = ["once per turn", "the rest"]
    orders = lines(names, [2.5, 2.0], colors=[UNBALANCE, GREEN])
    whole = lines(["r.m.s. of all"], [2.5], colors=[RUN])
    return [
        PlottedCurves.derived(SIZES, _ORDERS, orders),
        PlottedCurves.derived(SIZES, _RMS, whole),
    ]


class VibrationCurves:
    """Computes r.m.s. values and spectra of the deck's acceleration, block by block.

    Parameters
    ----------
    channels
        Channels of the samples, with ``ax``, ``ay`` and in space ``az`` [m/s^2].
    top_speed
        Top speed [rad/s]; None: unknown.
    """

    def __init__(self, channels: tuple[str, ...], top_speed: float | None) -> None:
        self._channels = channels
        self._reach = ORDERS * top_speed / (2.0 * np.pi) if top_speed else np.inf
        self._sizes = SlidingWindows(SPAN, HOP)
        self._spectrum_windows = SlidingWindows(SPECTRUM_SPAN, _SPECTRUM_HOP)
        self._frequencies = np.empty(0)

    def of(self, rows: Array) -> Iterator[Sent]:
        """Yield the points of the curves whose windows the next samples complete."""
        ends, sizes, orders = [], [], []
        for window in self._sizes.of(rows):
            if len(window) < _FEWEST:
                continue
            run = Trajectory(self._channels, window)
            ends.append(window[-1])
            sizes.append(rms(run["time"], run.acceleration))
            parts = once_per_turn(run["angle"], run.acceleration)
            orders.append((np.nan, np.nan) if parts is None else parts)
        if ends:
            values = {_RMS: np.array(sizes)[:, None], _ORDERS: np.array(orders)}
            yield SIZES, np.array(ends), plotted_columns(values)
        yield from self._spectra(rows)

    def _spectrum(self, window: Array) -> tuple[Array, float, Array] | None:
        """Return frequencies [Hz], the spindle's frequency [Hz], and sizes [m/s^2].

        Return None if steps are missing, omitted or not finite: the spectrum would be wrong.
        """
        steps = np.diff(window[:, STEP])
        if len(window) < _FEWEST or np.any(steps != steps[0]):
            return None
        run = Trajectory(self._channels, window)
        length = run["time"][-1] - run["time"][0]
        step = length / (len(window) - 1)
        if length + 1.5 * step < SPECTRUM_SPAN or not np.isfinite(run.acceleration).all():
            return None
        frequencies, sizes = spectrum(step, run.acceleration)
        count = max(2, min(int(np.searchsorted(frequencies, self._reach)) + 1, _MOST_LINES))
        turning = abs(run["angle"][-1] - run["angle"][0]) / (2.0 * np.pi * length)
        return frequencies[:count], float(turning), sizes[:count]

    def _spectra(self, rows: Array) -> Iterator[Sent]:
        """Yield all spectra in one message per bar chart: a viewer can process few per frame."""
        ends, once, rest = [], [], []
        for window in self._spectrum_windows.of(rows):
            if (result := self._spectrum(window)) is None:
                continue
            frequencies, turning, sizes = result
            if not np.array_equal(frequencies, self._frequencies):
                self._frequencies = frequencies
                for entity, color in _CHARTS.items():
                    yield entity, window[-1:], _axis(frequencies, color)
            near = np.abs(frequencies - turning) < 2.0 * frequencies[1]  # as wide as Hann's window
            ends.append(window[-1])
            once.append(np.where(near, sizes, 0.0))
            rest.append(np.where(near, 0.0, sizes))
        if ends:
            for entity, drawn in zip(_CHARTS, (once, rest), strict=True):
                yield entity, np.array(ends), _bars(drawn)


def _bars(charts: list[Array]) -> Any:
    """Return the column of the values of several bar charts; Rerun's function accepts one only."""
    (one,) = rr.BarChart.columns(values=[charts[0]])
    tensors = [rr.components.TensorDataBatch(chart).as_arrow_array() for chart in charts]
    together = rr.components.TensorDataBatch(pa.concat_arrays(tensors))
    return [rr.ComponentColumn(one.component_descriptor(), together)]


def _axis(frequencies: Array, color: Any) -> Any:
    """Return the columns of a bar chart without the bars' heights: axis, bar width and colour."""
    width = np.full((1, len(frequencies)), frequencies[1] - frequencies[0])
    whole = rr.BarChart.columns(
        values=[frequencies], abscissa=[frequencies], widths=width, color=[color]
    )
    return [c for c in whole if c.component_descriptor().component != "BarChart:values"]
