"""Deck at rest: equilibrium under its weight, and linear equations of small motions about it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

FARTHEST = 1e6
"""Largest sag [m]; a suspension that sags further counts as not holding the weight."""
_NO_WEIGHT = 1e-100
"""Weight below which the sag counts as 0 [N], because the weight's square would underflow."""
BALANCED = 1e-9
"""Largest residual of forces, relative to the weight."""


def place_at_rest(
    unbalanced: Callable[[np.ndarray], np.ndarray],
    stored: Callable[[np.ndarray], float],
    weight: np.ndarray,
    turns: int = 0,
) -> np.ndarray | None:
    """Return the equilibrium position, searched for in the direction of the weight.

    Parameters
    ----------
    unbalanced
        Function of displacement [m] and turn [rad] that returns forces and moments relative to the
        weight.
    stored
        Function of the displacement that returns the energy in the springs [J].
    weight
        Weight of the deck [N], one component per axis, shape (axes,).
    turns
        Number of components of the turn, which follow those of the displacement.

    Returns
    -------
    np.ndarray | None
        Displacement [m] and turn [rad], shape (axes + turns,); None if no solution is found.
    """
    from scipy.optimize import approx_fprime, root  # takes as long as a run to import

    size = float(np.linalg.norm(weight))
    if not size > _NO_WEIGHT:
        return np.zeros(len(weight) + turns)
    down, reach = weight / size, 1e-9
    # Start at the distance over which the springs store the work of the weight.
    while stored(reach * down) < reach * size and reach < FARTHEST:
        reach *= 2.0
    # The search uses this distance as the unit of length, because it fails in metres.
    scale = np.append(np.full(len(weight), reach), np.ones(turns))

    def in_reaches(place: np.ndarray) -> np.ndarray:
        return unbalanced(scale * place)

    def slopes(place: np.ndarray) -> np.ndarray:
        # The step of the solver's own differences vanishes for a number that is 0 up to rounding.
        return np.asarray(approx_fprime(place, in_reaches, 1e-7))

    start = np.append(0.5 * down, np.zeros(turns))
    rest = scale * root(in_reaches, start, jac=slopes, tol=1e-15).x
    return rest if np.abs(unbalanced(rest)).max() <= BALANCED else None


FREE = 1e-9
"""Stiffness, relative to the largest, up to which a direction counts as unrestrained."""
MATTERS = 0.1
"""Smallest share of the energy of a motion with which a coordinate is listed as moving."""


class Linearised(NamedTuple):
    """Equations M q'' + (C + w G) q' + K q = 0 with the spindle speed w [rad/s].

    Rotor and balls are averaged over one turn; the balls are evenly spread and turn with the rotor.
    """

    mass: np.ndarray
    """Mass matrix M, shape (n, n)."""
    damping: np.ndarray
    """Damping matrix C, shape (n, n)."""
    gyroscopic: np.ndarray
    """Gyroscopic matrix G, shape (n, n)."""
    stiffness: np.ndarray
    """Stiffness matrix K, shape (n, n)."""
    rest: tuple[float, ...]
    """Position at rest, from the position with relaxed springs."""
    coordinates: tuple[str, ...]
    """Names of the entries of q, which count from the position at rest."""
    units: tuple[str, ...]
    """Units of the entries of q."""
    across: tuple[tuple[int, int], ...]
    """Pairs of entries that are x and y components of a vector."""

    def matrix(self, speed: float) -> np.ndarray:
        """Return A of z' = A z with z = (q, q'), shape (2 n, 2 n), at a spindle speed [rad/s]."""
        inverse = np.linalg.inv(self.mass)
        damping = self.damping + speed * self.gyroscopic
        zero, one = np.zeros_like(self.mass), np.eye(len(self.mass))
        return np.block([[zero, one], [-inverse @ self.stiffness, -inverse @ damping]])

    @property
    def free(self) -> tuple[str, ...]:
        """Coordinates in which the deck can move without a restoring force, by name."""
        scale = 1.0 / np.sqrt(np.diag(self.mass))
        values, vectors = np.linalg.eigh(self.stiffness * np.outer(scale, scale))
        loose = vectors[:, np.abs(values) <= FREE * np.abs(values).max()]
        moves = np.sum(loose**2, axis=1) >= MATTERS
        return tuple(name for name, move in zip(self.coordinates, moves, strict=True) if move)

    @property
    def hangs(self) -> str:
        """Position at rest as text, with names and units of the coordinates."""
        places = zip(self.coordinates, self.rest, self.units, strict=True)
        return ", ".join(f"{name} = {round(at, 12) + 0.0:.4g} {unit}" for name, at, unit in places)
