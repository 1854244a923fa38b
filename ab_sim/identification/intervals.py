"""Confidence intervals of fitted values, from the curvature of the fit or from profiles."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from ab_sim.base.presentation import Progress
from ab_sim.identification.information import covariance_of, sum_of_squares
from ab_sim.identification.knowledge import UNKNOWN
from ab_sim.identification.problem import Problem
from ab_sim.identification.stages import minimise

SHARE = 0.95
"""Confidence level of intervals."""
CURVATURE, PROFILE, HELD, OPEN = "curvature", "profile", "held", "open"
"""Origins of an interval.

``CURVATURE`` and ``PROFILE``: computed. ``HELD``: the value was fixed. ``OPEN``: the recordings do
not determine it.
"""
_AT_BOUND = 1e-4
"""Largest distance from a bound at which a parameter counts as at the bound.

Relative to the parameter's range, or to its standard deviation if that is smaller.
"""
_SKEW = 0.2
"""Largest relative deviation of the rise at an interval's end from a parabola."""
_PROFILE_STEPS = 6
"""Largest number of iterations in which the other parameters are refitted at a profile point."""
_PROFILE_POINTS = 8
"""Largest number of profile points on each side."""
HIGH = 10.0
"""Ratio of the rise at a profile point to that at the interval's end that calls for bisection.

Closer to the end, the profile is nearly a parabola, and interpolation is accurate.
"""


class Estimate(NamedTuple):
    """Fitted value of a parameter, and the 95 % confidence interval."""

    name: str
    unit: str
    """SI unit of all numbers of the estimate; ``1`` if they have none."""
    value: float
    low: float
    """Lower end of the interval; -inf if it is open."""
    high: float
    """Upper end of the interval; inf if it is open."""
    deviation: float
    """Standard deviation from the curvature; infinite for undetermined parameters."""
    how: str
    """Origin of the interval: ``CURVATURE``, ``PROFILE``, ``HELD`` or ``OPEN``."""
    at_bound: bool
    """True if the value is within ``_AT_BOUND`` of a bound of its parameter."""
    start: float
    """Value in the scene."""
    per_recording: bool
    """True if the parameter belongs to a single recording."""

    @property
    def bounded(self) -> bool:
        """True if the interval is finite and its lower end is not 0: the value's size is known."""
        return bool(np.isfinite(self.low) and np.isfinite(self.high)) and self.low != 0.0


class ProfilePoints(NamedTuple):
    """Profile of a parameter: rise of the cost as it moves and all others are refitted."""

    name: str
    values: tuple[float, ...]
    """Rising values of the parameter [SI]."""
    rises: tuple[float, ...]
    """Rises of the sum of squares in units of the noise variance."""


class Intervals(NamedTuple):
    """Intervals of all parameters."""

    estimates: tuple[Estimate, ...]
    names: tuple[str, ...]
    """Names of the free parameters, in the order of the covariance."""
    covariance: np.ndarray
    """Covariance of the free parameters [SI], shape (free, free)."""
    profiles: tuple[ProfilePoints, ...]

    @property
    def correlation(self) -> np.ndarray:
        """Correlation matrix of the free parameters."""
        sizes = np.sqrt(np.diag(self.covariance))
        matrix: np.ndarray = self.covariance / np.outer(sizes, sizes)
        return matrix


def intervals_of(
    problem: Problem,
    values: np.ndarray,
    free: Sequence[int],
    tell: Progress,
    profiles: bool = True,
) -> Intervals:
    """Compute intervals around a fit.

    Parameters
    ----------
    problem
        Problem whose noise was set from the residuals.
    values
        Best values of all parameters [SI].
    free
        Indices of the fitted parameters, without undetermined ones.
    tell
        Progress callback.
    profiles
        Whether to compute profiles of skewed parameters and of those at a bound.

    Returns
    -------
    Intervals
        Estimates of all parameters, and the covariance of the free ones. Fixed parameters have an
        open interval.
    """
    free = list(free)
    scales = problem.scales[free]
    residuals = problem.residuals(values)
    jacobian = problem.derivatives(values, free)
    freedom = max(len(residuals) - len(free), 1)
    # Limit the variance from below: recorded simulations have no noise, and their residuals are
    # only rounding.
    variance = max(sum_of_squares(residuals) / freedom, 1.0)
    covariance = variance * covariance_of(jacobian) * np.outer(scales, scales)
    # Leave out unknown directions: a move along them would leave the range in which the derivatives
    # hold. Equal balls that start together have one, because they may be exchanged.
    followed = covariance_of(jacobian, UNKNOWN) * np.outer(scales, scales)
    reach = float(student.ppf(0.5 + 0.5 * SHARE, freedom))
    deviations = np.sqrt(np.diag(covariance))
    reaches = reach * deviations
    skews = _skews(problem, values, free, followed, variance, reaches, reach) if profiles else {}
    estimates, drawn = [], []
    for j, parameter in enumerate(problem.parameters):
        value = float(values[j])
        if j not in free:
            estimates.append(
                Estimate(parameter.name, parameter.unit, value, -np.inf, np.inf, np.inf, HELD,
                         False, parameter.start, parameter.recording is not None)
            )  # fmt: skip
            continue
        k = free.index(j)
        deviation = float(deviations[k])
        width = parameter.high - parameter.low
        near = _AT_BOUND * min(width, deviation) if np.isfinite(width) else 0.0
        at_bound = min(value - parameter.low, parameter.high - value) <= near
        low, high, how = value - reach * deviation, value + reach * deviation, CURVATURE
        # A skewed sum of squares or a bound invalidates the symmetric interval: profile the
        # parameter instead.
        if profiles and (at_bound or skews[j] > _SKEW):
            tell(f"profile of {parameter.name}", k, len(free))
            step = 2.0 * min(deviation, UNKNOWN * parameter.scale)
            ends = [
                _end(problem, values, free, followed, j, way, step, variance * reach**2)
                for way in (-1.0, 1.0)
            ]
            low, high, how = ends[0][0], ends[1][0], PROFILE
            points = sorted([*ends[0][1], (value, 0.0), *ends[1][1]])
            drawn.append(
                ProfilePoints(
                    parameter.name,
                    tuple(point[0] for point in points),
                    tuple(point[1] / variance for point in points),
                )
            )
        low = max(low, parameter.least)
        estimates.append(
            Estimate(parameter.name, parameter.unit, value,
                     max(low, parameter.low) if at_bound else low,
                     min(high, parameter.high) if at_bound else high, deviation, how, at_bound,
                     parameter.start, parameter.recording is not None)
        )  # fmt: skip
    names = tuple(problem.parameters[j].name for j in free)
    return Intervals(tuple(estimates), names, covariance, tuple(drawn))


