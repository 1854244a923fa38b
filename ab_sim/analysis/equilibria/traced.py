"""Resting states over speed without a closed form, by pseudo-arclength continuation.

States are found at seed speeds, then continued around folds. A curve in state and speed is followed
by its arc length, so that the continuation passes folds. At a fold the speed component of the
tangent changes sign; its root is located on the curve. Keller (1977); Allgower and Georg, Numerical
Continuation Methods (1990), ch. 6.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ab_sim.analysis.equilibria.finder import (
    BEST,
    WORST,
    Scales,
    converged,
    found_states,
    labelled,
    nullity,
    same,
    scaled_jacobian,
    scales_of,
)
from ab_sim.analysis.equilibria.over_speed import BranchInterval, OverSpeed, interval_of
from ab_sim.analysis.equilibria.patterns import Fold
from ab_sim.analysis.equilibria.resting import constant, field_at, state_of
from ab_sim.analysis.equilibria.states import RestingState
from ab_sim.base.presentation import Progress
from ab_sim.model.dynamics.system import System

STEP = 0.05
"""Largest step of the arc length, in scaled states and speeds; halved if the corrector fails."""
MOST_POINTS = 4000
"""Largest number of points of a curve."""


class CurvePoint(NamedTuple):
    """Point on a curve of resting states."""

    speed: float
    """Spindle speed [rad/s]."""
    state: np.ndarray
    """State of the system, shape (states,)."""
    fold: bool = False
    """True at a fold, where the speed reverses along the curve."""


class EquilibriumCurve:
    """Resting states of a system, as a curve in z = (state / scale, speed / fastest).

    Parameters
    ----------
    system
        Result of ``resting_system``.
    fastest
        Speed that scales the speeds [rad/s].
    """

    def __init__(self, system: System, fastest: float) -> None:
        self.system, self.fastest = system, fastest
        self.scales: Scales = scales_of(system, fastest)
        self._field = field_at(system, fastest)

    def z(self, point: CurvePoint) -> np.ndarray:
        """Return the scaled coordinates of a point, shape (states + 1,)."""
        return np.append(point.state / self.scales.state, point.speed / self.fastest)

    def point(self, z: np.ndarray) -> CurvePoint:
        """Return the point with scaled coordinates ``z``."""
        return CurvePoint(float(z[-1]) * self.fastest, z[:-1] * self.scales.state)

    def residual(self, z: np.ndarray) -> np.ndarray:
        """Return the scaled rates of change at z, which are 0 on the curve; shape (states,)."""
        speed, state, _ = self.point(z)
        slope = self._field.at(constant(speed)).slope(0.0, state)
        return slope / (self.scales.state * self.scales.rate)

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        """Return the derivatives of the residual by z, shape (states, states + 1).

        The derivative by the speed is a central difference, because the kernel's Jacobian covers
        states only.
        """
        speed, state, _ = self.point(z)
        field = self._field.at(constant(speed))
        jacobian = scaled_jacobian(field.jacobian(0.0, state), self.scales)
        h = np.zeros(len(z))
        h[-1] = 1e-5 * abs(z[-1]) + 1e-9
        along = (self.residual(z + h) - self.residual(z - h)) / (2.0 * h[-1])
        return np.column_stack([jacobian, along])

    def tangent(self, z: np.ndarray, like: np.ndarray) -> np.ndarray:
        """Return the curve's unit tangent at z, with the orientation of ``like``."""
        # The tangent spans the null space of the derivatives.
        way: np.ndarray = np.linalg.svd(self.jacobian(z))[2][-1]
        return way if way @ like >= 0.0 else -way

    def corrected(self, start: np.ndarray, way: np.ndarray) -> np.ndarray | None:
        """Return the curve's point in the plane normal to ``way`` through ``start``, or None.

        The corrector is Newton's method, extended by the equation of the plane. None if it does not
        converge.
        """
        z = start
        for _ in range(12):
            matrix = np.vstack([self.jacobian(z), way])
            step = np.linalg.lstsq(matrix, np.append(self.residual(z), way @ (z - start)))[0]
            z = z - step
            if not np.isfinite(z).all():
                return None
            if np.abs(step).max() <= 1e-12 * (1.0 + np.abs(z).max()):
                return z
        return None

    def traced(self, start: CurvePoint, sense: float, low: float, high: float) -> list[CurvePoint]:
        """Follow the curve from a point, within a range of speeds.

        The curve ends where it leaves the range, closes, or cannot be continued.

        Parameters
        ----------
        start
            Point on the curve.
        sense
            1 if the first step raises the speed, -1 if it lowers it.
        low, high
            Range of speeds [rad/s].

        Returns
        -------
        list[CurvePoint]
            Points in the order of the curve, with its folds and the start. A closed curve ends with
            ``start`` itself.
        """
        z = self.z(start)
        first, length = z, STEP
        way = self.tangent(z, np.append(np.zeros(len(z) - 1), sense))
        points = [start]
        while len(points) < MOST_POINTS and length > 1e-9:
            corrected = self.corrected(z + length * way, way)
            after = None if corrected is None else self.tangent(corrected, way)
            # Reject the step if the corrector fails or the tangent turns by more than 18 degrees:
            # the curve may have jumped to another branch.
            if corrected is None or after is None or after @ way < 0.95:
                length *= 0.5
                continue
            # The speed component of the tangent changed its sign: a fold lies within this step.
            if after[-1] * way[-1] < 0.0:
                points.append(self.point(self._fold(z, way, length))._replace(fold=True))
            z, way, length = corrected, after, min(1.4 * length, STEP)
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
        """Return the fold within a step of ``length`` from z along the tangent ``way``."""

        def at(distance: float) -> np.ndarray:
            corrected = self.corrected(z + distance * way, way)
            return z if corrected is None else corrected

        distance = brentq(lambda s: self.tangent(at(s), way)[-1], 0.0, length, xtol=1e-14)
        return at(float(distance))


