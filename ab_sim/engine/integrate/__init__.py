"""Steppers: their registry, the choice of one for a scene, and limits of the step."""

from ab_sim.engine.integrate.registry import stepper_named
from ab_sim.engine.integrate.stepper import Stepper

__all__ = ["Stepper", "stepper_named"]
