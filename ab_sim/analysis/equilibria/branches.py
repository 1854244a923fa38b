"""Branches of resting states over speed, from closed forms, with all their folds."""

from collections.abc import Iterator
from functools import cache
from itertools import pairwise

import numpy as np

from ab_sim.analysis.equilibria.at_speed import balanced_state, clustered_places
from ab_sim.analysis.equilibria.balanced import can_balance, positions_at
from ab_sim.analysis.equilibria.finder import BEST, WORST
from ab_sim.analysis.equilibria.over_speed import (
    BranchInterval,
    OverSpeed,
    grid_between,
    interval_of,
)
from ab_sim.analysis.equilibria.patterns import Fold, Pattern, folds_of, patterns_of, radii
from ab_sim.analysis.equilibria.resting import ClosedFormRotor, resting_system, rotor_of
from ab_sim.analysis.equilibria.states import RestingState, resting_state
from ab_sim.analysis.equilibria.traced import traced_branches
from ab_sim.analysis.result_cache import Result, ResultCache
from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Progress
from ab_sim.model.dynamics.system import System
from ab_sim.scene.model import Scene

CLOSE = 1e-6
"""Fraction of a speed range, at each end, in which rounding may change the number of radii."""
_MANY = 12
"""Number of balls above which fewer speeds are used."""
_FEWER = 30
"""Number of speeds used with more than ``_MANY`` balls."""


def branches_over_speed(
    scene: Scene, speeds: np.ndarray, progress: Progress | None = None
) -> OverSpeed:
    """Follow all resting states over speed, and locate folds and stability changes.

    Parameters
    ----------
    scene
        Scene; see ``equilibria_of`` for the scenes it covers.
    speeds
        Rising speeds > 0 [rad/s] at which stability is evaluated; more are added near the ends of
        branches. Folds and changes of stability are located between them.
    progress
        Called with the current task, the number of finished parts and the total.

    Raises
    ------
    SceneError
        As ``equilibria_of``.
    InputError
        Speeds do not rise.
    """
    speeds = np.asarray(speeds, float)
    if len(speeds) < 2 or not speeds[0] > 0.0 or not (np.diff(speeds) > 0.0).all():
        raise InputError("speeds: must be at least two, above 0 and rising")
    system = resting_system(scene)
    rotor = rotor_of(system)
    if rotor is None:
        return traced_branches(system, speeds, progress)
    patterns = patterns_of(rotor)
    if len(rotor.moments) > _MANY and len(speeds) > _FEWER:
        speeds = speeds[np.linspace(0, len(speeds) - 1, _FEWER).astype(int)]
    intervals: list[BranchInterval] = []
    folds: list[tuple[str, Fold]] = []
    for k, pattern in enumerate(patterns):
        if progress is not None:
            progress(pattern.label, k, len(patterns) + 1)
        folds_here = [
            f for f in folds_of(rotor, pattern.moment) if speeds[0] < f.speed < speeds[-1]
        ]
        folds += [(pattern.label, fold) for fold in folds_here]
        intervals += _clustered(system, rotor, pattern, folds_here, speeds)
    if progress is not None:
        progress("balanced", len(patterns), len(patterns) + 1)
    intervals += _balanced(system, rotor, speeds)
    folds.sort(key=lambda labelled_fold: labelled_fold[1])
    return OverSpeed((float(speeds[0]), float(speeds[-1])), tuple(intervals), tuple(folds))


def kept_branches(scene: Scene, speeds: np.ndarray, progress: Progress | None = None) -> OverSpeed:
    """Return ``branches_over_speed``, from the disk cache if it was computed before."""

    def over_speed(scene: Scene, speeds: list[float]) -> Result:
        return branches_over_speed(scene, np.array(speeds), progress).report()

    return OverSpeed.of(ResultCache(over_speed).of(scene, speeds=np.asarray(speeds).tolist()))


def _clustered(
    system: System, rotor: ClosedFormRotor, pattern: Pattern, folds: list[Fold], speeds: np.ndarray
) -> Iterator[BranchInterval]:
    """Yield the intervals of a pattern's branches.

    Between two folds the number and the order of radii are constant. The exception is balls whose
    moment equals the unbalance: a branch then ends in the balanced set, with W = 0.

    Parameters
    ----------
    system
        Result of ``resting_system``.
    rotor
        Closed-form parameters of the system.
    pattern
        Pattern of the branches.
    folds
        Folds of the pattern within the speeds, rising.
    speeds
        Rising speeds [rad/s].
    """
    ends = [float(speeds[0]), *(fold.speed for fold in folds), float(speeds[-1])]
    inner = [end for pair in pairwise(ends) for end in _changes(rotor, pattern, *pair, speeds)]
    for low, high in pairwise(sorted({*ends, *inner})):
        count = len(radii(rotor, pattern.moment, 0.5 * (low + high)))
        grid = grid_between(low, high, speeds)
        grid = grid[[len(radii(rotor, pattern.moment, w)) == count for w in grid.tolist()]]
        for rank in range(count):

            def at(speed: float, rank: int = rank) -> RestingState:
                place = clustered_places(rotor, speed, pattern)[rank]
                return resting_state(system, speed, *place)

            yield interval_of(pattern.label + (f"/{rank + 1}" if count > 1 else ""), at, grid)


def _changes(
    rotor: ClosedFormRotor, pattern: Pattern, low: float, high: float, speeds: np.ndarray
) -> Iterator[float]:
    """Locate speeds [rad/s] between two folds at which the number of radii changes."""

    def count(speed: float) -> int:
        return len(radii(rotor, pattern.moment, speed))

    near = CLOSE * (high - low)
    inside = speeds[(speeds > low + near) & (speeds < high - near)].tolist()
    for one, two in pairwise([low + near, *inside, high - near]):
        below = count(one)
        if below == count(two):
            continue
        while two - one > 1e-12 * two:
            middle = 0.5 * (one + two)
            one, two = (middle, two) if count(middle) == below else (one, middle)
        yield two


def _balanced(
    system: System, rotor: ClosedFormRotor, speeds: np.ndarray
) -> Iterator[BranchInterval]:
    """Yield the balanced branch over speeds [rad/s], and those of the worst and best position.

    There are a worst and a best position with three or more balls; they can change with speed.
    """
    if not rotor.moments or not can_balance(rotor):
        return
    grid = grid_between(float(speeds[0]), float(speeds[-1]), speeds)

    @cache
    def states(speed: float) -> list[RestingState]:
        places = positions_at(system, rotor, speed)
        return [balanced_state(system, rotor, speed, place) for place in places]

    yield interval_of("balanced", lambda speed: states(speed)[0], grid)
    if len(states(float(grid[0]))) > 1:
        yield interval_of("balanced" + WORST, lambda w: max(states(w), key=growth), grid)
        yield interval_of("balanced" + BEST, lambda w: min(states(w), key=growth), grid)


def growth(state: RestingState) -> float:
    """Return the growth rate by which balanced positions are compared [1/s]."""
    return state.lambda_max
