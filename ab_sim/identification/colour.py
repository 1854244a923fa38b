"""Whitening filter for sensor noise that a low-pass has coloured.

Noise before the low-pass and rounding after it have a known spectrum S. Its minimum-phase factor
follows from the logarithm of S by the cepstrum (A. V. Oppenheim and R. W. Schafer, Discrete-Time
Signal Processing, 3rd ed., section 13.5). The inverse of this factor whitens the noise. Measured
and simulated signals both pass the filter.
"""

import numpy as np
from scipy.signal import fftconvolve, lfilter

from ab_sim.drive.pickup import Pickup
from ab_sim.identification.measured import Measured
from ab_sim.scene.sensors import Sampled

_LONG = 4096
"""Length of the low-pass' impulse response and of spectra, in samples."""
_MOST_TAPS = 512
"""Largest number of taps of a whitening filter."""
LEFT_OUT = 1e-5
"""Root mean square of the taps cut off at the filter's end, relative to all taps."""
PARTS = 4
"""Number of steps per sampling interval for a real sensor's low-pass."""


def low_pass_alone(sensor: Sampled, step: float) -> Pickup:
    """Return a sensor's low-pass without noise and quantisation, on the deck's axes.

    Parameters
    ----------
    sensor
        Parameters of the sensor.
    step
        Integration step [s].
    """
    digits = {"noise_density": 0.0, "resolution": 0.0, "range": 1e9}
    settings = {**digits, "axis_angle": 0.0, "sample_rate": 1.0 / step}
    return Pickup(sensor.model_copy(update=settings), step)


def whitening_of(measured: Measured) -> np.ndarray | None:
    """Return the taps of a recording's whitening filter, the first being 1.

    Return None if the signals passed no sensor, or a sensor of unknown noise.
    """
    sensor = measured.sensor
    if sensor is None or (sensor.noise_density == 0.0 and sensor.resolution == 0.0):
        return None
    between = float(np.median(np.diff(measured.time)))
    step = between / PARTS if measured.step is None else measured.step
    every = max(1, round(between / step))
    spectrum = np.abs(np.fft.rfft(_covariance(sensor, step, every)))
    # Far above its cut-off the low-pass leaves nothing but rounding errors, even zeros: the
    # lower limit keeps the logarithm finite and the filter short.
    cepstrum = np.fft.irfft(np.log(np.maximum(spectrum, 1e-12 * spectrum.max())))
    half = len(cepstrum) // 2
    # Inverse of the minimum-phase factor: the causal half of the cepstrum with reversed sign.
    folded = np.zeros(len(cepstrum))
    folded[1:half] = -cepstrum[1:half]
    taps = np.fft.irfft(np.exp(np.fft.rfft(folded)))[:half]
    tails = np.sqrt(np.cumsum(taps[::-1] ** 2)[::-1])
    count = int(np.argmax(tails < LEFT_OUT * tails[0])) or half
    filter_taps: np.ndarray = taps[: min(count, _MOST_TAPS)]
    return filter_taps if len(filter_taps) > 1 else None


def whitened(taps: np.ndarray | None, signals: np.ndarray) -> np.ndarray:
    """Return filtered signals; the first samples are NaN until the filter is filled.

    Parameters
    ----------
    taps
        Taps from ``whitening_of``; None returns the signals unchanged.
    signals
        Signals, shape (..., samples, axes).
    """
    if taps is None:
        return signals
    filtered: np.ndarray = lfilter(taps, np.ones(1), signals, axis=-2)
    filtered[..., : len(taps) - 1, :] = np.nan
    return filtered


def _covariance(sensor: Sampled, step: float, every: int) -> np.ndarray:
    """Return the autocovariance of a sensor's noise, in the order of an FFT.

    Lag 0 is first, then the positive lags, then the negative ones. A lag is ``every`` steps long.
    """
    response = np.zeros((_LONG, 2))
    response[0] = 1.0
    passed = low_pass_alone(sensor, step).process(1, response)[:, 0]
    # Variance of white noise: its one-sided density times the Nyquist frequency.
    # Variance of white noise: its one-sided density times the Nyquist frequency.
    size = sensor.noise_density**2 * 0.5 / step
    whole = size * fftconvolve(passed, passed[::-1])[_LONG - 1 :: every]
    count = _LONG // 2
    kept = np.zeros(count)
    kept[: min(count, len(whole))] = whole[:count]
    # Rounding to a resolution r, after the low-pass, adds white noise of variance r^2 / 12.
    # Rounding to a resolution r, after the low-pass, adds white noise of variance r^2 / 12.
    kept[0] += sensor.resolution**2 / 12.0
    return np.concatenate([kept, [0.0], kept[:0:-1]])
