"""How far a fitted value may be off: from the curvature of the fit, or along its profile."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import t as student

from ab_sim.identification.information import covariance_of, sum_of_squares
from ab_sim.identification.problem import Problem
from ab_sim.identification.stages import Tell, minimise

SHARE = 0.95
"""Of intervals."""
CURVATURE, PROFILE, HELD, OPEN = "curvature", "profile", "held", "open"
"""Where an interval is from; that the value was held; that nothing of the recording tells it."""
AT_BOUND = 1e-4
"""Of a parameter's range, or of its standard deviation if less: so near it is at its bound."""
SKEW = 0.2
"""By which the sum of squares at an end of an interval may be off what a parabola says."""
PROFILE_STEPS = 6
"""Iterations of the others at each point of a profile."""
PROFILE_POINTS = 8
"""Looked at on each side, at most."""


class Estimate(NamedTuple):
    """A fitted number with its interval of 95 %."""

    name: str
    unit: str
    value: float
    low: float
    high: float
    deviation: float
    """Standard deviation, from the curvature; infinite of what is open."""
    how: str
    """``CURVATURE``, ``PROFILE``, ``HELD`` or ``OPEN``."""
    at_bound: bool
    start: float
    """What the scene says."""
    own: bool
    """Whether it is a recording's own."""

    @property
    def bounded(self) -> bool:
        """Whether its interval tells its size: it has an end, and is not all from 0 up to it."""
        return bool(np.isfinite(self.low) and np.isfinite(self.high)) and self.low != 0.0

    def report(self) -> dict[str, Any]:
        """Fields by name."""
        return self._asdict()


class ProfilePoints(NamedTuple):
    """How the fit gets worse as one parameter is moved and all others follow."""

    name: str
    values: tuple[float, ...]
    rises: tuple[float, ...]
    """Of the sum of squares, in units of the noise's variance."""


class Intervals(NamedTuple):
    """Of all parameters."""

    estimates: tuple[Estimate, ...]
    names: tuple[str, ...]
    """Of the free parameters, in the order of the covariance."""
    covariance: np.ndarray
    """Of the free parameters [SI], shape (free, free)."""
    profiles: tuple[ProfilePoints, ...]

    @property
    def correlation(self) -> np.ndarray:
        """Of the free parameters."""
        sizes = np.sqrt(np.diag(self.covariance))
        found: np.ndarray = self.covariance / np.outer(sizes, sizes)
        return found


def intervals_of(
    problem: Problem,
    values: np.ndarray,
    free: Sequence[int],
    tell: Tell,
    profiles: bool = True,
) -> Intervals:
    """Intervals about a fit.

    Args:
        problem: whose noise is what the residuals are.
        values: of all parameters [SI], the best there are.
        free: numbers of those that were fitted; what is open is not among them.
        tell: progress.
        profiles: whether skew ones, and those at a bound, are followed.
    """
    free = list(free)
    scales = problem.scales[free]
    residuals = problem.residuals(values)
    jacobian = problem.derivatives(values, free)
    left = max(len(residuals) - len(free), 1)
    # Less than the noise is no noise at all, but what rounding leaves: of recorded simulations.
    variance = max(sum_of_squares(residuals) / left, 1.0)
    covariance = variance * covariance_of(jacobian) * np.outer(scales, scales)
    reach = float(student.ppf(0.5 + 0.5 * SHARE, left))
    deviations = np.sqrt(np.diag(covariance))
    skews = _skews(problem, values, free, covariance, variance, reach) if profiles else {}
    estimates, drawn = [], []
    for j, each in enumerate(problem.parameters):
        value = float(values[j])
        if j not in free:
            estimates.append(
                Estimate(each.name, each.unit, value, -np.inf, np.inf, np.inf, HELD, False,
                         each.start, each.recording is not None)
            )  # fmt: skip
            continue
        k = free.index(j)
        deviation = float(deviations[k])
        width = each.high - each.low
        near = AT_BOUND * min(width, deviation) if np.isfinite(width) else 0.0
        at_bound = min(value - each.low, each.high - value) <= near
        low, high, how = value - reach * deviation, value + reach * deviation, CURVATURE
        if profiles and (at_bound or skews[j] > SKEW):
            tell(f"profile of {each.name}", k, len(free))
            ends = [
                _end(problem, values, free, covariance, j, way, variance * reach**2)
                for way in (-1.0, 1.0)
            ]
            low, high, how = ends[0][0], ends[1][0], PROFILE
            points = sorted([*ends[0][1], (value, 0.0), *ends[1][1]])
            drawn.append(
                ProfilePoints(
                    each.name,
                    tuple(point[0] for point in points),
                    tuple(point[1] / variance for point in points),
                )
            )
        low = max(low, each.least)
        estimates.append(
            Estimate(each.name, each.unit, value, max(low, each.low) if at_bound else low,
                     min(high, each.high) if at_bound else high, deviation, how, at_bound,
                     each.start, each.recording is not None)
        )  # fmt: skip
    names = tuple(problem.parameters[j].name for j in free)
    return Intervals(tuple(estimates), names, covariance, tuple(drawn))


