"""Vibration of the deck during a run: r.m.s., part once per revolution, spectrum."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr

from ab_sim.base.palette import GREEN, RUN, UNBALANCE
from ab_sim.drive.trajectory import Trajectory
from ab_sim.record.recording.layout import Array, plotted_columns
from ab_sim.record.recording.plots import PlottedCurves, lines
from ab_sim.record.recording.signals import once_per_turn, rms, spectrum
from ab_sim.record.recording.windows import SlidingWindows

HOP, SPAN = 0.1, 0.25
"""Spacing and length of the sections for sizes [s]."""
SPECTRUM_HOP, SPECTRUM_SPAN = 0.5, 0.5
"""Spacing and length of the sections for spectra [s]; a longer section separates close
frequencies."""
ORDERS, MOST_LINES = 5.0, 500
"""Highest frequency of a spectrum in multiples of the top speed, and largest number of its
lines."""
SIZES = "/plot/vibration"
"""Entity of curves that have a row for each ``HOP``."""
_RMS, _ORDERS = "rms", "orders"
_CHARTS = {"/plot/spectrum/once": UNBALANCE, "/plot/spectrum/rest": GREEN}
"""Entities of the bar charts of a spectrum, the lines once per turn and the rest, and colours."""
FEWEST = 4
"""Smallest number of rows of a window."""

Sent = tuple[str, Array, Any]  # entity, the rows that say when, columns


def size_curves() -> list[PlottedCurves]:
    """Return curves of the part once per revolution, of the rest, and of the whole."""
    names = ["once per turn", "the rest"]
    orders = lines(names, [2.5, 2.0], colors=[UNBALANCE, GREEN])
    whole = lines(["r.m.s. of all"], [2.5], colors=[RUN])
    return [
        PlottedCurves.derived(SIZES, _ORDERS, orders),
        PlottedCurves.derived(SIZES, _RMS, whole),
    ]


class VibrationCurves:
    """Computes the curves from the rows of a run, block by block.

    Args:
        channels: channels of the rows; ``ax``, ``ay`` [m/s^2] among them, and in space ``az``.
        top_speed: rad/s; None: unknown.
    """

    def __init__(self, channels: tuple[str, ...], top_speed: float | None) -> None:
        self._channels = channels
        self._reach = ORDERS * top_speed / (2.0 * np.pi) if top_speed else np.inf
        self._sizes = SlidingWindows(SPAN, HOP)
        self._spectrum_windows = SlidingWindows(SPECTRUM_SPAN, SPECTRUM_HOP)
        self._frequencies = np.empty(0)

    def of(self, rows: Array) -> Iterator[Sent]:
        """Yield the curves that the next rows complete."""
        ends, sizes, orders = [], [], []
        for window in self._sizes.of(rows):
            if len(window) < FEWEST:
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
        """Return frequencies, the spindle's frequency [Hz], and amplitudes.

        None without a spectrum.
        """
        steps = np.diff(window[:, 0])
        if len(window) < FEWEST or np.any(steps != steps[0]):
            return None  # rows are missing or left out: no spectrum is better than a wrong one
        run = Trajectory(self._channels, window)
        length = run["time"][-1] - run["time"][0]
        step = length / (len(window) - 1)
        if length + 1.5 * step < SPECTRUM_SPAN or not np.isfinite(run.acceleration).all():
            return None
        frequencies, sizes = spectrum(step, run.acceleration)
        count = max(2, min(int(np.searchsorted(frequencies, self._reach)) + 1, MOST_LINES))
        turning = abs(run["angle"][-1] - run["angle"][0]) / (2.0 * np.pi * length)
        return frequencies[:count], float(turning), sizes[:count]

    def _spectra(self, rows: Array) -> Iterator[Sent]:
        """Yield all spectra in one message per bar chart: a viewer takes few messages a frame."""
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
    """Return the column of the values of several bar charts; Rerun makes one for a single chart."""
    (one,) = rr.BarChart.columns(values=[charts[0]])
    tensors = [rr.components.TensorDataBatch(chart).as_arrow_array() for chart in charts]
    together = rr.components.TensorDataBatch(pa.concat_arrays(tensors))
    return [rr.ComponentColumn(one.component_descriptor(), together)]


def _axis(frequencies: Array, color: Any) -> Any:
    """Return the columns of a bar chart without its values; they hold until the next ones."""
    width = np.full((1, len(frequencies)), frequencies[1] - frequencies[0])
    whole = rr.BarChart.columns(
        values=[frequencies], abscissa=[frequencies], widths=width, color=[color]
    )
    return [c for c in whole if c.component_descriptor().component != "BarChart:values"]
