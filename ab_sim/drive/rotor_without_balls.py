"""A drive without its balls, at a speed that is held: the closed form of how far it whirls."""

from typing import NamedTuple

import numpy as np


class RotorWithoutBalls(NamedTuple):
    """Rotor and deck on a linear, isotropic suspension, in the plane of the disc."""

    mass: float
    """M - sum m_i [kg]: the balls' mass is taken out, too."""
    unbalance: float
    """M0 e [kg m]."""
    stiffness: float
    """k [N/m]; 0 without a suspension."""
    damping: float
    """c [N s/m]."""

    def whirl(self, speed: np.ndarray) -> np.ndarray:
        """Steady whirl radius W [m] at speeds [rad/s]: M0 e w^2 / |k - M w^2 + i c w|.

        Thesis (2-9), (2-10) without balls, at rest on the rotating axes. Infinite at the critical
        speed of a suspension that does not damp.
        """
        square = np.square(speed)
        pull = self.unbalance * square
        hold = np.hypot(self.stiffness - self.mass * square, self.damping * speed)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(pull == 0.0, 0.0, pull / hold)
