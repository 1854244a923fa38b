"""Dry friction between balls and race with a constant coefficient."""

from typing import Annotated, NamedTuple

from ab_sim.model.equations.motion import Ball
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register


@register(
    "race_friction",
    equation="|F_i| <= mu max(N_i, 0); F_i = -mu max(N_i, 0) sign(theta_i') while it slides",
    source="Coulomb's law; set-valued as in Leine and Nijmeijer, Dynamics and Bifurcations of "
    "Non-Smooth Mechanical Systems (2004), ch. 5",
)
class RaceFriction(NamedTuple):
    """Coulomb friction along the race, for balls that do not roll or are caged.

    The static and the sliding coefficient are equal. Sticking and reversals are treated as for
    rolling friction; in a scene with both effects, the coefficients add up.
    """

    coefficient: Annotated[
        Number,
        quantity("mu, friction force divided by the normal force of the race", "1", ge=0, le=10.0),
    ]

    def friction_coefficient(self, ball: Ball) -> float:
        return self.coefficient
