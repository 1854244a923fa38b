"""Motion of a recorded spindle: angle from pulses, and a profile from speed or angle.

Profiles of scenes have straight pieces of speed. First the knots are located: each piece is
extended as long as a straight line stays within the tolerance. Then a spline with these knots is
fitted by least squares: a linear one to the speed, or a quadratic one to the angle if it was
recorded.
"""

import math

import numpy as np
from scipy.interpolate import BSpline, UnivariateSpline, make_lsq_spline
from scipy.optimize import least_squares

from ab_sim.base.errors import InputError
from ab_sim.model.spindle import Ramp, SpeedSchedule

_FEWEST_PULSES = 10
"""Least number of pulses."""
LOW, _MIDDLE, HIGH = 0.35, 0.5, 0.65
"""Thresholds of pulses, as fractions of the reading's range.

A pulse starts where the reading rises through ``_MIDDLE``, if it was below ``LOW`` since the last
pulse and reaches ``HIGH`` afterwards.
"""
_MISSED, DOUBLED = 1.7, 0.6
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

    Parameters
    ----------
    time
        Times of the samples [s].
    reading
        Finite reading of the keyphasor's sensor, in any unit.
    per_turn
        Pulses per turn.
    name
        Name of the recording.

    Raises
    ------
    InputError
        There are too few pulses, or one is missing or counted twice.
    """
    pulses = _pulse_times(time, reading)
    if len(pulses) < _FEWEST_PULSES:
        raise InputError(
            f"{name}: keyphasor: has {len(pulses)} pulses; must be at least {_FEWEST_PULSES}; is "
            "it the right column, and is the sampling rate high enough to see each pulse?"
        )
    between = np.diff(pulses)
    longer = np.maximum(between[2:], between[:-2])
    shorter = np.minimum(between[2:], between[:-2])
    odd = np.flatnonzero((between[1:-1] > _MISSED * longer) | (between[1:-1] < DOUBLED * shorter))
    if len(odd):
        at = int(odd[0]) + 1
        raise InputError(
            f"{name}: keyphasor: after {pulses[at]:.4g} s the next pulse comes in "
            f"{between[at]:.3g} s; the intervals before and after are {between[at - 1]:.3g} and "
            f"{between[at + 1]:.3g} s: a pulse is missing or counted twice; cut the recording "
            "there, or clean the column"
        )
    angles = 2.0 * math.pi / per_turn * np.arange(len(pulses))
    # The fourth difference removes the spindle's motion from the pulse times. The median of its
    # size is 0.6745 standard deviations.
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
    """Return the times [s] at which pulses rise through ``_MIDDLE``, between samples."""
    low, high = float(reading.min()), float(reading.max())
    if low == high:
        return np.empty(0)
    level = (reading - low) / (high - low)
    state = np.where(level > HIGH, 1, np.where(level < LOW, -1, 0))
    marks = np.flatnonzero(state)
    begins = marks[1:][(state[marks[1:]] == 1) & (state[marks[:-1]] == -1)]
    rising = np.flatnonzero((level[:-1] < _MIDDLE) & (level[1:] >= _MIDDLE))
    before = rising[np.searchsorted(rising, begins) - 1]
    share = (_MIDDLE - level[before]) / (level[before + 1] - level[before])
    times: np.ndarray = time[before] + share * (time[before + 1] - time[before])
    return times


_MOST_PIECES = 400
"""Largest number of pieces; more would fit noise, or curvature that does not affect balls."""
_FINEST = 1e-10
"""Rounding error of a recorded simulation, relative to the largest speed."""
_MOST_MOVED, ENOUGH = 12, 4000
"""Largest number of knots whose times are optimised, and approximate number of samples used."""
NOISE = 4.5
"""Tolerance of a straight line in standard deviations of a tachometer's noise."""
_FEWEST = 3
"""Least number of samples of a piece."""


def schedule_from(
    time: np.ndarray, speed: np.ndarray | None, angle: np.ndarray | None, name: str
) -> SpeedSchedule:
    """Return the profile that a recorded spindle has followed.

    Parameters
    ----------
    time
        Times of the samples [s], rising from 0.
    speed
        Spindle speed [rad/s], or None if only the angle was recorded.
    angle
        Unwrapped spindle angle [rad], or None if only the speed was recorded.
    name
        Name of the recording, for messages.

    Raises
    ------
    InputError
        There is neither speed nor angle.
    """
    # Differences of an angle mix adjacent pieces, so the knots have to be refined.
    mixed = speed is None
    if speed is None:
        if angle is None:
            raise InputError(f"{name}: neither the spindle's speed nor its angle was recorded")
        speed = np.gradient(angle, time, edge_order=2)
    knots, noisy = _knots(time, speed)
    if noisy or mixed:
        knots = _refined(time, *((speed, 1) if angle is None else (angle, 2)), knots)
    if angle is not None:
        fitted = _spline(time, angle, knots, 2).derivative()
        start_angle = float(_spline(time, angle, knots, 2)(0.0))
    else:
        fitted, start_angle = _spline(time, speed, knots, 1), 0.0
    speeds = fitted(knots)
    pieces = [
        (float(t1 - t0), Ramp(float(w0), float((w1 - w0) / (t1 - t0))))
        for t0, t1, w0, w1 in zip(knots[:-1], knots[1:], speeds[:-1], speeds[1:], strict=True)
    ]
    return SpeedSchedule(pieces, float(speeds[-1]), 0.0, start_angle)


