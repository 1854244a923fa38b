"""Reduction of samples, block by block: curves with all peaks, spectra, part once per turn."""

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from scipy.signal import periodogram

from ab_sim.base.sample_columns import STEP, TIME

_POINTS = 2000
"""Number of bins of a drawn curve; each bin is drawn as its least and largest sample."""


class Envelope:
    """Least and largest sample of each channel in bins of equal numbers of samples.

    If there are at most as many samples as bins, the curves contain all samples.

    Parameters
    ----------
    channels
        Names of the channels.
    count
        Total number of samples.
    bins
        Largest number of bins.
    """

    def __init__(self, channels: Sequence[str], count: int, bins: int = _POINTS) -> None:
        self.channels = tuple(channels)
        self._count = max(count, 1)
        self._bins = min(bins, self._count)
        shape = (2, self._bins, len(self.channels))
        self._times, self._values = np.full(shape, np.nan), np.full(shape, np.nan)
        self._done = 0

    def take(self, time: np.ndarray, values: np.ndarray) -> None:
        """Add samples.

        Parameters
        ----------
        time
            Times of the samples [s], shape (samples,).
        values
            Samples, shape (samples, channels); values that are not finite are left out.
        """
        bins = (self._done + np.arange(len(time))) * self._bins // self._count
        self._done += len(time)
        edges = np.flatnonzero(np.diff(bins, prepend=-1, append=-1))
        for begin, end in zip(edges[:-1], edges[1:], strict=True):
            if bins[begin] < self._bins:  # otherwise there are more samples than announced
                self._merge(int(bins[begin]), time[begin:end], values[begin:end])

    def curve(self, channel: str) -> tuple[np.ndarray, np.ndarray]:
        """Return times [s] and values of a channel, at most two per bin, in order."""
        at = self.channels.index(channel)
        times, values = self._times[:, :, at], self._values[:, :, at]
        order = np.argsort(times, axis=0)
        times = np.take_along_axis(times, order, 0).T.ravel()
        values = np.take_along_axis(values, order, 0).T.ravel()
        there = np.isfinite(times) & np.isfinite(values)
        # A bin with one sample contains it twice.
        there[1:] &= ~((times[1:] == times[:-1]) & (values[1:] == values[:-1]))
        return times[there], values[there]

    def _merge(self, bin_: int, time: np.ndarray, values: np.ndarray) -> None:
        """Update a bin's extreme samples with times [s] and values, shape (samples, channels)."""
        all_times = np.column_stack([self._times[:, bin_].T, np.tile(time, (values.shape[1], 1))])
        all_values = np.column_stack([self._values[:, bin_].T, values.T])
        finite = np.isfinite(all_values)
        for row, (pick, none) in enumerate(((np.argmin, np.inf), (np.argmax, -np.inf))):
            at = pick(np.where(finite, all_values, none), axis=1)[:, None]
            self._times[row, bin_] = np.take_along_axis(all_times, at, 1)[:, 0]
            self._values[row, bin_] = np.take_along_axis(all_values, at, 1)[:, 0]


_SEGMENT_TIME = 0.5
"""Length of a segment of a waterfall [s]: short enough for a run-up, it resolves 2 Hz."""
LONGEST, SHORTEST = 8192, 32
"""Largest and least number of samples of a segment."""
_MOST_SEGMENTS = 600
"""Largest number of segments of a waterfall, approximately."""
SPEEDS = 80
"""Number of rows of a waterfall."""


class WelchSegments:
    """Cutting of consecutive samples into segments of equidistant samples, which may overlap.

    Segments with a gap, or with another sample spacing than the first segment, are left out.

    Parameters
    ----------
    length
        Number of samples of each segment.
    hop
        Number of samples between the starts of two segments.
    """

    def __init__(self, length: int, hop: int) -> None:
        self._length, self._hop = length, hop
        self._kept: np.ndarray | None = None
        self._skip = 0
        self.stride: float | None = None
        """Number of steps between samples; None before the first segment."""

    def take(self, rows: np.ndarray) -> list[np.ndarray]:
        """Add samples.

        Parameters
        ----------
        rows
            Samples, shape (samples, columns), with the column STEP.

        Returns
        -------
        list[np.ndarray]
            Newly completed segments, each of shape (length, columns).
        """
        rows = rows if self._kept is None else np.concatenate([self._kept, rows])
        segments, begin = [], self._skip
        while begin + self._length <= len(rows):
            segment = rows[begin : begin + self._length]
            strides = np.diff(segment[:, STEP])
            even = bool(np.all(strides == strides[0]))
            if even and self.stride in (None, strides[0]):
                self.stride = float(strides[0])
                segments.append(segment)
                begin += self._hop
            elif even:
                begin += self._hop
            else:  # continue after the last change of the sample distance
                begin += int(np.flatnonzero(np.diff(strides))[-1]) + 1
        self._skip = max(begin - len(rows), 0)
        self._kept = rows[begin:].copy()
        return segments


