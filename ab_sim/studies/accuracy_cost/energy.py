"""How well a run closes its energy balance."""

from typing import NamedTuple

import numpy as np

from ab_sim.drive import Drive
from ab_sim.drive.observation import EnergyBalance
from ab_sim.errors import SceneError
from ab_sim.scene.model import Scene

INSTANTS = 200
"""About so many samples of a run are looked at; each takes some Python."""


class RunEnergies(NamedTuple):
    """Energies at some instants of a run."""

    energies: list[EnergyBalance]

    def error(self) -> float:
        """Largest |stored - at start - motor work + dissipated|, relative.

        To the largest energy that was stored, put in by the motor, or dissipated until then.
        """
        table = np.array(self.energies)
        stored, start, work, dissipated = table.T
        size = max(float(np.abs(column).max()) for column in (stored - start, work, dissipated))
        gap = float(np.abs(stored - start - work + dissipated).max())
        return gap / size if size > 0.0 else 0.0


def energy_balance_refusal(scene: Scene) -> str:
    """Why no energy balance can be kept of a scene; empty where one can."""
    try:
        Drive(scene, energy_balance=True)
    except SceneError as error:
        return str(error)
    return ""
