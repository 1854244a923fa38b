"""Size and phase of the part of the whirl that repeats once per turn of the spindle.

On axes that turn with the rotor this part is constant. Its vector is the mean of the displacement
on these axes over a whole turn, (x + i y) exp(-i psi), and so counts from the unbalance.
"""

import math

import numpy as np

from ab_sim.base.presentation import TURN
from ab_sim.drive.trajectory import Trajectory

SIZE, PHASE = "once_per_turn", "phase"
"""Names of derived columns: the vector's length [m] and its angle from the unbalance [rad]."""
COARSEST = 0.25 * TURN
"""Largest angle between samples [rad] that resolves the part once per turn."""
_FINEST = TURN / 4096
"""Least spacing of the stored samples [rad], which limits the memory at low spindle speeds."""


class TurnVector:
    """Mean vector over the last turn of the spindle, for each of successive samples."""

    def __init__(self) -> None:
        # Samples of the last turn: path of the spindle [rad], and the vector's integral over it.
        self._path, self._sums = np.zeros(0), np.zeros(0, complex)
        self._angle, self._vector = math.nan, complex(math.nan)
        self._whole_from = 0.0  # path from which there is no gap

    def of(self, angle: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the vectors [m], complex, shape (samples,).

        NaN before the first whole turn, at standstill, and for a turn after samples that are too
        far apart.

        Parameters
        ----------
        angle
            Psi of at least one further sample [rad], shape (samples,).
        x, y
            Displacement on inertial axes [m], shape (samples,).
        """
        sound = np.isfinite(x) & np.isfinite(y)
        vectors = (np.where(sound, x, 0.0) + 1j * np.where(sound, y, 0.0)) * np.exp(-1j * angle)
        if not len(self._path):
            self._path, self._sums = np.zeros(1), np.zeros(1, complex)
            self._angle, self._vector = float(angle[0]), complex(vectors[0])
        turned = np.abs(np.diff(angle, prepend=self._angle))
        means = 0.5 * (vectors + np.concatenate([[self._vector], vectors[:-1]]))
        count, self._angle, self._vector = len(self._path), float(angle[-1]), complex(vectors[-1])
        path = _continued(self._path, turned)
        sums = _continued(self._sums, turned * means)
        ends = path[count:]
        # A mean is valid only if the whole turn before its sample begins after the last gap.
        gaps = np.where((turned > COARSEST) | ~sound, ends, self._whole_from)
        gaps = np.maximum.accumulate(gaps)
        self._whole_from = float(gaps[-1])
        begins = ends - TURN
        at_end = sums[count:]
        last = np.diff(path // _FINEST, append=math.inf) > 0.0
        path, sums = path[last], sums[last]
        # The integral is interpolated linearly between samples.
        before = np.interp(begins, path, sums.real) + 1j * np.interp(begins, path, sums.imag)
        mean = (at_end - before) / TURN
        mean[(begins < gaps) | (turned == 0.0)] = complex(math.nan, math.nan)
        keep = max(int(np.searchsorted(path, begins[-1])) - 1, 0)
        self._path, self._sums = path[keep:], sums[keep:]
        return mean


def _continued(sums: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """Append cumulative sums of further parts, bit-identical to the sums over a single block."""
    return np.concatenate([sums[:-1], np.cumsum(np.concatenate([sums[-1:], parts]))])


def once_per_turn(run: Trajectory) -> np.ndarray:
    """Return the vectors of all samples of a run [m]; see ``TurnVector``."""
    return TurnVector().of(run["angle"], run["x"], run["y"])
