"""Friction of rolling balls: the normal force times the arm over the ball's radius."""

from tests.effects.friction_parts import FrictionParts, effect
from tests.effects.parts import Changes, Run


class RollingFriction(FrictionParts):
    name = "rolling_friction"
    changes = {"effects": {"rolling_friction": {"arm": 1e-5}}}

    def law(self, coefficient: float) -> Changes:
        return effect("rolling_friction", "arm", coefficient * 1e-3)

    def coefficient(self, run: Run) -> float:
        return float(run.effect("rolling_friction").arm / 1e-3)


PARTS = RollingFriction()
