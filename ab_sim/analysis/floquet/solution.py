"""A periodic solution as it is followed: what is said of it, and a state to go on from.

Each is kept on disk (``analysis.results``) by its scene, its speed, and what it was looked for
from, to the bit: what is followed again is there at once, and goes on where it was interrupted.
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
"""What a followed solution was found from."""


class Solution(NamedTuple):
    """Of a scene at a held speed; see ``Stability``."""

    multipliers: np.ndarray
    largest: float
    stable: bool | None
    verdict: str
    balanced: bool
    whirl_max: float
    """[m]."""
    ball_angles: list[float]
    """[rad]."""
    start: list[float]
    """State at the start of the turn."""

    @classmethod
    def of(cls, report: dict[str, Any]) -> "Solution":
        """Of ``Stability.report``."""
        multipliers = np.array(report["multipliers"], float).reshape(-1, 2)
        rest = (report[key] for key in cls._fields[1:])
        return cls(multipliers[:, 0] + 1j * multipliers[:, 1], *rest)

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        multipliers = [[float(x.real), float(x.imag)] for x in self.multipliers]
        return {**self._asdict(), "multipliers": multipliers}


class SolutionSearch(NamedTuple):
    """Where to look for a solution: on the way from one to another, then from starts."""

    way: tuple[list[float], list[float]] | None
    """Two solutions' states, the second the nearer one; None: from starts only."""
    share: float
    """How far along the way; beyond 1 past the second."""
    starts: Sequence[str]
    """Of ``STARTS``, where nothing is found along the way; none: then nothing is."""


def solution(scene: Scene, speed: float, search: SolutionSearch) -> tuple[Solution | None, bool]:
    """The solution found first, and whether it was found from a start.

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
    """What ``solution`` says, as JSON has it."""
    turn = TurnMap(scene, speed)
    if way is not None and len(way[1]) == len(way[0]) == turn.layout.size:
        one, other = map(np.array, way)
        ahead = other - one
        ahead[turn.layout.angles] = within_turn(ahead[turn.layout.angles])
        orbit = turn.shoot(one + share * ahead)
        if orbit is None and starts:
            orbit = turn.shoot(other)
        found = None if orbit is None else judged(turn, orbit, NEIGHBOUR)
        if found is not None or not starts:
            return {"found": None if found is None else found.report(), "new": False}
    orbit, name = find_orbit(turn, starts)
    found = None if orbit is None else judged(turn, orbit, name)
    return {"found": None if found is None else found.report(), "new": True}
