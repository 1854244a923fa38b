"""Balls that circulate permanently on the race instead of coming to rest.

Balls that stall near a critical speed while the rotor accelerates stay there. The torque of the
whirl that they cause balances the drag of the race.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.scene.units import ShownUnit

RAD_PER_S = ShownUnit("rad/s", 1.0)
"""Default unit of speeds in texts."""
TURNS = 1.0
"""Least number of revolutions of a ball on the race in each third of the samples."""
KEPT = 0.9
"""Least ratio of a ball's speed on the race in the last third to that in the first.

A ball that slows down more may still come to rest.
"""


class Circulation(NamedTuple):
    """Circulating balls at the end of a run."""

    balls: tuple[int, ...]
    """Indices of the circulating balls."""
    speeds: tuple[float, ...]
    """Mean absolute speed of each ball in ``balls`` [rad/s]."""
    spindle_speed: float
    """Mean spindle speed over the time for which ``speeds`` are averaged [rad/s]."""

    def report(self) -> dict[str, Any]:
        """Return the result as JSON-able values."""
        return {
            "balls": list(self.balls),
            "speeds": list(self.speeds),
            "spindle_speed": self.spindle_speed,
        }

    def text(self, balls: int, unit: ShownUnit = RAD_PER_S) -> str:
        """Return the result as text, for a run with ``balls`` balls and with speeds in ``unit``."""
        low, high = (f"{pick(self.speeds) * unit.factor:.4g}" for pick in (min, max))
        speeds = low if low == high else f"{low} to {high}"
        return (
            f"{len(self.balls)} of {balls} at {speeds} {unit.text}, the spindle at "
            f"{self.spindle_speed * unit.factor:.4g}"
        )


class CirculationMarks:
    """Sampler that keeps the samples at the ends of three equal parts of a run.

    Parameters
    ----------
    count
        Number of samples of each run.
    """

    def __init__(self, count: int) -> None:
        self._marks = [(count - 1) * part // 3 for part in range(4)]
        self._rows: list[tuple[np.ndarray, ...]] = []
        self._taken = 0

    def take(self, time: np.ndarray, angle: np.ndarray, ball_angles: np.ndarray) -> None:
        """Process the next samples.

        Parameters
        ----------
        time
            Times [s], shape (runs, samples).
        angle
            Spindle angle [rad], same shape.
        ball_angles
            theta_i, unwrapped [rad], shape (runs, samples, balls).
        """
        count = time.shape[1]
        while len(self._rows) < 4 and self._marks[len(self._rows)] < self._taken + count:
            column = self._marks[len(self._rows)] - self._taken
            row = time[:, column], angle[:, column], ball_angles[:, column]
            self._rows.append(tuple(map(np.copy, row)))
        self._taken += count

    @property
    def kept(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Kept samples, see ``circulation_of``.

        Times [s] and spindle angles [rad], shape (runs, 4); ball angles [rad], shape (runs, balls,
        4).
        """
        time, psi, theta = (np.stack(rows, axis=-1) for rows in zip(*self._rows, strict=True))
        return time, psi, theta


def circulation_of(
    time: np.ndarray, psi: np.ndarray, theta: np.ndarray
) -> list[Circulation | None]:
    """Return the circulating balls of each run; None if no ball circulates.

    Parameters
    ----------
    time
        Times of the start and of the ends of three equal parts [s], shape (runs, 4).
    psi
        Spindle angle at these times [rad], same shape.
    theta
        Ball angles at these times, unwrapped [rad], shape (runs, balls, 4).
    """
    circulations: list[Circulation | None] = [None] * len(time)
    durations = np.diff(time, axis=1)
    # Three parts of equal sign and similar speed tell circulation from a swing, whose parts have
    # both signs, and from a ball that is still coming to rest.
    long_enough = np.all(durations > 0.0, axis=1)
    turns = np.diff(theta, axis=2) / (2.0 * math.pi)
    one_way = np.all(turns >= TURNS, axis=2) | np.all(turns <= -TURNS, axis=2)
    for run in np.flatnonzero(long_enough & one_way.any(axis=1)).tolist():
        rates = turns[run] / durations[run]
        steady = np.abs(rates[:, 2]) >= KEPT * np.abs(rates[:, 0])
        balls = np.flatnonzero(one_way[run] & steady)
        if len(balls) == 0:
            continue
        whole = float(time[run, 3] - time[run, 0])
        angles = theta[run, balls]
        spindle = float(psi[run, 3] - psi[run, 0]) / whole
        speeds = spindle + (angles[:, 3] - angles[:, 0]) / whole
        circulations[run] = Circulation(tuple(balls.tolist()), tuple(speeds.tolist()), spindle)
    return circulations
