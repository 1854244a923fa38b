"""Viscous drag of the race's filling on the balls."""

from typing import Annotated, NamedTuple

from ab_sim.dynamics.motion import Ball, BallMotion, Body, Deck, Reaction
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register


@register(
    "viscous_drag",
    equation="F_i = -c_b R theta_i'",
    source="thesis (2-4), (2-11); relative-stability (9), (10)",
)
class ViscousDrag(NamedTuple):
    """Drag on each ball against its speed relative to the race."""

    coefficient: Annotated[Number, quantity("c_b", "N s/m", ge=0, le=1e9)]

    def ball_force(self, body: Body, ball: Ball, motion: BallMotion, deck: Deck) -> float:
        return -self.coefficient * body.race_radius * motion.rate

    def motor_torque(
        self, body: Body, ball: Ball, motion: BallMotion, deck: Deck, reaction: Reaction
    ) -> float:
        # The race drags the ball along; the motor holds the race's speed against the reaction.
        return -self.coefficient * body.race_radius * body.race_radius * motion.rate

    def ball_loss(self, body: Body, ball: Ball, motion: BallMotion, reaction: Reaction) -> float:
        speed = body.race_radius * motion.rate
        return self.coefficient * speed * speed