def _moved(
    problem: Problem, values: np.ndarray, free: Sequence[int], followed: np.ndarray,
    j: int, by: float,
) -> np.ndarray:  # fmt: skip
    """Return values with parameter ``j`` moved by ``by`` [SI] and the other free ones refitted.

    The best fit is that of a parabola with covariance ``followed``, limited to the bounds.
    """
    k = list(free).index(j)
    moved = values.copy()
    if followed[k, k] > 0.0:
        moved[list(free)] += by * followed[:, k] / followed[k, k]
    moved[j] = values[j] + by
    low = np.array([parameter.low for parameter in problem.parameters])
    high = np.array([parameter.high for parameter in problem.parameters])
    return np.clip(moved, low, high)


def _skews(
    problem: Problem, values: np.ndarray, free: Sequence[int], followed: np.ndarray,
    variance: float, reaches: np.ndarray, reach: float,
) -> dict[int, float]:  # fmt: skip
    """Return the relative deviation of the cost from a parabola, by index of the parameter.

    It is the larger of those at both ends of the parameter's interval.
    """
    best = problem.cost(values)
    skews = {}
    for j, step in zip(free, reaches.tolist(), strict=True):
        rises = [
            2.0
            * (problem.cost(_moved(problem, values, free, followed, j, way * step)) - best)
            / (variance * reach**2)
            for way in (-1.0, 1.0)
        ]
        skews[j] = max(abs(rise - 1.0) for rise in rises)
    return skews


def _end(
    problem: Problem, values: np.ndarray, free: Sequence[int], followed: np.ndarray,
    j: int, way: float, step: float, rise: float,
) -> tuple[float, list[tuple[float, float]]]:  # fmt: skip
    """Return one end of a profile's interval [SI], and the points (value, rise) of the profile.

    At the end, the sum of squares has risen by ``rise`` after a fit of all other parameters (D. M.
    Bates and D. G. Watts, Nonlinear Regression Analysis and Its Applications, Wiley 1988, section
    6.1). The end is infinite if the bound in direction ``way``, -1 or 1, is reached first.
    """
    parameter = problem.parameters[j]
    others = [i for i in free if i != j]
    best = problem.cost(values)
    bound = parameter.high if way > 0.0 else parameter.low
    if parameter.is_own_angle:
        # Half a revolution away, the profile meets its other side.
        bound = values[j] + way * math.pi
    at, seen = float(values[j]), 0.0
    points: list[tuple[float, float]] = []
    now = values

    def refit(place: float, begin: np.ndarray) -> tuple[float, np.ndarray]:
        # The parabola predicts the other parameters well near the best fit only. Farther away their
        # values at the last point may be better.
        alone = begin.copy()
        alone[j] = place
        along = _moved(problem, begin, free, followed, j, place - float(begin[j]))
        fit = minimise(problem, min(along, alone, key=problem.cost), others, _PROFILE_STEPS)
        return max(2.0 * (fit.cost - best), 0.0), fit.values

    def end_between(near: float, less: float, far: float, more: float) -> float:
        for _ in range(_PROFILE_POINTS):
            # Far above the rise, the profile is no parabola: halve the bracket.
            middle = _root(near, less, far, more, rise)
            if more > HIGH * rise:
                middle = 0.5 * (near + far)
            there, _ = refit(middle, now)
            points.append((middle, there))
            if there < rise:
                near, less = middle, there
            else:
                far, more = middle, there
            if more <= HIGH * rise:
                break
        return _root(near, less, far, more, rise)

    # Double the step until the rise is bracketed.
    for _ in range(_PROFILE_POINTS):
        place = at + way * step
        if (bound - place) * way <= 0.0:
            place = bound
        fit, now = refit(place, now)
        points.append((place, fit))
        if fit >= rise:
            return end_between(at, seen, place, fit), points
        if place == bound:
            return way * np.inf, points
        at, seen, step = place, fit, 2.0 * step
    return way * np.inf, points


def _root(a: float, rise_a: float, b: float, rise_b: float, rise: float) -> float:
    """Return the place between a and b at which a profile has a rise.

    The square root of the rise is interpolated linearly, which is exact for a parabola.
    """
    low, high, wanted = np.sqrt([rise_a, rise_b, rise])
    return float(a + (b - a) * (wanted - low) / (high - low))
