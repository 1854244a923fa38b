"""Numerical branches over speed: found at seed speeds, then continued around folds."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from ab_sim.analysis.equilibria.continuation import (
    CurvePoint,
    EquilibriumCurve,
    lies_on,
    monotone,
    state_along,
)
from ab_sim.analysis.equilibria.finder import (
    BEST,
    WORST,
    converged,
    found_states,
    labelled,
    nullity,
)
from ab_sim.analysis.equilibria.folds import Fold
from ab_sim.analysis.equilibria.over_speed import BranchInterval, OverSpeed, interval_of
from ab_sim.analysis.equilibria.resting import state_of
from ab_sim.analysis.equilibria.states import RestingState
from ab_sim.base.presentation import Progress
from ab_sim.model.dynamics.system import System

SEEDS = 9
"""Number of seed speeds of the search; branches that lie between two seeds are missed."""
MOST_SPEEDS = 60
"""Largest number of a curve's points at which stability is evaluated."""
Part = list[CurvePoint]


def traced_branches(
    system: System, speeds: np.ndarray, progress: Progress | None = None
) -> OverSpeed:
    """Return ``branches_over_speed`` for effects without a closed form."""
    low, high = float(speeds[0]), float(speeds[-1])
    seeds = np.unique(np.concatenate([[high], np.geomspace(max(low, high / 30.0), high, SEEDS)]))
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
            if lies_on(parts, system, start):
                continue
            whole = list(_followed(system, start, bool(state.structural_zeros), low, high))
            if state.structural_zeros:
                continua += [(state.label, part) for part in whole]
            for points in whole:
                traced_parts = list(monotone(points))
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
    """Return whether a continuum with this label has already been followed at a speed."""
    return any(
        name == label and part[0].speed <= speed <= part[-1].speed for name, part in continua
    )


def _fresh(system: System, part: Part, parts: list[Part]) -> bool:
    """Return whether a segment is new, up to exchanges of equal balls."""
    speed = 0.5 * (part[0].speed + part[-1].speed)
    return not lies_on(parts, system, CurvePoint(speed, state_along(system, part, speed)))


def _followed(
    system: System, start: CurvePoint, continuum: bool, low: float, high: float
) -> Iterator[Part]:
    """Yield the branch of equilibria through a point, as a sequence of points.

    In a continuum of equilibria, the branch is a sequence of neighbouring states.
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
    """Continue by speed from a point, as long as the continuum keeps its dimension."""
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
    return labelled(system, speed, [state_along(system, part, speed)])[0]


def _interval(system: System, part: Part, speeds: np.ndarray) -> BranchInterval:
    kept = np.linspace(0, len(part) - 1, min(len(part), MOST_SPEEDS)).astype(int)
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
