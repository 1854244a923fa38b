"""A periodic solution followed over speed or another parameter, and where it loses stability.

From one value to the next by secants: a solution is looked for where the last two point to. Where
it is not found there, the search begins anew, and what is found then may be another solution:
nothing is said about borders between the two.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from ab_sim.analysis.floquet.stability import Stability, judged
from ab_sim.analysis.floquet.starts import STARTS, find_orbit
from ab_sim.analysis.floquet.turn import Orbit, TurnMap, within_turn
from ab_sim.errors import SceneError
from ab_sim.scene.model import Scene

NEIGHBOUR = "the one before"
"""What a followed solution was found from."""
DIGITS = 1e-10
"""Share of a border's value that it is located to."""

Case = Callable[[float], tuple[Scene, float]]
"""The scene and its spindle speed [rad/s] for a value of a parameter."""


class Point(NamedTuple):
    """What was found at a value of the parameter."""

    value: float
    speed: float
    """[rad/s]."""
    found: Stability | None
    """None where no periodic solution was found."""
    new: bool
    """Not followed from the point before: the search began anew."""

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        found = self.found
        report: dict[str, Any] = {
            "value": self.value, "speed": self.speed, "found": found is not None, "new": self.new
        }  # fmt: skip
        if found is not None:
            own = found.report()
            keys = ("multipliers", "largest", "stable", "balanced", "whirl_max", "ball_angles")
            report |= {key: own[key] for key in keys}
        return report


class Border(NamedTuple):
    """Where the largest modulus is 1."""

    value: float
    speed: float
    """[rad/s]."""
    multiplier: complex
    """That crosses the unit circle there, one of two conjugates."""
    stable_below: bool
    """Whether it is at smaller values that the solution is stable."""

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        return {
            "value": self.value,
            "speed": self.speed,
            "multiplier": [self.multiplier.real, abs(self.multiplier.imag)],
            "stable_below": self.stable_below,
        }


@dataclass(frozen=True)
class Followed:
    """A solution over a parameter."""

    over: str
    points: tuple[Point, ...]
    borders: tuple[Border, ...]

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        return {
            "over": self.over,
            "points": [point.report() for point in self.points],
            "borders": [border.report() for border in self.borders],
        }


def follow(
    over: str,
    case: Case,
    values: Sequence[float],
    starts: Sequence[str] = tuple(STARTS),
    progress: Callable[[int], None] = lambda done: None,
) -> Followed:
    """Periodic solutions over a parameter, and the borders of stability between its values.

    Args:
        over: what the parameter is called.
        case: what it means.
        values: in the order in which they are followed.
        starts: those of ``STARTS`` that a search begins from, one after the other.
        progress: called with the number of values done.

    Raises:
        SceneError, InputError: a value makes no scene, or one without a turn map.
    """
    points: list[Point] = []
    borders: list[Border] = []
    for done, value in enumerate(map(float, values), start=1):
        scene, speed = case(value)
        turn = TurnMap(scene, speed)
        found, new = _next(turn, points, value), False
        if found is None:
            orbit, name = find_orbit(turn, starts)
            found, new = None if orbit is None else judged(turn, orbit, name), True
        points.append(Point(value, speed, found, new))
        if len(points) > 1 and not new:
            borders += _border(case, *points[-2:])
        progress(done)
    return Followed(over, tuple(points), tuple(borders))


def _next(turn: TurnMap, points: Sequence[Point], value: float) -> Stability | None:
    """The solution at a value that those before point to; None where there is none."""
    if not points or points[-1].found is None:
        return None
    last, guess = points[-1].found.orbit, points[-1].found.orbit.start
    if guess.shape != (turn.layout.size,):
        return None
    if not points[-1].new and len(points) > 1 and points[-1].value != points[-2].value:
        before = points[-2].found
        assert before is not None
        way = _way(turn, before.orbit, last) / (points[-1].value - points[-2].value)
        guess = guess + (value - points[-1].value) * way
    orbit = turn.shoot(guess) or turn.shoot(last.start)
    return None if orbit is None else judged(turn, orbit, NEIGHBOUR)


def _way(turn: TurnMap, one: Orbit, other: Orbit) -> np.ndarray:
    way = other.start - one.start
    way[turn.layout.angles] = within_turn(way[turn.layout.angles])
    return way


def _border(case: Case, one: Point, other: Point) -> list[Border]:
    """Where between two points of a followed solution the largest modulus is 1; or nothing."""
    first, last = one.found, other.found
    if first is None or last is None or first.stable is last.stable or None in (
        first.stable, last.stable
    ):  # fmt: skip
        return []

    def at(value: float) -> Stability:
        scene, speed = case(value)
        turn, share = TurnMap(scene, speed), (value - one.value) / (other.value - one.value)
        guess = first.orbit.start + share * _way(turn, first.orbit, last.orbit)
        orbit = turn.shoot(guess)
        found = None if orbit is None else judged(turn, orbit, NEIGHBOUR)
        if found is None:
            raise _Lost
        return found

    size = max(abs(one.value), abs(other.value))
    try:
        value = float(
            brentq(lambda v: at(v).largest - 1.0, one.value, other.value, xtol=DIGITS * size)
        )
        crossing = at(value)
    except (_Lost, SceneError):
        # A parameter of whole numbers has nothing in between.
        return []
    nearest = np.argmin(np.abs(np.abs(crossing.multipliers) - crossing.largest))
    below = first if one.value < other.value else last
    return [
        Border(value, crossing.speed, complex(crossing.multipliers[nearest]), bool(below.stable))
    ]


class _Lost(Exception):
    """The solution is not there between two values where it is."""
