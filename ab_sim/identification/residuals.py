"""What a fit leaves: whether it is noise, over time (Ljung and Box) and frequency (Bartlett).

A drive that is slightly wrong leaves what turns with the spindle and changes slowly on axes that
turn with it, far below the noise of single samples: that is asked for by itself.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import chi2, kstwobign, norm

from ab_sim.identification.colour import whitened, whitening_of
from ab_sim.identification.measured import Measured
from ab_sim.identification.problem import Problem

LAGS = 20
"""Of the autocorrelation that are looked at."""
FLAGGED = 4.0
"""z from which residuals are not noise: of true models one in some thousand has so much."""
BLOCKS = 20
"""Of as many turns of the spindle each, over which residuals are summed on turning axes."""
DRIFT = 2.0
"""Standard deviations of the rest, over the whole recording."""
NOISELESS = 1e-6
"""Of the signals' size: less than that is no noise of a sensor, and is not looked for."""


class Whiteness(NamedTuple):
    """Of a recording's residuals."""

    recording: str
    rms: float
    """Of the residuals [unit of the signals]."""
    share: float
    """The same, of the signals' r.m.s."""
    z: float
    """Ljung and Box: (Q - h) / sqrt(2 h) over all axes."""
    p: float
    """Of Q among white residuals."""
    frequency_p: float
    """Of the cumulative periodogram's largest distance from a straight line among such."""
    judged: bool
    """Whether there was noise to judge by."""
    turning_z: float = 0.0
    """Of what turns with the spindle: the standard deviations of a normal distribution that are as
    rarely exceeded as it is by noise."""
    signs: tuple[str, ...] = ()
    """What residuals that are no noise look like, where that is known."""

    @property
    def white(self) -> bool:
        """Whether nothing speaks against noise."""
        return not self.judged or self.worst <= FLAGGED

    @property
    def worst(self) -> float:
        """The larger one of both z."""
        return max(self.z, self.turning_z)

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        return {**self._asdict(), "white": self.white, "signs": list(self.signs)}


def whiteness_of(residuals: np.ndarray, rms_of_signals: float, recording: str) -> Whiteness:
    """Of residuals in the order of time.

    Args:
        residuals: shape (samples, axes), NaN where nothing was measured.
        rms_of_signals: of what was measured, about its mean.
        recording: its name.
    """
    q, degrees, distances = 0.0, 0, []
    columns = [column[np.isfinite(column)] for column in residuals.T]
    for column in columns:
        centred = column - column.mean()
        lags = min(LAGS, len(centred) // 4)
        q += ljung_box(centred, lags)
        degrees += lags
        distances.append(_cumulative(centred))
    rms = math.sqrt(float(np.mean(np.concatenate(columns) ** 2)))
    share = rms / rms_of_signals if rms_of_signals > 0.0 else math.inf
    judged = share > 2.0 * NOISELESS
    p = min(1.0, len(distances) * min(distances))
    return Whiteness(
        recording, rms, share, (q - degrees) / math.sqrt(2.0 * degrees),
        float(chi2.sf(q, degrees)), p, judged,
    )  # fmt: skip


def whiteness_over(problem: Problem, values: np.ndarray) -> tuple[Whiteness, ...]:
    """Of all recordings of a problem.

    Args:
        problem: has been fitted.
        values: of its parameters [SI].
    """
    found = []
    for k, measured in enumerate(problem.recordings):
        left = problem.left(k, values)
        each = whiteness_of(left, measured.rms, measured.name)
        each = each._replace(turning_z=turning_z(left, measured))
        found.append(each if each.white else each._replace(signs=signs_of(left, measured.time)))
    return tuple(found)


def turning_z(left: np.ndarray, measured: Measured) -> float:
    """How unlikely it is that noise turns with the spindle as residuals do; see ``Whiteness``.

    On axes that turn with the spindle the mean of white noise over a block is normal, with a
    variance of one over the number of samples: the sum of its squares has a chi-squared
    distribution. What the fit has taken off makes it smaller, and the answer careful.

    Args:
        left: shape (samples, axes), NaN where nothing was measured.
        measured: has the axes, and how the spindle turned.
    """
    there = np.isfinite(left).all(axis=1)
    across = (left @ np.exp(1j * np.array(measured.axes)))[there]
    angle = measured.spindle_angle[there]
    turned = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(angle)))])
    size = float(np.mean(np.abs(across) ** 2))
    if size == 0.0 or turned[-1] == 0.0:
        return 0.0
    block = np.minimum((BLOCKS * turned / turned[-1]).astype(int), BLOCKS - 1)
    counts = np.bincount(block, minlength=BLOCKS)
    still = across * np.exp(-1j * angle)
    sums = np.bincount(block, still.real, BLOCKS) + 1j * np.bincount(block, still.imag, BLOCKS)
    filled = counts > 0
    q = 2.0 * float(np.sum(np.abs(sums[filled]) ** 2 / counts[filled])) / size
    degrees = 2 * int(filled.sum())
    above, below = (max(float(tail(q, degrees)), 1e-300) for tail in (chi2.sf, chi2.cdf))
    return float(norm.isf(above) if above < below else -norm.isf(below))


