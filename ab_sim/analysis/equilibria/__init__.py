"""Where deck and balls can rest on the axes that turn with the rotor, and how firmly."""

from ab_sim.analysis.equilibria.at_speed import Equilibria, equilibria_of
from ab_sim.analysis.equilibria.states import RestingState

__all__ = ["Equilibria", "RestingState", "equilibria_of"]
