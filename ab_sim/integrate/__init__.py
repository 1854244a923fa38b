"""Steppers: their registry, the machinery that takes fixed steps, and the step's limits."""

from ab_sim.integrate.registry import stepper_named
from ab_sim.integrate.stepper import Stepper

__all__ = ["Stepper", "stepper_named"]
