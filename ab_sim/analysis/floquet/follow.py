"""Continuation of a periodic solution over a parameter, with its stability borders.

The next solution is predicted by a secant through the last two (natural continuation: a fold is not
passed). If Newton's method fails there, the search starts again from named starts and may find
another solution. No borders are reported between the two.

Each solution is cached on disk by its scene, its speed and the exact start of its search. A
repeated continuation reads the cache, and an interrupted one continues.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from ab_sim.analysis.floquet.stability import held_speed, judged
from ab_sim.analysis.floquet.turn import STARTS, TurnMap, find_orbit, within_turn
from ab_sim.analysis.held_speed import as_speed
from ab_sim.analysis.result_cache import Result, ResultCache
from ab_sim.base.errors import SceneError
from ab_sim.base.presentation import Column, Columns, Presented
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

SPEED = "speed"
"""Name of the spindle's speed among the keys of parameters."""

NEIGHBOUR = "the one before"
"""Origin of a followed solution: the previous one."""


class Solution(NamedTuple):
    """Summary of a periodic solution of a scene at a constant speed; see ``Stability``."""

    multipliers: np.ndarray
    """Multipliers by falling modulus, complex, shape (2 (K + n),)."""
    largest: float
    """Modulus of the largest multiplier without structural ones."""
    stable: bool | None
    """True if small disturbances decay; None if undecided."""
    verdict: str
    """Verdict as text: ``stable``, ``unstable`` or ``undecided``."""
    balanced: bool
    """True if the deck stays at its rest position."""
    whirl_max: float
    """Largest whirl [m]."""
    ball_angles: list[float]
    """Ball angles at the start [rad], one per ball."""
    start: list[float]
    """State at the start of the turn, one value per state."""

    @classmethod
    def of(cls, report: dict[str, Any]) -> "Solution":
        """Return the summary in a ``Stability.report``, or in a ``report`` of this class."""
        multipliers = np.array(report["multipliers"], float).reshape(-1, 2)
        rest = (report[key] for key in cls._fields[1:])
        return cls(multipliers[:, 0] + 1j * multipliers[:, 1], *rest)

    def report(self) -> dict[str, Any]:
        """Return the summary as JSON-able values."""
        multipliers = [[float(x.real), float(x.imag)] for x in self.multipliers]
        return {**self._asdict(), "multipliers": multipliers}


Secant = tuple[list[float], list[float]]
"""States of two solutions, the second being nearer to the one that is sought."""


def _solution(
    scene: Scene, speed: float, secant: Secant | None, share: float, starts: Sequence[str]
) -> tuple[Solution | None, bool]:
    """Return the result of ``solved``, from the disk cache if it was computed before.

    Returns
    -------
    tuple[Solution | None, bool]
        The solution, None if none was found; and whether a named start was used.
    """
    kept = ResultCache(solved).of(
        scene, speed=speed, secant=secant, share=share, starts=list(starts)
    )
    return (None if kept["solution"] is None else Solution.of(kept["solution"])), kept["new"]


def solved(
    scene: Scene, *, speed: float, secant: Secant | None, share: float, starts: list[str]
) -> Result:
    """Return the first periodic solution found along a secant or from named starts.

    Parameters
    ----------
    scene
        Scene; its profile is ignored.
    speed
        Spindle speed w [rad/s].
    secant
        States of two solutions, on whose line the search begins; None to use starts only.
    share
        Position on the line: 0 at the first state, 1 at the second, above 1 beyond it.
    starts
        Names in ``STARTS`` for use if the line gives no solution; empty for no further search.

    Returns
    -------
    Result
        ``solution``: report of the ``Stability``, None if none was found; ``new``: True if a named
        start was used.

    Raises
    ------
    SceneError, InputError
        See ``TurnMap``.
    """
    turn = TurnMap(scene, speed)
    if secant is not None and len(secant[1]) == len(secant[0]) == turn.layout.size:
        first, second = map(np.array, secant)
        ahead = second - first
        ahead[turn.layout.angles] = within_turn(ahead[turn.layout.angles])
        orbit = turn.shoot(first + share * ahead)
        # Without starts, a border is sought: a solution off this line may be of another branch.
        if orbit is None and starts:
            orbit = turn.shoot(second)
        stability = None if orbit is None else judged(turn, orbit, NEIGHBOUR)
        if stability is not None or not starts:
            return {"solution": None if stability is None else stability.report(), "new": False}
    orbit, name = find_orbit(turn, starts)
    stability = None if orbit is None else judged(turn, orbit, name)
    return {"solution": None if stability is None else stability.report(), "new": True}


