"""Pseudo-arclength continuation over speed, for states without a closed form.

A curve in state and speed is followed by its arc length, so that the continuation passes folds. At
a fold the speed component of the tangent changes sign; its root is located on the curve. Keller
(1977); Allgower and Georg, Numerical Continuation Methods (1990), ch. 6.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ab_sim.analysis.equilibria.finder import (
    Scales,
    converged,
    same,
    scaled_jacobian,
    scales_of,
)
from ab_sim.analysis.equilibria.resting import field_at
from ab_sim.model.dynamics.system import System

STEP = 0.05
"""Largest step of the arc length, in scaled states and speeds; halved if the corrector fails."""
MOST_POINTS = 4000
"""Largest number of points of a curve."""


class CurvePoint(NamedTuple):
    """Point on a curve of resting states."""

    speed: float
    """Speed [rad/s]."""
    state: np.ndarray
    fold: bool = False
    """True at a fold, where the speed reverses along the curve."""


class EquilibriumCurve:
    """Resting states of a system, as a curve in z = (state / scale, speed / fastest)."""

    def __init__(self, system: System, fastest: float) -> None:
        self.system, self.fastest = system, fastest
        self.scales: Scales = scales_of(system, fastest)

    def z(self, point: CurvePoint) -> np.ndarray:
        """Return the scaled coordinates of a point."""
        return np.append(point.state / self.scales.state, point.speed / self.fastest)

    def point(self, z: np.ndarray) -> CurvePoint:
        """Return the point with scaled coordinates ``z``."""
        return CurvePoint(float(z[-1]) * self.fastest, z[:-1] * self.scales.state)

    def off(self, z: np.ndarray) -> np.ndarray:
        """Return the scaled residual, which is 0 on the curve."""
        speed, state, _ = self.point(z)
        slope = field_at(self.system, speed).slope(0.0, state)
        return slope / (self.scales.state * self.scales.rate)

    def ways(self, z: np.ndarray) -> np.ndarray:
        """Return the derivatives of the residual.

        The derivative by speed is a central difference, because the kernel's Jacobian covers states
        only.
        """
        speed, state, _ = self.point(z)
        jacobian = scaled_jacobian(field_at(self.system, speed).jacobian(0.0, state), self.scales)
        h = np.zeros(len(z))
        h[-1] = 1e-5 * abs(z[-1]) + 1e-9
        along = (self.off(z + h) - self.off(z - h)) / (2.0 * h[-1])
        return np.column_stack([jacobian, along])

    def tangent(self, z: np.ndarray, like: np.ndarray) -> np.ndarray:
        """Return the unit tangent, with the orientation of ``like``."""
        way: np.ndarray = np.linalg.svd(self.ways(z))[2][-1]
        return way if way @ like >= 0.0 else -way

    def corrected(self, start: np.ndarray, way: np.ndarray) -> np.ndarray | None:
        """Return the curve's point in the plane normal to ``way`` through ``start``, or None.

        The corrector is Newton's method, extended by the equation of the plane. None if it does not
        converge.
        """
        z = start
        for _ in range(12):
            matrix = np.vstack([self.ways(z), way])
            step = np.linalg.lstsq(matrix, np.append(self.off(z), way @ (z - start)))[0]
            z = z - step
            if not np.isfinite(z).all():
                return None
            if np.abs(step).max() <= 1e-12 * (1.0 + np.abs(z).max()):
                return z
        return None

    def traced(self, start: CurvePoint, sense: float, low: float, high: float) -> list[CurvePoint]:
        """Follow the curve from a point, within a range of speeds.

        The first step raises (sense 1) or lowers (-1) the speed. The curve ends where it leaves the
        range, closes, or cannot be continued. Folds are among the points.
        """
        z = self.z(start)
        first, length = z, STEP
        way = self.tangent(z, np.append(np.zeros(len(z) - 1), sense))
        points = [start]
        while len(points) < MOST_POINTS and length > 1e-9:
            there = self.corrected(z + length * way, way)
            after = None if there is None else self.tangent(there, way)
            # Reject the step if the corrector fails or the tangent turns by more than 18 degrees:
            # the curve may have jumped to another branch.
            if there is None or after is None or after @ way < 0.95:
                length *= 0.5
                continue
            # The speed component of the tangent changed its sign: a fold lies within this step.
            if after[-1] * way[-1] < 0.0:
                points.append(self.point(self._fold(z, way, length))._replace(fold=True))
            z, way, length = there, after, min(1.4 * length, STEP)
            point = self.point(z)
            if not low <= point.speed <= high:
                edge = low if point.speed < low else high
                state = converged(self.system, edge, _between(points[-1], point, edge))
                return points if state is None else [*points, CurvePoint(edge, state)]
            points.append(point)
            if len(points) > 5 and np.abs(z - first).max() < 0.5 * STEP:
                return [*points, start]
        return points

    def _fold(self, z: np.ndarray, way: np.ndarray, length: float) -> np.ndarray:
        def at(part: float) -> np.ndarray:
            there = self.corrected(z + part * way, way)
            return z if there is None else there

        part = brentq(lambda s: self.tangent(at(s), way)[-1], 0.0, length, xtol=1e-14)
        return at(float(part))


def _between(one: CurvePoint, two: CurvePoint, speed: float) -> np.ndarray:
    part = (speed - one.speed) / (two.speed - one.speed)
    return one.state + part * (two.state - one.state)


def monotone(points: list[CurvePoint]) -> Iterator[list[CurvePoint]]:
    """Yield the segments of a curve between folds, each ordered by rising speed."""
    moved = [k == 0 or points[k].speed != points[k - 1].speed for k in range(len(points))]
    points = [point for point, new in zip(points, moved, strict=True) if new]
    speeds = np.array([point.speed for point in points])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(speeds)))) + 1
    ends = [0, *turns.tolist(), len(points) - 1]
    for a, b in zip(ends[:-1], ends[1:], strict=True):
        part = points[a : b + 1]
        if len(part) > 1:
            yield part if part[-1].speed > part[0].speed else part[::-1]


def state_along(system: System, part: list[CurvePoint], speed: float) -> np.ndarray:
    """Return the state of a monotone segment at a speed."""
    speeds = np.array([point.speed for point in part])
    k = int(np.clip(np.searchsorted(speeds, speed), 1, len(part) - 1))
    start = _between(part[k - 1], part[k], speed)
    state = converged(system, speed, start)
    return start if state is None else state


def lies_on(parts: list[list[CurvePoint]], system: System, point: CurvePoint) -> bool:
    """Return whether a point is on one of the known segments, up to exchanges of equal balls."""
    return any(
        same(system, point.speed, state_along(system, part, point.speed), point.state)
        for part in parts
        if part[0].speed <= point.speed <= part[-1].speed
    )
