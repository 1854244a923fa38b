"""Linear equations of the deck's small motions about its position at rest."""

from typing import NamedTuple

import numpy as np

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
        """Position at rest, as text."""
        places = zip(self.coordinates, self.rest, self.units, strict=True)
        return ", ".join(f"{name} = {round(at, 12) + 0.0:.4g} {unit}" for name, at, unit in places)