_DIGITS = 1e-10
"""Tolerance of a border's value, relative to the larger of its two neighbours."""

Case = Callable[[float], tuple[Scene, float]]
"""Function that returns the scene and its spindle speed [rad/s] for a value of a parameter."""


def case_of(
    scene: Scene, key: str, values: Sequence[float], speed: float | None, option: str
) -> Case:
    """Return the function that applies values of a parameter to a scene.

    Parameters
    ----------
    scene
        Scene to be changed.
    key
        Dotted key of the scene, or ``SPEED``.
    values
        All values, SI, at least one. If all are whole, whole values are passed to the scene as
        integers, which counts need.
    speed
        Spindle speed [rad/s] for keys other than ``SPEED``; default: ``held_speed``.
    option
        Text before the value in the name of a changed scene and in messages.

    Raises
    ------
    SceneError
        The scene with the first or the last value is invalid.
    InputError
        The first or the last value is not a speed that can be held.
    """
    if key == SPEED:
        as_speed(values[0], scene), as_speed(values[-1], scene)
        return lambda value: (scene, as_speed(value, scene))
    at = held_speed(scene) if speed is None else speed
    whole = all(float(value).is_integer() for value in values)

    def case(value: float) -> tuple[Scene, float]:
        number = int(value) if whole and value.is_integer() else value
        return changed_scene(scene, {key: number}, f"{option}{number:g}"), at

    case(float(values[0])), case(float(values[-1]))
    return case


class FollowedPoint(NamedTuple):
    """Result at one value of the parameter."""

    value: float
    """Value of the parameter, SI."""
    speed: float
    """Spindle speed [rad/s]."""
    solution: Solution | None
    """Periodic solution; None if none was found."""
    new: bool
    """True if the solution is from a new search, not continued from the previous point."""

    def report(self) -> dict[str, Any]:
        """Return the point as JSON-able values; with a solution, those of its summary as well."""
        return {
            "value": self.value,
            "speed": self.speed,
            "found": self.solution is not None,
            "new": self.new,
            **({} if self.solution is None else self.solution.report()),
        }


class Border(NamedTuple):
    """Parameter value at which the largest modulus of a multiplier is 1."""

    value: float
    """Value of the parameter, SI."""
    speed: float
    """Spindle speed [rad/s]."""
    multiplier: complex
    """Multiplier that crosses the unit circle; one of two conjugates."""
    stable_below: bool
    """True if the solution is stable at smaller values."""

    def report(self) -> dict[str, Any]:
        """Return the border as JSON-able values."""
        return {
            "value": self.value,
            "speed": self.speed,
            "multiplier": [self.multiplier.real, abs(self.multiplier.imag)],
            "stable_below": self.stable_below,
        }


@dataclass(frozen=True, repr=False)
class Followed(Presented):
    """Periodic solutions over a parameter; see ``ab_sim.follow_floquet``."""

    _picture = "followed"

    key: str
    """Dotted key of the parameter, or ``SPEED``."""
    points: tuple[FollowedPoint, ...]
    """Results in the order of the values."""
    borders: tuple[Border, ...]
    """Stability borders in the order in which they were located."""
    scene: str
    """Name of the scene."""

    def _facts(self) -> dict[str, str]:
        values = [point.value for point in self.points]
        borders = ", ".join(f"{border.value:.6g}" for border in self.borders)
        return {
            "scene": self.scene,
            "over": f"{self.key}, {len(values)} values",
            "from": f"{values[0]:.4g} to {values[-1]:.4g}",
            "borders": borders or "none",
        }

    def _columns(self) -> Columns:
        solutions = [point.solution for point in self.points]
        return {
            self.key: Column(
                "rad/s" if self.key == SPEED else None, [point.value for point in self.points]
            ),
            "held_speed": Column("rad/s", [point.speed for point in self.points]),
            "largest": Column("1", [None if s is None else s.largest for s in solutions]),
            "verdict": Column(None, [None if s is None else s.verdict for s in solutions]),
            "whirl_max": Column("m", [None if s is None else s.whirl_max for s in solutions]),
            "new": Column(None, [point.new for point in self.points]),
        }

    @property
    def unlocated(self) -> list[tuple[FollowedPoint, FollowedPoint]]:
        """Successive points with different verdicts and no border between them."""
        judged_points = [
            (point, point.solution.verdict) for point in self.points if point.solution is not None
        ]
        return [
            (one, other)
            for (one, before), (other, after) in pairwise(judged_points)
            if before != after
            and not any(
                min(one.value, other.value) <= border.value <= max(one.value, other.value)
                for border in self.borders
            )
        ]

    def report(self) -> dict[str, object]:
        """Return the solutions and borders as JSON-able values."""
        return {
            "key": self.key,
            "points": [point.report() for point in self.points],
            "borders": [border.report() for border in self.borders],
            "unlocated": [[one.value, other.value] for one, other in self.unlocated],
        }