def _spline(time: np.ndarray, values: np.ndarray, knots: np.ndarray, degree: int) -> BSpline:
    """Return the least-squares spline through samples; ``knots`` include the ends once."""
    ends = [knots[0]] * degree, [knots[-1]] * degree
    return make_lsq_spline(time, values, np.concatenate([ends[0], knots, ends[1]]), degree)


def _refined(time: np.ndarray, values: np.ndarray, degree: int, knots: np.ndarray) -> np.ndarray:
    """Return knots [s] that are optimised for a spline through speed [rad/s] or angle [rad].

    The intersections of noisy lines, from which the knots start, are inaccurate.
    """
    inner = knots[1:-1]
    if not 0 < len(inner) <= _MOST_MOVED:
        return knots
    thin = max(1, len(time) // ENOUGH)
    times, samples = time[::thin], values[::thin]
    between = float(times[1] - times[0])
    # Knots keep their order, and at least ``_FEWEST`` samples between them: without samples in a
    # piece, the spline is not determined.
    reach = 0.45 * np.minimum(np.diff(knots)[:-1], np.diff(knots)[1:])
    reach = np.maximum(reach - _FEWEST * between, 0.0)

    def residuals(places: np.ndarray) -> np.ndarray:
        whole = np.concatenate([knots[:1], places, knots[-1:]])
        differences: np.ndarray = _spline(times, samples, whole, degree)(times) - samples
        return differences

    held = reach <= between
    low, high = inner - np.where(held, between, reach), inner + np.where(held, between, reach)
    best = least_squares(
        residuals,
        inner,
        bounds=(low, high),
        x_scale=between,
        diff_step=[1e-3] * len(inner),
        max_nfev=40,
    )
    return np.concatenate([knots[:1], best.x, knots[-1:]])


def _knots(time: np.ndarray, speed: np.ndarray) -> tuple[np.ndarray, bool]:
    """Return the knots of the speed [s], ends included, and whether the speed is noisy."""
    top = float(np.max(np.abs(speed)))
    # The second difference of white noise has six times its variance; that of a line is 0.
    bend = np.diff(speed, 2)
    noise = float(np.median(np.abs(bend))) / 0.6745 / np.sqrt(6.0) if len(bend) else 0.0
    tolerance = max(_FINEST * top, NOISE * noise, 1e-300)
    while True:
        lines = _lines(time, speed, tolerance)
        if len(lines) <= _MOST_PIECES:
            break
        tolerance *= 4.0
    knots = [time[0]]
    for (a0, b0, _, j), (a1, b1, i, _) in zip(lines[:-1], lines[1:], strict=True):
        meet = (a0 - a1) / (b1 - b0) if b1 != b0 else np.inf
        # Noisy lines may intersect elsewhere; use the middle between the two samples instead.
        inside = time[j - 1] <= meet <= time[min(i + 1, len(time) - 1)]
        meet = meet if inside else 0.5 * (time[j] + time[i])
        if np.count_nonzero((time >= knots[-1]) & (time <= meet)) >= _FEWEST:
            knots.append(float(meet))
    if len(knots) > 1 and np.count_nonzero(time >= knots[-1]) < _FEWEST:
        knots.pop()
    return np.array([*knots, float(time[-1])]), tolerance > 10.0 * _FINEST * top


def _lines(
    time: np.ndarray, speed: np.ndarray, tolerance: float
) -> list[tuple[float, float, int, int]]:
    """Divide samples into the longest straight pieces within a tolerance [rad/s].

    Return intercept and slope of each piece, and the indices of its first and last sample.
    """
    lines, first = [], 0
    # Double the length of a piece until the line misses a sample, then bisect. The effort is nearly
    # proportional to the number of samples.
    while first < len(time):
        reach, far = min(first + _FEWEST, len(time)), len(time)
        step = _FEWEST
        while reach < far and _line(time, speed, first, reach)[2] <= tolerance:
            step *= 2
            reach = min(first + step, far)
        low, high = max(first + step // 2, min(first + _FEWEST, far)), reach
        if _line(time, speed, first, reach)[2] <= tolerance:
            low = reach
        while high - low > 1:
            middle = (low + high) // 2
            good = _line(time, speed, first, middle)[2] <= tolerance
            low, high = (middle, high) if good else (low, middle)
        begin, slope, _ = _line(time, speed, first, low)
        lines.append((begin, slope, first, low - 1))
        first = low
    return lines


def _line(time: np.ndarray, speed: np.ndarray, i: int, j: int) -> tuple[float, float, float]:
    """Return intercept, slope and error of the regression line through samples i to j - 1.

    The error is the largest distance of a sample from the line.
    """
    t, w = time[i:j], speed[i:j]
    middle, mean = float(t.mean()), float(w.mean())
    square = float(((t - middle) ** 2).sum())
    slope = float(((t - middle) * (w - mean)).sum() / square) if square else 0.0
    worst = float(np.max(np.abs(w - mean - slope * (t - middle))))
    return mean - slope * middle, slope, worst
