"""Rolling friction of the balls, proportional to the race's normal force."""

from typing import Annotated, NamedTuple

from ab_sim.model.equations.motion import Ball
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register


@register(
    "rolling_friction",
    equation="|F_i| <= (beta_b/a) max(N_i, 0); F_i = -(beta_b/a) max(N_i, 0) sign(theta_i') while "
    "it rolls",
    source="thesis (2-8), (2-11); docs/equations.md, 6",
    uses_ball_radius=True,
)
class RollingFriction(NamedTuple):
    """Friction against rolling, at most (beta_b/a) times the race's normal force on the ball.

    The law is set-valued: a ball at rest on the race sticks while the force needed to hold it is
    below this limit. Reversals, sticking, release, and the loss of contact with the race are
    located within a step. The normal force contains the deck's acceleration, so both are solved
    together.
    """

    arm: Annotated[
        Number,
        quantity("beta_b, arm of rolling friction; beta_b/a is the coefficient", "m", ge=0, le=1.0),
    ]

    def friction_coefficient(self, ball: Ball) -> float:
        return self.arm / ball.radius
