"""Sliding windows over a run, and the analysis of a window of vibration.

Vectors are on fixed axes or on those of the deck, of shape (rows, axes). Sizes are root mean
squares of the length, so that a vector of length A on a circle has the size A.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ab_sim.base.presentation import last_stretch
from ab_sim.base.sample_columns import TIME
from ab_sim.record.recording.layout import Array


class SlidingWindows:
    """Divides samples into windows of length ``span`` that end at multiples of ``hop``.

    Windows depend only on the samples' times, and not on the size of blocks.

    Parameters
    ----------
    span
        Length of a window [s].
    hop
        Time between the ends of two windows [s].
    """

    def __init__(self, span: float, hop: float) -> None:
        self._span, self._hop = round(span * 1e9), round(hop * 1e9)
        self._kept = np.empty((0, 0))

    def of(self, rows: Array) -> Iterator[Array]:
        """Yield all windows that the next samples complete.

        Windows without samples, or in which time decreases, are omitted.

        Parameters
        ----------
        rows
            Next samples, with the columns STEP and TIME [s].
        """
        seen = len(self._kept)
        every = np.concatenate([self._kept, rows]) if seen else rows
        time = nanoseconds(every[:, TIME])
        part = time // self._hop
        # Windows that end at rows of earlier blocks were yielded before.
        over = 1 + np.flatnonzero(np.diff(part))
        first = np.searchsorted(time, (part + 1) * self._hop - self._span)
        self._kept = every[first[-1] :].copy()
        for end in over[over >= seen]:
            window = every[first[end - 1] : end]
            if len(window) and np.all(np.diff(window[:, TIME]) > 0.0):
                yield window


class FrameRate:
    """Selects the first sample in each ``period`` [s], independent of the size of blocks."""

    def __init__(self, period: float) -> None:
        self._period = round(period * 1e9)
        self._last = np.iinfo(np.int64).min

    def of(self, rows: Array) -> Array:
        """Return the first sample of each period among the rows of the next block."""
        part = nanoseconds(rows[:, TIME]) // self._period
        before, self._last = self._last, part[-1]
        return rows[np.concatenate([[part[0] != before], part[1:] != part[:-1]])]


def nanoseconds(time: Array) -> np.ndarray:
    """Return times [s] in whole nanoseconds."""
    return np.rint(time * 1e9).astype(np.int64)


_MOST_SUMS = 20_000
"""Largest number of cumulative sums that ``FinalRms`` keeps."""
TURNS = 2
"""Smallest number of whole revolutions from which the once-per-turn part is determined."""


def rms(time: Array, vectors: Array) -> float:
    """Return the root mean square of the vectors' length over time.

    Parameters
    ----------
    time
        Times of the rows [s], at least two, of any spacing.
    vectors
        Vectors of shape (rows, axes).
    """
    return float(np.sqrt(np.average(np.sum(vectors**2, axis=1), weights=np.gradient(time))))


class Final(NamedTuple):
    """Root mean square over the last stretch of a run."""

    rms: float
    """Root mean square, in the unit of the values."""
    begin: float
    """Start of the stretch [s]."""
    end: float
    """End of the stretch [s]."""


class FinalRms:
    """Computes the root mean square over the last stretch of values that arrive in blocks.

    The length of the stretch depends on the number of all values. So cumulative sums are kept, and
    their difference gives any stretch. If there are more than `_MOST_SUMS`, every second one is
    dropped, which limits the memory and only moves the start of the stretch slightly.
    """

    def __init__(self) -> None:
        self._sums = np.zeros((1, 3))  # time [s], number of values, sum of their squares

    def take(self, time: Array, values: Array) -> None:
        """Add values at the next times [s]."""
        steps = np.column_stack([np.ones(len(values)), values**2])
        sums = self._sums[-1, 1:] + np.cumsum(steps, axis=0)
        self._sums = np.vstack([self._sums, np.column_stack([time, sums])])
        while len(self._sums) > _MOST_SUMS:
            self._sums = np.vstack([self._sums[:-1:2], self._sums[-1:]])

    @property
    def value(self) -> Final | None:
        """Root mean square of the last stretch; None without values."""
        if len(self._sums) == 1:
            return None
        end, count, total = self._sums[-1]
        left_out = np.searchsorted(self._sums[:-1, 1], count - last_stretch(int(count)))
        (_, before, squares), (begin, _, _) = self._sums[min(left_out, len(self._sums) - 2) :][:2]
        rms = math.sqrt((total - squares) / (count - before))
        return Final(rms, float(begin), float(end))


def once_per_turn(angle: Array, vectors: Array) -> tuple[float, float] | None:
    """Return the sizes of two parts of vectors: once per turn, and all other motion.

    The last whole revolutions are weighted by Hann's window over the *angle*. So the result is also
    right if the speed changes, or if revolutions are not a whole number of rows.

    Parameters
    ----------
    angle
        Angle of the rotor [rad], shape (rows,).
    vectors
        Vectors of shape (rows, axes).

    Returns
    -------
    tuple[float, float] | None
        Both sizes; None for less than `TURNS` revolutions in one direction, or less than two rows
        per revolution.
    """
    if len(angle) < 2:
        return None
    behind = np.abs(angle - angle[-1])  # angle from a row to the last row [rad]
    steps = -np.diff(behind)
    if not (steps.min() > 0.0 and steps.max() < np.pi):
        return None
    turns = np.floor(behind[0] / (2.0 * np.pi))
    if turns < TURNS:
        return None
    # Each row stands for the angle around it. Over whole turns, Hann's window makes the average of
    # other orders, and of a slow drift, nearly 0.
    share = behind / (2.0 * np.pi * turns)
    weights = np.where(share < 1.0, 1.0 - np.cos(2.0 * np.pi * share), 0.0) * -np.gradient(behind)
    weights /= weights.sum()
    wave = np.exp(1j * angle)
    parts = (weights * wave.conj()) @ vectors
    rest = vectors - 2.0 * (wave[:, None] * parts).real
    once = np.sqrt(2.0 * np.sum(np.abs(parts) ** 2))
    return float(once), float(np.sqrt(weights @ np.sum(rest**2, axis=1)))


def spectrum(step: float, vectors: Array) -> tuple[Array, Array]:
    """Return frequencies [Hz], and the size of the vibration at each.

    The mean is removed, and Hann's window is applied. A sine on one axis with the amplitude A, at
    one of the frequencies, has the size A / sqrt(2) there.

    Parameters
    ----------
    step
        Constant time between rows [s].
    vectors
        Vectors of shape (rows, axes), at least two rows.
    """
    rows = len(vectors)
    window = 1.0 - np.cos(2.0 * np.pi * np.arange(rows) / rows)
    lines = np.fft.rfft(window[:, None] * (vectors - vectors.mean(axis=0)), axis=0) / window.sum()
    # A line stands for the frequencies of both signs, except the first and, if the number of rows
    # is even, the last.
    power = 2.0 * np.sum(np.abs(lines) ** 2, axis=1)
    power[0] *= 0.5
    if rows % 2 == 0:
        power[-1] *= 0.5
    return np.arange(len(power)) / (rows * step), np.asarray(np.sqrt(power))
