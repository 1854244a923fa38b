"""Rolling friction of the balls, proportional to the race's normal force."""

from typing import Annotated, NamedTuple

import numpy as np

from ab_sim.dynamics.motion import Ball, BallMotion, Body, Deck, Reaction
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register


@register(
    "rolling_friction",
    equation="F_i = -(beta_b/a) max(N_i, 0) sign(theta_i')",
    source="thesis (2-8), (2-11)",
    uses_ball_radius=True,
)
class RollingFriction(NamedTuple):
    """Friction against rolling, (beta_b/a) times the race's normal force on the ball.

    The normal force N_i = m (R p_i^2 - A.r_i) contains the deck's acceleration, so it is solved
    together with it; where it would pull, it is zero (EQUATIONS.md, slips). A ball with no speed
    along the race feels none; the reversal is not located within a step.
    """

    arm: Annotated[
        Number, quantity("beta_b, a length: beta_b/a is the coefficient", "m", ge=0, le=1.0)
    ]

    def friction_coefficient(self, ball: Ball) -> float:
        return self.arm / ball.radius

    def motor_torque(
        self, body: Body, ball: Ball, motion: BallMotion, deck: Deck, reaction: Reaction
    ) -> float:
        # As with drag, the motor holds the race's speed against the reaction.
        friction = self.arm / ball.radius * max(reaction.normal_force, 0.0)
        return -friction * body.race_radius * np.sign(motion.rate)

    def ball_loss(self, body: Body, ball: Ball, motion: BallMotion, reaction: Reaction) -> float:
        rolled = abs(body.race_radius * motion.rate)
        return self.arm / ball.radius * max(reaction.normal_force, 0.0) * rolled
