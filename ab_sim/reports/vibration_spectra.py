"""How a deck vibrates, from samples that come a block at a time: spectra, and what turns along."""

import math
from typing import Literal

import numpy as np
from scipy.signal import periodogram

SEGMENT_TIME = 0.5
"""s of a segment of a waterfall: 2 Hz apart are told apart, and a run-up is hardly smeared."""
LONGEST, SHORTEST = 8192, 32
"""Samples of a segment."""
MOST_SEGMENTS = 600
SPEEDS = 80
"""Rows of a waterfall."""


class WelchSegments:
    """Stretches of consecutive samples, equally far apart, of a length and so much after another.

    Those across a gap are left out, and those with another distance than the first.

    Args:
        length: samples of each.
        hop: samples from the start of one to that of the next.
    """

    def __init__(self, length: int, hop: int) -> None:
        self._length, self._hop = length, hop
        self._kept: np.ndarray | None = None
        self._skip = 0
        self.stride: float | None = None
        """Steps between samples; None: there was no segment yet."""

    def take(self, rows: np.ndarray) -> list[np.ndarray]:
        """Add samples.

        Args:
            rows: shape (samples, columns), the first column being the step.

        Returns:
            The segments that are whole now, shape (length, columns).
        """
        rows = rows if self._kept is None else np.concatenate([self._kept, rows])
        found, begin = [], self._skip
        while begin + self._length <= len(rows):
            segment = rows[begin : begin + self._length]
            strides = np.diff(segment[:, 0])
            even = bool(np.all(strides == strides[0]))
            if even and self.stride in (None, strides[0]):
                self.stride = float(strides[0])
                found.append(segment)
                begin += self._hop
            elif even:
                begin += self._hop
            else:  # go on behind the last place where the distance changes
                begin += int(np.flatnonzero(np.diff(strides))[-1]) + 1
        self._skip = max(begin - len(rows), 0)
        self._kept = rows[begin:].copy()
        return found


class PowerSpectrum:
    """Power spectral density by Welch's method: of all axes together, what is constant left out.

    Hann windows that overlap by half, as ``scipy.signal.welch`` has it.

    Args:
        count: how many samples there will be.
    """

    def __init__(self, count: int) -> None:
        self.length = max(2 ** int(math.log2(max(min(LONGEST, count // 4), SHORTEST))), SHORTEST)
        self._segments = WelchSegments(self.length, self.length // 2)
        self._sum: np.ndarray | None = None
        self._count = 0
        self.frequencies = np.empty(0)
        """Hz."""

    def take(self, step: np.ndarray, time: np.ndarray, axes: np.ndarray) -> None:
        """Add samples of acceleration [m/s^2], shape (samples, axes)."""
        for segment in self._segments.take(np.column_stack([step, time, axes])):
            if not np.isfinite(segment).all():
                continue
            self.frequencies, density = density_of(segment, "density")
            self._sum = density if self._sum is None else self._sum + density
            self._count += 1

    @property
    def density(self) -> np.ndarray:
        """(m/s^2)^2/Hz at each of ``frequencies``; empty if there are too few samples."""
        return np.empty(0) if self._sum is None else self._sum / self._count


class Waterfall:
    """Amplitudes over frequency and spindle speed: in each range of speed the largest met there.

    Args:
        count: how many samples there will be.
        rate: samples per second, about.
        speeds: least and largest speed of the spindle [rad/s].
    """

    def __init__(self, count: int, rate: float, speeds: tuple[float, float]) -> None:
        wanted = min(SEGMENT_TIME * rate, LONGEST, count / 8)
        self.length = max(2 ** int(math.log2(max(wanted, SHORTEST))), SHORTEST)
        hop = max(self.length // 4, -(-count // MOST_SEGMENTS))
        self._hop = min(hop, self.length)
        self._segments = WelchSegments(self.length, hop)
        self.edges = np.linspace(*speeds, SPEEDS + 1)
        """Of the ranges of speed [rad/s]."""
        self.frequencies = np.empty(0)
        """Hz."""
        self.amplitudes = np.empty((SPEEDS, 0))
        """m/s^2, shape (speeds, frequencies); NaN where the spindle never was."""

    def take(self, step: np.ndarray, time: np.ndarray, speed: np.ndarray, axes: np.ndarray) -> None:
        """Add samples of speed [rad/s] and acceleration [m/s^2], shape (samples, axes)."""
        if not self.edges[-1] > self.edges[0]:
            return
        for segment in self._segments.take(np.column_stack([step, time, axes, speed])):
            if not np.isfinite(segment).all():
                continue
            self.frequencies, power = density_of(segment[:, :-1], "spectrum")
            if self.amplitudes.shape[1] == 0:
                self.amplitudes = np.full((SPEEDS, len(power)), np.nan)
            # The speeds of its middle, which no other segment has: all of them leave no gap.
            middle = segment[(len(segment) - self._hop) // 2 :, -1][: self._hop + 1]
            low, high = np.searchsorted(self.edges, [middle.min(), middle.max()])
            rows = slice(max(int(low) - 1, 0), min(max(int(high), 1), SPEEDS))
            amplitude = np.sqrt(2.0 * power)
            self.amplitudes[rows] = np.fmax(self.amplitudes[rows], amplitude)


def density_of(
    segment: np.ndarray, scaling: Literal["density", "spectrum"]
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz] and power of columns 2, 3, ... together, column 1 being the time [s]."""
    time = segment[:, 1]
    rate = (len(time) - 1) / (time[-1] - time[0])
    frequencies, power = periodogram(
        segment[:, 2:], rate, window="hann", detrend="constant", scaling=scaling, axis=0
    )
    return frequencies, power.sum(axis=1)


class OncePerTurn:
    """How much of a vibration across the shaft turns with the spindle, or once per turn against it.

    z = a_1 + i a_2 less its mean; c+- = mean(z exp(-+i psi)); share (|c+|^2 + |c-|^2) / mean |z|^2.
    """

    def __init__(self) -> None:
        self._count, self._power = 0, 0.0
        self._sums = np.zeros(4, complex)
        self._angles = (math.inf, -math.inf)

    def take(self, angle: np.ndarray, axes: np.ndarray) -> None:
        """Add samples of psi [rad] and acceleration [m/s^2], shape (samples, 2 or more)."""
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
        """Root mean square of the vibration, its mean left out [m/s^2]."""
        return math.sqrt(self._varying) if self._count else None

    @property
    def share(self) -> float | None:
        """Of the vibration's power; None where the spindle made no whole turn, or nothing moves."""
        if not self._count or self._angles[1] - self._angles[0] < 2.0 * math.pi:
            return None
        if not self._varying > 0.0:
            return None
        mean, turn, along, against = self._sums / self._count
        along, against = along - mean * turn.conjugate(), against - mean * turn
        return float((abs(along) ** 2 + abs(against) ** 2) / self._varying)

    @property
    def _varying(self) -> float:
        mean = abs(self._sums[0] / self._count) ** 2
        return max(self._power / self._count - mean, 0.0)
