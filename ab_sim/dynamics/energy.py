"""Mechanical energy of a system's state."""

from typing import Any

import numpy as np

from ab_sim.dynamics.system import System


def mechanical_energy(system: System, state: Any, psi: float, speed: float) -> float:
    """Kinetic and stored energy [J]; of the rotor's inertia I_r only what a motor accelerates.

    Args:
        system: the System.
        state: its state.
        psi: spindle angle [rad].
        speed: spindle speed [rad/s].
    """
    balls = system.equations_of_balls
    at = np.asarray(state, float)
    return float(system.deck_model.energy(system.effects, balls, at, float(psi), float(speed)))
