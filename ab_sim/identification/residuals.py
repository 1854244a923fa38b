"""Tests of residuals for whiteness, over time and over frequency.

Sources: G. M. Ljung and G. E. P. Box, 1978, Biometrika 65, 297-303, for the autocorrelation; J.
Durbin, 1969, Biometrika 56, 1-15, for Bartlett's cumulative periodogram.

A slightly wrong model leaves residuals that turn with the spindle and vary slowly on rotating axes,
far below the noise of single samples. A separate test detects them.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import chi2, kstwobign, norm

from ab_sim.identification.colour import whitened, whitening_of
from ab_sim.identification.measured import Measured
from ab_sim.identification.problem import Problem

_LAGS = 20
"""Number of lags of the autocorrelation."""
_FLAGGED = 4.0
"""Threshold of z above which residuals are not noise.

A correct model exceeds it in about one of 1000 to 2000 recordings.
"""
_BLOCKS = 20
"""Number of blocks, of equal spindle rotation, over which residuals are averaged on rotating
axes."""
DRIFT = 2.0
"""Drift over the whole recording beyond which it is reported, in standard deviations of the
residuals without their linear trend."""
NOISELESS = 1e-6
"""Least noise that is assumed, relative to the signals; residuals this small are not tested."""


class Whiteness(NamedTuple):
    """Whiteness of a recording's residuals."""

    recording: str
    rms: float
    """Root mean square of the whitened residuals [m or m/s^2]."""
    share: float
    """Root mean square of the residuals relative to the signals'."""
    z: float
    """Ljung-Box statistic (Q - h) / sqrt(2 h) over all axes."""
    p: float
    """Probability that white residuals have a larger Q."""
    frequency_p: float
    """Probability that white residuals have a less straight cumulative periodogram."""
    judged: bool
    """True if the residuals are large enough, relative to the signals, to be tested as noise."""
    turning_z: float = 0.0
    """Significance of the part that turns with the spindle, as a quantile of the normal
    distribution."""
    signs: tuple[str, ...] = ()
    """Descriptions of known patterns in residuals that are not noise."""

    @property
    def white(self) -> bool:
        """True if no test rejects that the residuals are noise."""
        return not self.judged or self.worst <= _FLAGGED

    @property
    def worst(self) -> float:
        """Larger of ``z`` and ``turning_z``, which is compared with the threshold for noise."""
        return max(self.z, self.turning_z)

    def report(self) -> dict[str, Any]:
        """Return all fields, and whether the residuals are white, as JSON-able values."""
        return {**self._asdict(), "white": self.white, "signs": list(self.signs)}


def whiteness_of(residuals: np.ndarray, rms_of_signals: float, recording: str) -> Whiteness:
    """Test whether residuals, in the order of time, are white.

    Parameters
    ----------
    residuals
        Residuals, shape (samples, axes), NaN where nothing was measured.
    rms_of_signals
        Root mean square of the measured signals about their mean, in the unit of the residuals.
    recording
        Name of the recording.
    """
    q, degrees, distances = 0.0, 0, []
    columns = [column[np.isfinite(column)] for column in residuals.T]
    for column in columns:
        centred = column - column.mean()
        lags = min(_LAGS, len(centred) // 4)
        q += _ljung_box(centred, lags)
        degrees += lags
        distances.append(_cumulative(centred))
    rms = math.sqrt(float(np.mean(np.concatenate(columns) ** 2)))
    share = rms / rms_of_signals if rms_of_signals > 0.0 else math.inf
    judged = share > 2.0 * NOISELESS
    # Bonferroni's correction for the smallest of several p-values.
    p = min(1.0, len(distances) * min(distances))
    return Whiteness(
        recording, rms, share, (q - degrees) / math.sqrt(2.0 * degrees),
        float(chi2.sf(q, degrees)), p, judged,
    )  # fmt: skip


def whiteness_over(problem: Problem, values: np.ndarray) -> tuple[Whiteness, ...]:
    """Test the residuals of all recordings of a problem.

    Parameters
    ----------
    problem
        Fitted problem.
    values
        Values of its parameters [SI].
    """
    results = []
    for k, measured in enumerate(problem.recordings):
        residuals = problem.whitened_residuals(k, values)
        result = whiteness_of(residuals, measured.rms, measured.name)
        result = result._replace(turning_z=turning_z(residuals, measured))
        results.append(
            result if result.white else result._replace(signs=_signs_of(residuals, measured.time))
        )
    return tuple(results)


def turning_z(residuals: np.ndarray, measured: Measured) -> float:
    """Return the significance of residuals that turn with the spindle; see ``Whiteness``.

    On axes that turn with the spindle, the mean of white noise over a block is normal; its variance
    falls with the number of samples. The sum of squared means is thus chi-squared distributed. The
    fit removes part of it, so that the test is conservative.

    Parameters
    ----------
    residuals
        Residuals, shape (samples, axes), NaN where nothing was measured.
    measured
        Recording with axes and spindle angle.
    """
    there = np.isfinite(residuals).all(axis=1)
    across = (residuals @ np.exp(1j * np.array(measured.axes)))[there]
    angle = measured.spindle_angle[there]
    turned = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(angle)))])
    size = float(np.mean(np.abs(across) ** 2))
    if size == 0.0 or turned[-1] == 0.0:
        return 0.0
    block = np.minimum((_BLOCKS * turned / turned[-1]).astype(int), _BLOCKS - 1)
    counts = np.bincount(block, minlength=_BLOCKS)
    still = across * np.exp(-1j * angle)
    sums = np.bincount(block, still.real, _BLOCKS) + 1j * np.bincount(block, still.imag, _BLOCKS)
    filled = counts > 0
    q = 2.0 * float(np.sum(np.abs(sums[filled]) ** 2 / counts[filled])) / size
    degrees = 2 * int(filled.sum())
    # Take the quantile from the smaller tail: a probability near 1 has lost its digits.
    above, below = (max(float(tail(q, degrees)), 1e-300) for tail in (chi2.sf, chi2.cdf))
    return float(norm.isf(above) if above < below else -norm.isf(below))


