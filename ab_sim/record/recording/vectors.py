"""Sum of unbalances as arrows: those of rotor and balls, one after the other, and the residual."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ab_sim.base.palette import RESIDUAL, RESULTANT, UNBALANCE, Colour
from ab_sim.drive.balance import resultant
from ab_sim.record.recording.explanation import Explanation
from ab_sim.record.recording.layout import Array

REACH = 0.62
"""Drawn length of the largest unbalance, of the rotor or of all balls at one place, relative to the
race's radius."""


class Arrows(NamedTuple):
    """Arrows of a drawing: M0 e, sum m_i R exp(i theta_i), and their sum."""

    unbalance: float
    """Unbalance M0 e [kg m]."""
    moments: Array
    """Moments m_i R of the balls [kg m], shape (balls,)."""
    scale: float
    """Drawn length [mm] per unbalance [kg m]."""

    @classmethod
    def of(cls, explained: Explanation, race: float) -> Arrows | None:
        """Return the arrows for a race's radius [mm]; None without an unbalance."""
        if not explained.vectors:
            return None
        assert explained.unbalance is not None
        longest = max(explained.unbalance, float(explained.moments.sum()))
        return cls(explained.unbalance, explained.moments, REACH * race / longest)

    @property
    def labels(self) -> list[str]:
        """Names of the arrows."""
        return ["unbalance", "balls", "residual"] if len(self.moments) else ["unbalance"]

    @property
    def colors(self) -> list[Colour]:
        """Colours of the arrows."""
        return [UNBALANCE, RESULTANT, RESIDUAL][: len(self.labels)]

    def drawn(self, angles: Array) -> tuple[Array, Array]:
        """Return origins and vectors of the arrows on the rotor's axes.

        Args:
            angles: angles of the balls from the unbalance [rad], shape (rows, balls).

        Returns:
            Two complex arrays of shape (rows, arrows) [mm].
        """
        rotor = np.full(len(angles), self.scale * self.unbalance, dtype=complex)
        none = np.zeros_like(rotor)
        if not len(self.moments):
            return none[:, None], rotor[:, None]
        balls = self.scale * resultant(self.moments, angles)
        return np.column_stack([none, rotor, none]), np.column_stack([rotor, balls, rotor + balls])
