"""The deck's small motions about where it hangs at rest, as linear equations."""

from typing import NamedTuple

import numpy as np


class Linearised(NamedTuple):
    """M q'' + (C + w G) q' + K q = 0, w the speed of the spindle [rad/s].

    Rotor and balls are averaged over one turn; the balls spread evenly, and turn with the rotor.
    """

    mass: np.ndarray
    """M, shape (n, n)."""
    damping: np.ndarray
    """C, shape (n, n)."""
    gyroscopic: np.ndarray
    """G, shape (n, n)."""
    stiffness: np.ndarray
    """K, shape (n, n)."""
    rest: tuple[float, ...]
    """Where the deck hangs, from where its springs are relaxed."""
    coordinates: tuple[str, ...]
    """What the entries of q are, counted from there."""
    units: tuple[str, ...]
    """And their units."""
    across: tuple[tuple[int, int], ...]
    """Which of them are, two by two, x and y components of a vector."""

    def matrix(self, speed: float) -> np.ndarray:
        """A of z' = A z, z = (q, q'), shape (2 n, 2 n)."""
        inverse = np.linalg.inv(self.mass)
        damping = self.damping + speed * self.gyroscopic
        zero, one = np.zeros_like(self.mass), np.eye(len(self.mass))
        return np.block([[zero, one], [-inverse @ self.stiffness, -inverse @ damping]])

    @property
    def hangs(self) -> str:
        """Where the deck hangs, for people."""
        places = zip(self.coordinates, self.rest, self.units, strict=True)
        return ", ".join(f"{name} = {round(at, 12) + 0.0:.4g} {unit}" for name, at, unit in places)
