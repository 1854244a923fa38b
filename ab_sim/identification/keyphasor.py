"""Spindle angle from the pulses of one or several marks that pass a pick-up each turn."""

import math

import numpy as np
from scipy.interpolate import UnivariateSpline

from ab_sim.base.errors import InputError

FEWEST = 10
"""Least number of pulses."""
LOW, MIDDLE, HIGH = 0.35, 0.5, 0.65
"""Thresholds of pulses, as fractions of the reading's range.

A pulse starts where the reading rises through ``MIDDLE``, if it was below ``LOW`` since the last
pulse and reaches ``HIGH`` afterwards.
"""
MISSED, DOUBLED = 1.7, 0.6
"""Ratios of a pulse interval to its neighbours that indicate a missing or double pulse.

The first compares with the longer neighbour, the second with the shorter.
"""
SPREAD = math.sqrt(70.0) / 6.0
"""Standard deviation of the fourth difference of independent errors, divided by 6 times theirs."""


def angle_from_pulses(
    time: np.ndarray, reading: np.ndarray, per_turn: int, name: str
) -> np.ndarray:
    """Return the angle at each sample [rad], 0 at the first pulse; NaN outside the pulses.

    A smoothing spline is fitted to the pulses; its tolerance is the scatter of their times.

    Args:
        time: times of the samples [s].
        reading: finite reading of the pick-up, in any unit.
        per_turn: pulses per turn.
        name: name of the recording.

    Raises:
        InputError: there are too few pulses, or one is missing or counted twice.
    """
    pulses = _pulse_times(time, reading)
    if len(pulses) < FEWEST:
        raise InputError(
            f"{name}: keyphasor: has {len(pulses)} pulses; must be at least {FEWEST}; is it the "
            "right column, and is the sampling rate high enough to see each pulse?"
        )
    between = np.diff(pulses)
    longer = np.maximum(between[2:], between[:-2])
    shorter = np.minimum(between[2:], between[:-2])
    odd = np.flatnonzero((between[1:-1] > MISSED * longer) | (between[1:-1] < DOUBLED * shorter))
    if len(odd):
        at = int(odd[0]) + 1
        raise InputError(
            f"{name}: keyphasor: after {pulses[at]:.4g} s the next pulse comes in "
            f"{between[at]:.3g} s; the intervals before and after are {between[at - 1]:.3g} and "
            f"{between[at + 1]:.3g} s: a pulse is missing or counted twice; cut the recording "
            "there, or clean the column"
        )
    angles = 2.0 * math.pi / per_turn * np.arange(len(pulses))
    scatter = float(np.median(np.abs(np.diff(pulses, 4)))) / 6.0 / 0.6745 / SPREAD
    # A smooth change of speed also has fourth differences: limit the smoothing to half a sample.
    scatter = min(scatter, 0.5 * float(np.median(np.diff(time))))
    speeds = np.gradient(angles, pulses)
    spline = UnivariateSpline(pulses, angles, w=1.0 / (speeds * max(scatter, 1e-12)), s=len(pulses))
    interpolated = np.full(len(time), np.nan)
    inside = (time >= pulses[0]) & (time <= pulses[-1])
    interpolated[inside] = spline(time[inside])
    return interpolated


def _pulse_times(time: np.ndarray, reading: np.ndarray) -> np.ndarray:
    """Return times at which a reading rises through its middle, interpolated between samples."""
    low, high = float(reading.min()), float(reading.max())
    if low == high:
        return np.empty(0)
    level = (reading - low) / (high - low)
    state = np.where(level > HIGH, 1, np.where(level < LOW, -1, 0))
    marks = np.flatnonzero(state)
    begins = marks[1:][(state[marks[1:]] == 1) & (state[marks[:-1]] == -1)]
    rising = np.flatnonzero((level[:-1] < MIDDLE) & (level[1:] >= MIDDLE))
    before = rising[np.searchsorted(rising, begins) - 1]
    share = (MIDDLE - level[before]) / (level[before + 1] - level[before])
    times: np.ndarray = time[before] + share * (time[before + 1] - time[before])
    return times
