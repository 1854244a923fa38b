"""Resting states: constant deck and ball positions on the axes that turn with the rotor.

Resting states are equilibria of the equations in rotating axes. This package finds them and their
stability.

Sources: three-ball (Lu and Hung 2008) (10)-(36), relative-stability (NSC 2007) (15)-(24).
"""

from ab_sim.analysis.equilibria.at_speed import Equilibria, equilibria_of
from ab_sim.analysis.equilibria.branches import branches_over_speed, kept_branches
from ab_sim.analysis.equilibria.settling import Settling, settles
from ab_sim.analysis.equilibria.states import RestingState
from ab_sim.analysis.equilibria.sticking import Sticking, sticking

__all__ = [
    "Equilibria",
    "RestingState",
    "Settling",
    "Sticking",
    "branches_over_speed",
    "equilibria_of",
    "kept_branches",
    "settles",
    "sticking",
]
