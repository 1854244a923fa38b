"""Followed periodic solution: its summary, and a state from which to continue.

Each solution is cached on disk (``analysis.results``) by its scene, its speed and the exact start
of its search. A repeated continuation reads the cache, and an interrupted one continues.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.floquet.stability import judged
from ab_sim.analysis.floquet.starts import find_orbit
from ab_sim.analysis.floquet.turn import TurnMap, within_turn
from ab_sim.analysis.results import Result, Results
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


class SolutionSearch(NamedTuple):
    """Search of a solution: on the line through two states, then from named starts."""

    way: tuple[list[float], list[float]] | None
    """States of two solutions, the second being nearer; None to use starts only."""
    share: float
    """Position along the line; above 1 it is beyond the second state."""
    starts: Sequence[str]
    """Names in ``STARTS`` for use if the line gives no solution; empty for no further search."""


def solution(scene: Scene, speed: float, search: SolutionSearch) -> tuple[Solution | None, bool]:
    """Return the first solution found, and whether it was found from a named start.

    Raises:
        SceneError, InputError: see ``TurnMap``.
    """
    kept = Results(solved).of(
        scene, speed=speed, way=search.way, share=search.share, starts=list(search.starts)
    )
    return (None if kept["found"] is None else Solution.of(kept["found"])), kept["new"]


def solved(
    scene: Scene,
    *,
    speed: float,
    way: tuple[list[float], list[float]] | None,
    share: float,
    starts: list[str],
) -> Result:
    """Return the result of ``solution`` as JSON-able values."""
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