def _signs_of(residuals: np.ndarray, time: np.ndarray) -> tuple[str, ...]:
    """Describe each axis with drifting residuals in a sentence.

    Parameters
    ----------
    residuals
        Residuals, shape (samples, axes), NaN where nothing was measured.
    time
        Times of the samples [s].
    """
    signs = []
    for axis, column in enumerate(residuals.T):
        there = np.isfinite(column)
        at, values = time[there], column[there]
        slope, level = np.polyfit(at, values, 1)
        rest = values - slope * at - level
        drift = float(slope * (at[-1] - at[0]))
        if abs(drift) > DRIFT * float(rest.std()):
            signs.append(f"axis {axis + 1} drifts by {drift:.3g}: does its sensor drift?")
    return tuple(signs)


def noises_of(recordings: Sequence[Measured]) -> list[float]:
    """Estimate the standard deviation of each recording's noise [m or m/s^2], after whitening."""
    return [
        max(
            _noise_of(whitened(whitening_of(recording), recording.signals)),
            NOISELESS * recording.rms,
        )
        for recording in recordings
    ]


def _ljung_box(centred: np.ndarray, lags: int) -> float:
    """Return Ljung and Box's Q of a series: n (n + 2) times the sum of r_k^2 / (n - k).

    Parameters
    ----------
    centred
        Series with mean 0, shape (n,).
    lags
        Largest lag k of the autocorrelation r_k.
    """
    count, square = len(centred), float(centred @ centred)
    if square == 0.0:
        return 0.0
    r = [float(centred[k:] @ centred[:-k]) / square for k in range(1, lags + 1)]
    return count * (count + 2) * sum(x * x / (count - k) for k, x in enumerate(r, 1))


def _cumulative(centred: np.ndarray) -> float:
    """Return the probability that white noise has a less straight cumulative periodogram.

    The distribution of the largest distance from a straight line is that of Kolmogorov and Smirnov.
    """
    power = np.abs(np.fft.rfft(centred))[1:-1] ** 2
    whole = float(power.sum())
    if whole == 0.0 or len(power) < 8:
        return 1.0
    along = np.cumsum(power) / whole
    straight = np.arange(1, len(power) + 1) / len(power)
    distance = float(np.max(np.abs(along - straight)))
    return float(kstwobign.sf(distance * math.sqrt(len(power))))


def total_z(results: Sequence[Whiteness]) -> float:
    """Return the combined z of all recordings that can be tested, by Stouffer's method; else 0."""
    judged = [result.worst for result in results if result.judged]
    return sum(judged) / math.sqrt(len(judged)) if judged else 0.0


def _noise_of(signals: np.ndarray) -> float:
    """Estimate the standard deviation of white noise from the upper quarter of the spectrum.

    The drive hardly vibrates at these frequencies. Return the r.m.s. over the axes.

    Parameters
    ----------
    signals
        Signals, shape (samples, axes), NaN for missing samples.
    """
    levels = []
    for column in signals.T:
        values = column[np.isfinite(column)]
        window = np.hanning(len(values))
        power = np.abs(np.fft.rfft((values - values.mean()) * window)) ** 2 / (window @ window)
        upper = power[3 * len(power) // 4 : -1]
        # The median ignores lines of the spectrum. The power of noise is exponentially distributed,
        # and its median is ln 2 times its mean.
        levels.append(float(np.median(upper)) / math.log(2.0))
    return math.sqrt(float(np.mean(levels)))
