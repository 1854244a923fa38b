"""Continuation of a periodic solution over a parameter, with its stability borders.

The next solution is predicted by a secant through the last two. If Newton's method fails there, the
search starts again and may find another solution. No borders are reported between the two.

Each solution is cached on disk by its scene, its speed and the exact start of its search. A
repeated continuation reads the cache, and an interrupted one continues.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from ab_sim.analysis.floquet.stability import judged
from ab_sim.analysis.floquet.turn import STARTS, TurnMap, find_orbit, within_turn
from ab_sim.analysis.result_cache import Result, ResultCache
from ab_sim.base.errors import SceneError
from ab_sim.base.presentation import Column, Columns, Presented
from ab_sim.scene.model import Scene

NEIGHBOUR = "the one before"
"""Origin of a followed solution: the previous one."""


class Solution(NamedTuple):
    """Summary of a periodic solution of a scene at a constant speed; see ``Stability``."""

    multipliers: np.ndarray
    largest: float
    stable: bool | None
    verdict: str
    balanced: bool
    whirl_max: float
    """Largest whirl [m]."""
    ball_angles: list[float]
    """Ball angles [rad]."""
    start: list[float]
    """State at the start of the turn."""

    @classmethod
    def of(cls, report: dict[str, Any]) -> "Solution":
        """Return the summary of a ``Stability.report``."""
        multipliers = np.array(report["multipliers"], float).reshape(-1, 2)
        rest = (report[key] for key in cls._fields[1:])
        return cls(multipliers[:, 0] + 1j * multipliers[:, 1], *rest)

    def report(self) -> dict[str, Any]:
        """Return the summary as JSON-able values."""
        multipliers = [[float(x.real), float(x.imag)] for x in self.multipliers]
        return {**self._asdict(), "multipliers": multipliers}


Way = tuple[list[float], list[float]]
"""States of two solutions, the second being nearer to the one that is sought."""


def _solution(
    scene: Scene, speed: float, way: Way | None, share: float, starts: Sequence[str]
) -> tuple[Solution | None, bool]:
    """Return ``solved``, from the disk cache if it was computed before."""
    kept = ResultCache(solved).of(scene, speed=speed, way=way, share=share, starts=list(starts))
    return (None if kept["found"] is None else Solution.of(kept["found"])), kept["new"]


def solved(
    scene: Scene, *, speed: float, way: Way | None, share: float, starts: list[str]
) -> Result:
    """Return the first solution found, and whether it was found from a named start.

    Args:
        scene: scene; its profile is ignored.
        speed: spindle speed w [rad/s].
        way: states of two solutions, on whose line the search begins; None to use starts only.
        share: position along the line; above 1 it is beyond the second state.
        starts: names in ``STARTS`` for use if the line gives no solution; empty for no further
            search.

    Raises:
        SceneError, InputError: see ``TurnMap``.
    """
    turn = TurnMap(scene, speed)
    if way is not None and len(way[1]) == len(way[0]) == turn.layout.size:
        one, other = map(np.array, way)
        ahead = other - one
        ahead[turn.layout.angles] = within_turn(ahead[turn.layout.angles])
        orbit = turn.shoot(one + share * ahead)
        if orbit is None and starts:
            orbit = turn.shoot(other)
        stability = None if orbit is None else judged(turn, orbit, NEIGHBOUR)
        if stability is not None or not starts:
            return {"found": None if stability is None else stability.report(), "new": False}
    orbit, name = find_orbit(turn, starts)
    stability = None if orbit is None else judged(turn, orbit, name)
    return {"found": None if stability is None else stability.report(), "new": True}


DIGITS = 1e-10
"""Relative tolerance of a border's value."""

Case = Callable[[float], tuple[Scene, float]]
"""Function that returns the scene and its spindle speed [rad/s] for a value of a parameter."""


class FollowedPoint(NamedTuple):
    """Result at one value of the parameter."""

    value: float
    speed: float
    """Spindle speed [rad/s]."""
    found: Solution | None
    """Periodic solution; None if none was found."""
    new: bool
    """True if the solution is from a new search, not continued from the previous point."""

    def report(self) -> dict[str, Any]:
        """Return the point as JSON-able values."""
        stability = self.found
        report: dict[str, Any] = {
            "value": self.value, "speed": self.speed,
            "found": stability is not None, "new": self.new,
        }  # fmt: skip
        if stability is not None:
            report |= stability.report()
        return report


