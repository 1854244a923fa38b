"""Coulomb friction with a constant coefficient."""

from tests.effects.friction_parts import FrictionParts, effect
from tests.effects.parts import Changes, Run


class RaceFriction(FrictionParts):
    name = "race_friction"
    changes = {"effects": {"race_friction": {"coefficient": 0.01}}}

    def law(self, coefficient: float) -> Changes:
        return effect("race_friction", "coefficient", coefficient)

    def coefficient(self, run: Run) -> float:
        return float(run.effect("race_friction").coefficient)


PARTS = RaceFriction()
