"""The spindle's angle from the pulses of a mark that passes a pick-up, one or several each turn."""

import math

import numpy as np
from scipy.interpolate import UnivariateSpline

from ab_sim.errors import InputError

FEWEST = 10
"""Pulses."""
LOW, MIDDLE, HIGH = 0.35, 0.5, 0.65
"""Shares of the range of the reading: a pulse begins where it passes the middle, has been below the
first since the last pulse, and goes above the last."""
MISSED, DOUBLED = 1.7, 0.6
"""Interval between pulses, of the longer and of the shorter one of its neighbours, from which a
pulse was missed or counted twice."""
SPREAD = math.sqrt(70.0) / 6.0
"""Standard deviation of an independent error's fourth difference, over 6, in units of its own."""


def angle_from_pulses(
    time: np.ndarray, reading: np.ndarray, per_turn: int, name: str
) -> np.ndarray:
    """Return the angle at each sample, 0 at the first pulse; NaN before it and after the last.

    A smoothing spline goes through the pulses as near as the scatter of their times says.

    Args:
        time: of the samples [s].
        reading: of the pick-up, finite, in any unit.
        per_turn: pulses each turn.
        name: of the recording.

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
            f"{between[at]:.3g} s, where those next to it take {between[at - 1]:.3g} and "
            f"{between[at + 1]:.3g} s: one is missing or counted twice; cut the recording there, "
            "or clean the column"
        )
    angles = 2.0 * math.pi / per_turn * np.arange(len(pulses))
    scatter = float(np.median(np.abs(np.diff(pulses, 4)))) / 6.0 / 0.6745 / SPREAD
    # A smooth run has fourth differences, too: never smooth by more than half a sample.
    scatter = min(scatter, 0.5 * float(np.median(np.diff(time))))
    speeds = np.gradient(angles, pulses)
    spline = UnivariateSpline(pulses, angles, w=1.0 / (speeds * max(scatter, 1e-12)), s=len(pulses))
    found = np.full(len(time), np.nan)
    inside = (time >= pulses[0]) & (time <= pulses[-1])
    found[inside] = spline(time[inside])
    return found


def _pulse_times(time: np.ndarray, reading: np.ndarray) -> np.ndarray:
    """Times at which a reading rises through its middle, between its samples."""
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
    found: np.ndarray = time[before] + share * (time[before + 1] - time[before])
    return found