class Border(NamedTuple):
    """Parameter value at which the largest modulus of a multiplier is 1."""

    value: float
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

    over: str
    points: tuple[FollowedPoint, ...]
    borders: tuple[Border, ...]
    scene: str
    """Name of the scene."""

    def _facts(self) -> dict[str, str]:
        values = [point.value for point in self.points]
        borders = ", ".join(f"{border.value:.6g}" for border in self.borders)
        return {
            "scene": self.scene,
            "over": f"{self.over}, {len(values)} values",
            "from": f"{values[0]:.4g} to {values[-1]:.4g}",
            "borders": borders or "none",
        }

    def _columns(self) -> Columns:
        stabilities = [point.found for point in self.points]
        return {
            self.over: Column(
                "rad/s" if self.over == "speed" else None, [point.value for point in self.points]
            ),
            "held_speed": Column("rad/s", [point.speed for point in self.points]),
            "largest": Column("1", [None if one is None else one.largest for one in stabilities]),
            "verdict": Column(None, [None if one is None else one.verdict for one in stabilities]),
            "whirl_max": Column(
                "m", [None if one is None else one.whirl_max for one in stabilities]
            ),
            "new": Column(None, [point.new for point in self.points]),
        }

    @property
    def unlocated(self) -> list[tuple[FollowedPoint, FollowedPoint]]:
        """Successive points with different verdicts and no border between them."""
        judged_points = [
            (point, point.found.verdict) for point in self.points if point.found is not None
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
            "over": self.over,
            "points": [point.report() for point in self.points],
            "borders": [border.report() for border in self.borders],
            "unlocated": [[one.value, other.value] for one, other in self.unlocated],
        }


def follow(
    over: str,
    case: Case,
    values: Sequence[float],
    starts: Sequence[str] = tuple(STARTS),
    progress: Callable[[int], None] = lambda done: None,
) -> Followed:
    """Compute periodic solutions over a parameter, and the stability borders between its values.

    Each solution is cached on disk, so that a repeated or interrupted call continues.

    Args:
        over: name of the parameter.
        case: function that applies the parameter.
        values: values in the order of the continuation.
        starts: names in ``STARTS`` from which a search begins, in order.
        progress: called with the number of finished values.

    Raises:
        SceneError, InputError: a value gives no valid scene, or one without a turn map.
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
    return Followed(over, tuple(points), tuple(borders), scene.name)


def _search(points: Sequence[FollowedPoint], value: float) -> tuple[Way | None, float]:
    """Return the line through previous solutions and the position on it; None without one."""
    if not points or (last := points[-1]).found is None:
        return None, 1.0
    before = points[-2] if len(points) > 1 and not last.new else last
    assert before.found is not None
    share = 1.0
    if last.value != before.value:
        share = (value - before.value) / (last.value - before.value)
    return (before.found.start, last.found.start), share


def _border(case: Case, one: FollowedPoint, other: FollowedPoint) -> list[Border]:
    """Locate the border between two followed points; an empty list if there is none."""
    first, last = one.found, other.found
    if first is None or last is None or first.stable is last.stable or None in (
        first.stable, last.stable
    ):  # fmt: skip
        return []

    def at(value: float) -> tuple[float, Solution]:
        scene, speed = case(value)
        share = (value - one.value) / (other.value - one.value)
        solution_here, _ = _solution(scene, speed, (first.start, last.start), share, ())
        if solution_here is None:
            raise _Lost
        return speed, solution_here

    size = max(abs(one.value), abs(other.value))
    try:
        value = float(
            brentq(lambda v: at(v)[1].largest - 1.0, one.value, other.value, xtol=DIGITS * size)
        )
        speed, crossing = at(value)
    except (_Lost, SceneError):
        # A parameter that takes only whole numbers has no border between two of them.
        return []
    nearest = np.argmin(np.abs(np.abs(crossing.multipliers) - crossing.largest))
    below = first if one.value < other.value else last
    return [Border(value, speed, complex(crossing.multipliers[nearest]), bool(below.stable))]


class _Lost(Exception):
    """Error: the solution was not found between two values at which it exists."""
