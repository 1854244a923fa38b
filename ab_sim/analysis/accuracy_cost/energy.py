"""Error of a run's energy balance."""

from typing import NamedTuple

import numpy as np

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.drive.observation import EnergyBalance
from ab_sim.scene.model import Scene

INSTANTS = 200
"""Approximate number of instants per run at which energies are evaluated, in slow Python."""


class RunEnergies(NamedTuple):
    """Energies at some instants of a run."""

    energies: list[EnergyBalance]

    def error(self) -> float:
        """Return the largest |stored - at start - motor work + dissipated|, dimensionless.

        It is divided by the largest stored, supplied or dissipated energy since the start.
        """
        table = np.array(self.energies)
        stored, start, work, dissipated = table.T
        size = max(float(np.abs(column).max()) for column in (stored - start, work, dissipated))
        gap = float(np.abs(stored - start - work + dissipated).max())
        return gap / size if size > 0.0 else 0.0


def energy_balance_refusal(scene: Scene) -> str:
    """Return the reason why a scene has no energy balance; empty if it has one."""
    try:
        Drive(scene, energy_balance=True)
    except SceneError as error:
        return str(error)
    return ""
