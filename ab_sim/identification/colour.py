"""Noise of a sensor is not white behind its low-pass: the filter that makes it so again.

Noise before the low-pass and rounding behind it have a known spectrum S. Its factor of minimum
phase follows from the logarithm of S by the cepstrum (A. V. Oppenheim and R. W. Schafer,
Discrete-Time Signal Processing, 3rd ed., section 13.5), and one over it whitens. Both what was
measured and what is simulated go through it.
"""

import numpy as np
from scipy.signal import fftconvolve, lfilter

from ab_sim.identification.measured import Measured
from ab_sim.scene.sensors import Sampled
from ab_sim.sensing import Pickup

LONG = 4096
"""Of the low-pass' response to an impulse, and of spectra."""
MOST_TAPS = 512
LEFT_OUT = 1e-5
"""Of the filter's length (r.m.s.), that is cut off at its end."""
PARTS = 4
"""Steps of a real sensor's low-pass in a sampling interval."""


def low_pass_alone(sensor: Sampled, step: float) -> Pickup:
    """What is left of a sensor without noise and digits, sampled at each step, on the deck's axes.

    Args:
        sensor: its parameters.
        step: integration step [s].
    """
    digits = {"noise_density": 0.0, "resolution": 0.0, "range": 1e9}
    own = {**digits, "axis_angle": 0.0, "sample_rate": 1.0 / step}
    return Pickup(sensor.model_copy(update=own), step)


def whitening_of(measured: Measured) -> np.ndarray | None:
    """Taps of the filter after which the sensor's noise is white, the first being 1.

    None where the signals went through no sensor, or one whose noise is not known.
    """
    sensor = measured.sensor
    if sensor is None or (sensor.noise_density == 0.0 and sensor.resolution == 0.0):
        return None
    between = float(np.median(np.diff(measured.time)))
    step = between / PARTS if measured.step is None else measured.step
    every = max(1, round(between / step))
    spectrum = np.abs(np.fft.rfft(_covariance(sensor, step, every)))
    cepstrum = np.fft.irfft(np.log(np.maximum(spectrum, 1e-12 * spectrum.max())))
    half = len(cepstrum) // 2
    # One over the factor of minimum phase: half of the cepstrum, its sign turned.
    folded = np.zeros(len(cepstrum))
    folded[1:half] = -cepstrum[1:half]
    taps = np.fft.irfft(np.exp(np.fft.rfft(folded)))[:half]
    tails = np.sqrt(np.cumsum(taps[::-1] ** 2)[::-1])
    count = int(np.argmax(tails < LEFT_OUT * tails[0])) or half
    found: np.ndarray = taps[: min(count, MOST_TAPS)]
    return found if len(found) > 1 else None


def whitened(taps: np.ndarray | None, signals: np.ndarray) -> np.ndarray:
    """SimulatedSignals behind the filter; the first ones, of which it has not seen enough, are NaN.

    Args:
        taps: as of ``whitening_of``; None: as they are.
        signals: along the last axis but one, shape (..., samples, axes).
    """
    if taps is None:
        return signals
    found: np.ndarray = lfilter(taps, np.ones(1), signals, axis=-2)
    found[..., : len(taps) - 1, :] = np.nan
    return found


def _covariance(sensor: Sampled, step: float, every: int) -> np.ndarray:
    """Of noise at samples so many steps apart, in cyclic order."""
    response = np.zeros((LONG, 2))
    response[0] = 1.0
    passed = low_pass_alone(sensor, step).process(1, response)[:, 0]
    size = sensor.noise_density**2 * 0.5 / step
    whole = size * fftconvolve(passed, passed[::-1])[LONG - 1 :: every]
    count = LONG // 2
    kept = np.zeros(count)
    kept[: min(count, len(whole))] = whole[:count]
    kept[0] += sensor.resolution**2 / 12.0
    return np.concatenate([kept, [0.0], kept[:0:-1]])
