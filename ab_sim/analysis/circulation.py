"""Balls that go round the race for ever, instead of coming to rest on it.

A bunch of balls that stalls near a critical speed, while the rotor speeds on, stays there: the
whirl that it makes takes as much from it as the drag of the race gives it.
"""

import math
from typing import Any, NamedTuple

import numpy as np

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


class CirculationMarks:
    """Keeps of samples, as they come, those at the ends of three equal parts.

    Args:
        count: how many samples of each run there are to come.
    """

    def __init__(self, count: int) -> None:
        self._marks = [(count - 1) * part // 3 for part in range(4)]
        self._rows: list[tuple[np.ndarray, ...]] = []
        self._taken = 0

    def take(self, time: np.ndarray, angle: np.ndarray, ball_angles: np.ndarray) -> None:
        """The next samples.

        Args:
            time: s, shape (runs, samples).
            angle: the spindle's [rad], the same.
            ball_angles: theta_i, unwrapped [rad], shape (runs, samples, balls).
        """
        count = time.shape[1]
        while len(self._rows) < 4 and self._marks[len(self._rows)] < self._taken + count:
            at = self._marks[len(self._rows)] - self._taken
            row = time[:, at], angle[:, at], ball_angles[:, at]
            self._rows.append(tuple(map(np.copy, row)))
        self._taken += count

    @property
    def found(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Time and spindle's angle, shape (runs, 4); balls' angles, shape (runs, balls, 4)."""
        time, psi, theta = (np.stack(rows, axis=-1) for rows in zip(*self._rows, strict=True))
        return time, psi, theta


def circulation_of(
    time: np.ndarray, psi: np.ndarray, theta: np.ndarray
) -> list[Circulation | None]:
    """Those that circulate, for each run; None where no ball does.

    Args:
        time: where three equal parts of the samples end, s, shape (runs, 4).
        psi: the spindle's angle there [rad], the same.
        theta: the balls' angles, unwrapped [rad], shape (runs, balls, 4).
    """
    found: list[Circulation | None] = [None] * len(time)
    lasts = np.diff(time, axis=1)
    goes_on = np.all(lasts > 0.0, axis=1)
    turns = np.diff(theta, axis=2) / (2.0 * math.pi)
    one_way = np.all(turns >= TURNS, axis=2) | np.all(turns <= -TURNS, axis=2)
    for run in np.flatnonzero(goes_on & one_way.any(axis=1)).tolist():
        rates = turns[run] / lasts[run]
        lasting = np.abs(rates[:, 2]) >= KEPT * np.abs(rates[:, 0])
        balls = np.flatnonzero(one_way[run] & lasting)
        if len(balls) == 0:
            continue
        whole = float(time[run, 3] - time[run, 0])
        angles = theta[run, balls]
        spindle = float(psi[run, 3] - psi[run, 0]) / whole
        speeds = spindle + (angles[:, 3] - angles[:, 0]) / whole
        found[run] = Circulation(tuple(balls.tolist()), tuple(speeds.tolist()), spindle)
    return found
