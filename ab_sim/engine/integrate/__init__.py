"""Steppers: their registry, the choice of one for a scene, and limits of the step."""

from ab_sim.engine.integrate.registry import Stepper, stepper_named

__all__ = ["Stepper", "stepper_named"]