def _between(one: CurvePoint, two: CurvePoint, speed: float) -> np.ndarray:
    """Return the state at a speed [rad/s] by linear interpolation between two points."""
    part = (speed - one.speed) / (two.speed - one.speed)
    return one.state + part * (two.state - one.state)


def _monotone(points: list[CurvePoint]) -> Iterator[list[CurvePoint]]:
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


def _state_along(system: System, part: list[CurvePoint], speed: float) -> np.ndarray:
    """Return the resting state of a monotone segment at a speed [rad/s], shape (states,).

    Newton's method starts from the interpolated state, which is returned if it fails.
    """
    speeds = np.array([point.speed for point in part])
    k = int(np.clip(np.searchsorted(speeds, speed), 1, len(part) - 1))
    start = _between(part[k - 1], part[k], speed)
    state = converged(system, speed, start)
    return start if state is None else state


def _lies_on(parts: list[list[CurvePoint]], system: System, point: CurvePoint) -> bool:
    """Return whether a point is on one of the known segments, up to exchanges of equal balls."""
    return any(
        same(system, point.speed, _state_along(system, part, point.speed), point.state)
        for part in parts
        if part[0].speed <= point.speed <= part[-1].speed
    )


_SEEDS = 9
"""Number of seed speeds of the search; branches that lie between two seeds are missed."""
_MOST_SPEEDS = 60
"""Largest number of a curve's points at which stability is evaluated."""
Part = list[CurvePoint]
"""Part of a curve: successive points."""


def traced_branches(
    system: System, speeds: np.ndarray, progress: Progress | None = None
) -> OverSpeed:
    """Return ``branches_over_speed`` for effects without a closed form.

    Parameters
    ----------
    system
        Result of ``resting_system``.
    speeds
        Rising speeds > 0 [rad/s], see ``branches_over_speed``.
    progress
        Called with the current task, the number of finished seeds and their number.
    """
    low, high = float(speeds[0]), float(speeds[-1])
    seeds = np.unique(np.concatenate([[high], np.geomspace(max(low, high / 30.0), high, _SEEDS)]))
    parts: list[Part] = []
    folds: list[tuple[str, Fold]] = []
    continua: list[tuple[str, Part]] = []
    for k, speed in enumerate(seeds[::-1].tolist()):
        if progress is not None:
            progress(f"from {speed:.4g} rad/s", k, len(seeds))
        for state in found_states(system, speed):
            # Follow a single position of a continuum: the worst and best change with speed.
            if state.label.endswith((WORST, BEST)) or (
                state.structural_zeros and _covered(continua, state.label, speed)
            ):
                continue
            start = CurvePoint(speed, state_of(system, speed, state.u, state.theta))
            if _lies_on(parts, system, start):
                continue
            whole = list(_followed(system, start, bool(state.structural_zeros), low, high))
            if state.structural_zeros:
                continua += [(state.label, part) for part in whole]
            for points in whole:
                traced_parts = list(_monotone(points))
                fresh = [
                    _fresh(system, part, [*parts, *traced_parts[:i]])
                    for i, part in enumerate(traced_parts)
                ]
                folds += _folds(system, traced_parts, fresh, low, high)
                parts += [part for part, new in zip(traced_parts, fresh, strict=True) if new]
    intervals = [_interval(system, part, speeds) for part in parts]
    folds.sort(key=lambda labelled_fold: labelled_fold[1])
    return OverSpeed((low, high), tuple(intervals), tuple(folds))