def signs_of(left: np.ndarray, time: np.ndarray) -> tuple[str, ...]:
    """What residuals look like: a sensor that drifts.

    Args:
        left: shape (samples, axes), NaN where nothing was measured.
        time: of the samples [s].
    """
    found = []
    for axis, column in enumerate(left.T):
        there = np.isfinite(column)
        at, values = time[there], column[there]
        slope, level = np.polyfit(at, values, 1)
        rest = values - slope * at - level
        drift = float(slope * (at[-1] - at[0]))
        if abs(drift) > DRIFT * float(rest.std()):
            found.append(f"axis {axis + 1} drifts by {drift:.3g}: does its sensor?")
    return tuple(found)


def noises_of(recordings: Sequence[Measured]) -> list[float]:
    """Standard deviations of what looks like noise, whitened where it has a colour."""
    return [
        max(noise_of(whitened(whitening_of(each), each.signals)), NOISELESS * each.rms)
        for each in recordings
    ]


def ljung_box(centred: np.ndarray, lags: int) -> float:
    """Q of a series with mean 0: n (n + 2) times the sum of r_k^2 / (n - k)."""
    count, square = len(centred), float(centred @ centred)
    if square == 0.0:
        return 0.0
    r = [float(centred[k:] @ centred[:-k]) / square for k in range(1, lags + 1)]
    return count * (count + 2) * sum(x * x / (count - k) for k, x in enumerate(r, 1))


def _cumulative(centred: np.ndarray) -> float:
    """p of the cumulative periodogram (Kolmogorov and Smirnov)."""
    power = np.abs(np.fft.rfft(centred))[1:-1] ** 2
    whole = float(power.sum())
    if whole == 0.0 or len(power) < 8:
        return 1.0
    along = np.cumsum(power) / whole
    straight = np.arange(1, len(power) + 1) / len(power)
    distance = float(np.max(np.abs(along - straight)))
    return float(kstwobign.sf(distance * math.sqrt(len(power))))


def total_z(found: Sequence[Whiteness]) -> float:
    """Of all recordings that can be judged, as one z; 0 where none can."""
    judged = [each.worst for each in found if each.judged]
    return sum(judged) / math.sqrt(len(judged)) if judged else 0.0


def noise_of(signals: np.ndarray) -> float:
    """Standard deviation of what looks like noise: the quiet end of the spectrum, over all axes.

    Args:
        signals: shape (samples, axes), NaN where there are none.
    """
    found = []
    for column in signals.T:
        values = column[np.isfinite(column)]
        window = np.hanning(len(values))
        power = np.abs(np.fft.rfft((values - values.mean()) * window)) ** 2 / (window @ window)
        upper = power[3 * len(power) // 4 : -1]
        # Of an exponential distribution the median is ln 2 of the mean.
        found.append(float(np.median(upper)) / math.log(2.0))
    return math.sqrt(float(np.mean(found)))