class PowerSpectrum:
    """Power spectral density by Welch's method, summed over all axes, without the constant part.

    Hann windows overlap by half, as in ``scipy.signal.welch``.

    Parameters
    ----------
    count
        Total number of samples.
    """

    def __init__(self, count: int) -> None:
        self.length = max(2 ** int(math.log2(max(min(LONGEST, count // 4), SHORTEST))), SHORTEST)
        self._segments = WelchSegments(self.length, self.length // 2)
        self._sum: np.ndarray | None = None
        self._count = 0
        self.frequencies = np.empty(0)
        """Frequencies [Hz]."""

    def take(self, step: np.ndarray, time: np.ndarray, axes: np.ndarray) -> None:
        """Add samples: steps, times [s], and accelerations [m/s^2] of shape (samples, axes)."""
        for segment in self._segments.take(np.column_stack([step, time, axes])):
            if not np.isfinite(segment).all():
                continue
            self.frequencies, density = _density_of(segment, "density")
            self._sum = density if self._sum is None else self._sum + density
            self._count += 1

    @property
    def density(self) -> np.ndarray:
        """Density [(m/s^2)^2/Hz] at each of ``frequencies``; empty with too few samples."""
        return np.empty(0) if self._sum is None else self._sum / self._count


class Waterfall:
    """Largest amplitude over frequency in each range of spindle speed.

    Parameters
    ----------
    count
        Total number of samples.
    rate
        Approximate number of samples per second.
    speeds
        Least and largest speed of the spindle [rad/s].
    """

    def __init__(self, count: int, rate: float, speeds: tuple[float, float]) -> None:
        wanted = min(_SEGMENT_TIME * rate, LONGEST, count / 8)
        self.length = max(2 ** int(math.log2(max(wanted, SHORTEST))), SHORTEST)
        hop = max(self.length // 4, -(-count // _MOST_SEGMENTS))
        self._hop = min(hop, self.length)
        self._segments = WelchSegments(self.length, hop)
        self.edges = np.linspace(*speeds, SPEEDS + 1)
        """Edges of the ranges of speed [rad/s]."""
        self.frequencies = np.empty(0)
        """Frequencies [Hz]."""
        self.amplitudes = np.empty((SPEEDS, 0))
        """Amplitudes [m/s^2], shape (speeds, frequencies); NaN for speeds that did not occur."""

    def take(self, step: np.ndarray, time: np.ndarray, speed: np.ndarray, axes: np.ndarray) -> None:
        """Add samples: steps, times [s], speeds [rad/s], accelerations [m/s^2] (samples, axes)."""
        if not self.edges[-1] > self.edges[0]:
            return
        for segment in self._segments.take(np.column_stack([step, time, axes, speed])):
            if not np.isfinite(segment).all():
                continue
            self.frequencies, power = _density_of(segment[:, :-1], "spectrum")
            if self.amplitudes.shape[1] == 0:
                self.amplitudes = np.full((SPEEDS, len(power)), np.nan)
            # Use the speeds in the middle of the segment only: those of successive segments adjoin,
            # so that no range of speed is left empty or smeared.
            middle = segment[(len(segment) - self._hop) // 2 :, -1][: self._hop + 1]
            low, high = np.searchsorted(self.edges, [middle.min(), middle.max()])
            rows = slice(max(int(low) - 1, 0), min(max(int(high), 1), SPEEDS))
            amplitude = np.sqrt(2.0 * power)
            self.amplitudes[rows] = np.fmax(self.amplitudes[rows], amplitude)


def _density_of(
    segment: np.ndarray, scaling: Literal["density", "spectrum"]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the periodogram of a segment, with a Hann window and without the mean.

    Parameters
    ----------
    segment
        Samples, shape (samples, columns): step, time [s], then the axes [m/s^2].
    scaling
        Density per Hz, or power of a line, as in ``scipy.signal.periodogram``.

    Returns
    -------
    tuple[np.ndarray, np.ndarray]
        Frequencies [Hz], and the power summed over all axes.
    """
    time = segment[:, TIME]
    rate = (len(time) - 1) / (time[-1] - time[0])
    frequencies, power = periodogram(
        segment[:, 2:], rate, window="hann", detrend="constant", scaling=scaling, axis=0
    )
    return frequencies, power.sum(axis=1)


class OncePerTurn:
    """Part of a vibration across the shaft that turns once per turn, with or against the spindle.

    With z = a_1 + i a_2 minus its mean, and c+- = mean(z exp(-+i psi)), the share of this part in
    the power is (|c+|^2 + |c-|^2) / mean |z|^2. Sums over all samples suffice, so that no samples
    are kept.
    """

    def __init__(self) -> None:
        self._count, self._power = 0, 0.0
        self._sums = np.zeros(4, complex)
        self._angles = (math.inf, -math.inf)

    def take(self, angle: np.ndarray, axes: np.ndarray) -> None:
        """Add samples: psi [rad], and accelerations [m/s^2] of shape (samples, 2 or more)."""
        fine = np.isfinite(angle) & np.isfinite(axes).all(axis=1)
        if not fine.any():
            return
        angle, z = angle[fine], axes[fine, 0] + 1j * axes[fine, 1]
        turned = np.exp(1j * angle)
        self._count += len(z)
        self._power += float(np.sum(np.abs(z) ** 2))
        self._sums += [
            z.sum(), turned.sum(), (z * turned.conj()).sum(), (z * turned).sum()
        ]  # fmt: skip
        low, high = self._angles
        self._angles = min(low, float(angle.min())), max(high, float(angle.max()))

    @property
    def rms(self) -> float | None:
        """Root mean square of the vibration about the mean [m/s^2]; None without samples."""
        return math.sqrt(self._varying) if self._count else None

    @property
    def share(self) -> float | None:
        """Share of the once-per-turn part in the vibration's power; None if it is not defined."""
        if not self._count or self._angles[1] - self._angles[0] < 2.0 * math.pi:
            return None
        if not self._varying > 0.0:
            return None
        mean, turn, along, against = self._sums / self._count
        along, against = along - mean * turn.conjugate(), against - mean * turn
        return float((abs(along) ** 2 + abs(against) ** 2) / self._varying)

    @property
    def _varying(self) -> float:
        """Mean square of the vibration about the mean [(m/s^2)^2]."""
        mean = abs(self._sums[0] / self._count) ** 2
        return max(self._power / self._count - mean, 0.0)