def follow(
    key: str,
    case: Case,
    values: Sequence[float],
    starts: Sequence[str] = tuple(STARTS),
    progress: Callable[[int], None] = lambda done: None,
) -> Followed:
    """Compute periodic solutions over a parameter, and the stability borders between its values.

    Each solution is cached on disk, so that a repeated or interrupted call continues.

    Parameters
    ----------
    key
        Dotted key of the parameter, or ``SPEED``.
    case
        Function that applies a value of the parameter; see ``case_of``.
    values
        Values in the order of the continuation, at least one.
    starts
        Names in ``STARTS`` from which a search begins, in order.
    progress
        Called with the number of finished values.

    Raises
    ------
    SceneError, InputError
        A value gives no valid scene, or one without a turn map.
    """
    points: list[FollowedPoint] = []
    borders: list[Border] = []
    for done, value in enumerate(map(float, values), start=1):
        scene, speed = case(value)
        points.append(
            FollowedPoint(value, speed, *_solution(scene, speed, *_search(points, value), starts))
        )
        if len(points) > 1 and not points[-1].new:
            borders += _border(case, *points[-2:])
        progress(done)
    return Followed(key, tuple(points), tuple(borders), scene.name)


def _search(points: Sequence[FollowedPoint], value: float) -> tuple[Secant | None, float]:
    """Return the secant through the last two solutions, and a value's position on the secant.

    Parameters
    ----------
    points
        Points so far.
    value
        Value of the parameter of the next point.

    Returns
    -------
    tuple[Secant | None, float]
        The secant, None if the last point has no solution; and the share, see ``solved``.
    """
    if not points or (last := points[-1]).solution is None:
        return None, 1.0
    # After a new search the previous point may be on another branch: start at the last one alone.
    before = points[-2] if len(points) > 1 and not last.new else last
    assert before.solution is not None
    share = 1.0
    if last.value != before.value:
        share = (value - before.value) / (last.value - before.value)
    return (before.solution.start, last.solution.start), share


def _border(case: Case, one: FollowedPoint, other: FollowedPoint) -> list[Border]:
    """Return the border between two successive points as a list; it is empty without a border."""
    first, last = one.solution, other.solution
    if first is None or last is None or first.stable is last.stable or None in (
        first.stable, last.stable
    ):  # fmt: skip
        return []

    def solve(value: float) -> tuple[float, Solution]:
        scene, speed = case(value)
        share = (value - one.value) / (other.value - one.value)
        between, _ = _solution(scene, speed, (first.start, last.start), share, ())
        if between is None:
            raise _Lost
        return speed, between

    size = max(abs(one.value), abs(other.value))
    try:
        value = float(
            brentq(lambda v: solve(v)[1].largest - 1.0, one.value, other.value, xtol=_DIGITS * size)
        )
        speed, crossing = solve(value)
    except (_Lost, SceneError):
        # A parameter that takes only whole numbers has no border between two of them.
        return []
    nearest = np.argmin(np.abs(np.abs(crossing.multipliers) - crossing.largest))
    below = first if one.value < other.value else last
    return [Border(value, speed, complex(crossing.multipliers[nearest]), bool(below.stable))]


class _Lost(Exception):
    """Error: the solution was not found between two values at which it exists."""