def _covered(continua: list[tuple[str, Part]], label: str, speed: float) -> bool:
    """Return whether a followed continuum with this label covers a speed [rad/s]."""
    return any(
        name == label and part[0].speed <= speed <= part[-1].speed for name, part in continua
    )


def _fresh(system: System, part: Part, parts: list[Part]) -> bool:
    """Return whether the middle of a segment lies on none of ``parts``; see ``_lies_on``."""
    speed = 0.5 * (part[0].speed + part[-1].speed)
    return not _lies_on(parts, system, CurvePoint(speed, _state_along(system, part, speed)))


def _followed(
    system: System, start: CurvePoint, continuum: bool, low: float, high: float
) -> Iterator[Part]:
    """Yield the branch of equilibria through a point, as a sequence of points.

    A continuum has no unique curve. Its branch is a sequence of states, each nearest to the
    previous one.
    """
    if continuum:
        yield _natural(system, start, low, high)
        return
    curve = EquilibriumCurve(system, high)
    up = curve.traced(start, 1.0, low, high)
    closed = len(up) > 5 and up[-1] is start
    down = [] if closed else curve.traced(start, -1.0, low, high)
    yield [*down[:0:-1], *up]


def _natural(system: System, start: CurvePoint, low: float, high: float) -> Part:
    """Continue a continuum by speed from a point to ``low`` and ``high`` [rad/s].

    It ends where no state is found, or where the dimension of the continuum changes.
    """
    lost, sides = nullity(system, start.speed, start.state), []
    for end in (low, high):
        side = [start]
        for speed in np.linspace(start.speed, end, 60)[1:].tolist():
            state = converged(system, speed, side[-1].state)
            if state is None or nullity(system, speed, state) != lost:
                break
            side.append(CurvePoint(speed, state))
        sides.append(side)
    return [*sides[0][:0:-1], *sides[1]]


def _at(system: System, part: Part, speed: float) -> RestingState:
    """Return the labelled state of a segment at a speed [rad/s]."""
    return labelled(system, speed, [_state_along(system, part, speed)])[0]


def _interval(system: System, part: Part, speeds: np.ndarray) -> BranchInterval:
    """Return the branch along a segment, with stability at its points and at ``speeds``."""
    kept = np.linspace(0, len(part) - 1, min(len(part), _MOST_SPEEDS)).astype(int)
    part_speeds = np.array([part[k].speed for k in kept])
    inside = speeds[(speeds > part_speeds[0]) & (speeds < part_speeds[-1])]
    middle = _at(system, part, float(0.5 * (part_speeds[0] + part_speeds[-1])))
    return interval_of(
        middle.label, lambda speed: _at(system, part, speed), np.union1d(part_speeds, inside)
    )


def _folds(
    system: System, parts: list[Part], fresh: list[bool], low: float, high: float
) -> Iterator[tuple[str, Fold]]:
    """Yield folds: points where two segments of a curve meet.

    Two segments that are mirror images do not form a fold: their common point is where a branch
    with coincident balls splits.
    """
    for k, (one, two) in enumerate(pairwise(parts)):
        if not (fresh[k] and fresh[k + 1]):
            continue
        for kind, end in (("vanish", -1), ("appear", 0)):
            if one[end].fold and one[end] is two[end] and low < one[end].speed < high:
                middle = _at(system, one, 0.5 * (one[0].speed + one[-1].speed))
                W = float(np.hypot(*one[end].state[:2]))
                yield middle.label, Fold(one[end].speed, W, kind)
