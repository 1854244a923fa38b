"""Balls that go round the race for ever, instead of coming to rest on it.

A bunch of balls that stalls near a critical speed, while the rotor speeds on, stays there: the
whirl that it makes takes as much from it as the drag of the race gives it.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.drive.trajectory import Trajectory

TURNS = 1.0
"""Of a ball on the race, at least, in each third of the samples looked at."""
KEPT = 0.9
"""Of its speed on the race from the first third to the last: of a ball that loses more of it, it
is not known that it does not come to rest."""


class Circulation(NamedTuple):
    """Balls that circulate at the end of a run."""

    balls: tuple[int, ...]
    """Their numbers."""
    speeds: tuple[float, ...]
    """Of each of them, absolute, in the mean [rad/s]."""
    spindle_speed: float
    """In the mean over the same time [rad/s]."""

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        return {
            "balls": list(self.balls),
            "speeds": list(self.speeds),
            "spindle_speed": self.spindle_speed,
        }

    def text(self, balls: int) -> str:
        """In words, for a run with so many balls."""
        low, high = (f"{pick(self.speeds):.4g}" for pick in (min, max))
        speeds = low if low == high else f"{low} to {high}"
        return (
            f"{len(self.balls)} of {balls} at {speeds} rad/s, the spindle at "
            f"{self.spindle_speed:.4g}"
        )


class CirculationWatch:
    """Looks for balls that circulate, in samples as they come.

    Args:
        count: how many samples there are to come.
    """

    def __init__(self, count: int) -> None:
        self._marks = [(count - 1) * part // 3 for part in range(4)]
        self._rows: list[np.ndarray] = []
        self._taken = 0

    def take(self, piece: Trajectory) -> None:
        """The next samples."""
        while len(self._rows) < 4 and self._marks[len(self._rows)] < self._taken + len(piece):
            at = self._marks[len(self._rows)] - self._taken
            self._rows.append(
                np.array([piece["time"][at], piece["angle"][at], *piece.ball_angles[at]])
            )
        self._taken += len(piece)

    @property
    def found(self) -> Circulation | None:
        """Those that circulate, after the last sample; None if no ball does."""
        time, psi, *theta = np.array(self._rows).T
        if len(theta) == 0 or not np.all(np.diff(time) > 0.0):
            return None
        turns = np.diff(theta, axis=1) / (2.0 * math.pi)
        rates = turns / np.diff(time)
        one_way = np.all(turns >= TURNS, axis=1) | np.all(turns <= -TURNS, axis=1)
        lasting = np.abs(rates[:, 2]) >= KEPT * np.abs(rates[:, 0])
        balls = np.flatnonzero(one_way & lasting)
        if len(balls) == 0:
            return None
        lasts = float(time[3] - time[0])
        angles = np.array(theta)[balls]
        spindle = float(psi[3] - psi[0]) / lasts
        speeds = spindle + (angles[:, 3] - angles[:, 0]) / lasts
        return Circulation(tuple(balls.tolist()), tuple(speeds.tolist()), spindle)
