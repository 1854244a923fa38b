"""The part of the whirl that comes once per turn of the spindle: its size and its phase.

On axes that turn with the rotor that part stands still. Its vector is the mean of the displacement
on these axes over a whole turn, (x + i y) exp(-i psi), and so counts from the unbalance.
"""

import math

import numpy as np

from ab_sim.drive.trajectory import Trajectory

SIZE, PHASE = "once_per_turn", "phase"
"""Columns that are not recorded: length [m] and angle from the unbalance [rad] of the vector."""
TURN = 2.0 * math.pi
COARSEST = 0.25 * TURN
"""Samples further apart than this angle [rad] do not show what comes once per turn."""


class OncePerTurn:
    """Finds the vector at each sample, over the turn that ends there, as samples come."""

    def __init__(self) -> None:
        # Of the last turn's samples: path of the spindle [rad], and the vector's integral over it.
        self._path, self._sums = np.zeros(0), np.zeros(0, complex)
        self._angle, self._vector = math.nan, complex(math.nan)
        self._whole_from = 0.0  # path from which there is no gap

    def of(self, angle: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the vectors [m], complex, shape (samples,).

        NaN before the first whole turn, at standstill, and for a turn after samples that are too
        far apart.

        Args:
            angle: psi of further samples, at least one [rad], shape (samples,).
            x, y: displacement on fixed axes [m], the same.
        """
        first = len(self._path) == 0
        vectors = (x + 1j * y) * np.exp(-1j * angle)
        turned = np.abs(np.diff(angle, prepend=angle[0] if first else self._angle))
        means = 0.5 * (vectors + np.concatenate([vectors[:1], vectors[:-1]]))
        if not first:
            means[0] = 0.5 * (self._vector + vectors[0])
        count, self._angle, self._vector = len(self._path), float(angle[-1]), complex(vectors[-1])
        path = np.concatenate([self._path, (0.0 if first else self._path[-1]) + np.cumsum(turned)])
        sums = np.concatenate(
            [self._sums, (0.0 if first else self._sums[-1]) + np.cumsum(turned * means)]
        )
        ends = path[count:]
        gaps = np.maximum.accumulate(np.where(turned > COARSEST, ends, self._whole_from))
        self._whole_from = float(gaps[-1])
        begins = ends - TURN
        # Between samples the integral is taken as a line.
        before = np.interp(begins, path, sums.real) + 1j * np.interp(begins, path, sums.imag)
        found = (sums[count:] - before) / TURN
        found[(begins < gaps) | (turned == 0.0)] = complex(math.nan, math.nan)
        keep = max(int(np.searchsorted(path, begins[-1])) - 1, 0)
        self._path, self._sums = path[keep:], sums[keep:]
        return found


def once_per_turn(run: Trajectory) -> np.ndarray:
    """Return the vectors of all samples of a run [m]; see ``OncePerTurn``."""
    return OncePerTurn().of(run["angle"], run["x"], run["y"])
