"""Steppers: their registry, the machinery that takes fixed steps, and the step's limits."""

from ab_sim.integrate.registry import STEPPERS, stepper_named
from ab_sim.integrate.tableau import Tableau

__all__ = ["STEPPERS", "Tableau", "stepper_named"]
