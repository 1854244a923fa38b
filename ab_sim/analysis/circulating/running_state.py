"""State of the running equations for a circulating bunch."""

import math

import numpy as np

from ab_sim.analysis.circulating.bunch import CirculatingBunch
from ab_sim.analysis.equilibria.balanced import symmetric
from ab_sim.analysis.equilibria.resting import base_rotor_of
from ab_sim.model.dynamics.layout import StateLayout, layout_of
from ab_sim.model.dynamics.system import System


def state_of_bunch(system: System, bunch: CirculatingBunch) -> np.ndarray:
    """Return the bunch's state at an instant when the displacement points along the unbalance.

    The bunch's balls come first. The other balls rest at their balanced position, or opposite the
    unbalance if they cannot balance it.

    Args:
        system: planar system of the bunch's scene.
        bunch: circulating bunch.

    Returns:
        State with shape (4 + 2 n,): u and v on the rotor's axes [m, m/s], angles [rad] and rates
        [rad/s].
    """
    layout: StateLayout = layout_of(system)
    p, backwards = bunch.count, bunch.spindle_speed < 0.0
    state = np.zeros(layout.size)
    state[layout.deck] = bunch.W, 0.0, 0.0, bunch.speed * bunch.W
    angles = state[layout.angles]
    angles[:p] = -bunch.angle if backwards else bunch.angle
    angles[p:] = math.pi
    rotor = base_rotor_of(system)
    rest = symmetric(rotor._replace(moments=rotor.moments[p:], kinds=rotor.kinds[p:]))
    if rest is not None:
        angles[p:] = rest
    state[layout.rates][:p] = bunch.speed - bunch.spindle_speed
    return state