def _moved(
    problem: Problem, values: np.ndarray, free: Sequence[int], covariance: np.ndarray,
    j: int, by: float,
) -> np.ndarray:  # fmt: skip
    """A parameter moved, the others following as a parabola says, within their bounds."""
    k = list(free).index(j)
    moved = values.copy()
    moved[list(free)] += by * covariance[:, k] / covariance[k, k]
    low = np.array([each.low for each in problem.parameters])
    high = np.array([each.high for each in problem.parameters])
    return np.clip(moved, low, high)


def _skews(
    problem: Problem, values: np.ndarray, free: Sequence[int], covariance: np.ndarray,
    variance: float, reach: float,
) -> dict[int, float]:  # fmt: skip
    """By how much the rise at the intervals' ends is off what a parabola says, as a share."""
    best = problem.cost(values)
    found = {}
    for j in free:
        k = list(free).index(j)
        step = reach * float(np.sqrt(covariance[k, k]))
        rises = [
            2.0
            * (problem.cost(_moved(problem, values, free, covariance, j, way * step)) - best)
            / (variance * reach**2)
            for way in (-1.0, 1.0)
        ]
        found[j] = max(abs(rise - 1.0) for rise in rises)
    return found


def _end(
    problem: Problem, values: np.ndarray, free: Sequence[int], covariance: np.ndarray,
    j: int, way: float, rise: float,
) -> tuple[float, list[tuple[float, float]]]:  # fmt: skip
    """Where the fit has become worse by so much, and the points on the way; infinite: nowhere."""
    each, k = problem.parameters[j], list(free).index(j)
    others = [i for i in free if i != j]
    best = problem.cost(values)
    bound = each.high if way > 0.0 else each.low
    if each.is_own_angle:
        bound = values[j] + way * math.pi
    step = 2.0 * float(np.sqrt(covariance[k, k]))
    at, seen = float(values[j]), 0.0
    points: list[tuple[float, float]] = []
    now = values

    def look(place: float, begin: np.ndarray) -> tuple[float, np.ndarray]:
        moved = _moved(problem, begin, free, covariance, j, place - float(begin[j]))
        moved[j] = place
        found = minimise(problem, moved, others, PROFILE_STEPS)
        return max(2.0 * (found.cost - best), 0.0), found.values

    def end_between(near: float, less: float, far: float, more: float) -> float:
        middle = _root(near, less, far, more, rise)
        there, _ = look(middle, now)
        points.append((middle, there))
        if there < rise:
            return _root(middle, there, far, more, rise)
        return _root(near, less, middle, there, rise)

    for _ in range(PROFILE_POINTS):
        place = at + way * step
        if (bound - place) * way <= 0.0:
            place = bound
        found, now = look(place, now)
        points.append((place, found))
        if found >= rise:
            return end_between(at, seen, place, found), points
        if place == bound:
            return way * np.inf, points
        at, seen, step = place, found, 2.0 * step
    return way * np.inf, points


def _root(a: float, rise_a: float, b: float, rise_b: float, rise: float) -> float:
    """Between two points, where the square root of the rise is taken as straight."""
    low, high, wanted = np.sqrt([rise_a, rise_b, rise])
    return float(a + (b - a) * (wanted - low) / (high - low))
