"""Spin inertia of balls that roll on the race without slipping."""

from typing import NamedTuple

from ab_sim.dynamics.motion import Ball, BallMotion, Body, Deck, Reaction
from ab_sim.scene.registry import register


@register(
    "ball_spin",
    equation="inertia m + I/a^2 along the race, drive ((R + a)/a^2) I psi'', I = 2/5 m a^2",
    source="thesis (2-2), (2-8), (2-11)",
    uses_ball_radius=True,
)
class BallSpin(NamedTuple):
    """Solid balls roll without slipping, so moving along the race also spins them up.

    The spin energy uses the *absolute* spin ((R + a) w - R psi_i') / a, which makes the thesis'
    (2-11) exactly the no-slip Lagrangian (EQUATIONS.md, slips).
    """

    def ball_inertia(self, ball: Ball) -> float:
        return 0.4 * ball.mass  # I / a^2

    def ball_force(self, body: Body, ball: Ball, motion: BallMotion, deck: Deck) -> float:
        return 0.4 * ball.mass * (body.race_radius + ball.radius) * deck.acceleration

    def motor_torque(
        self, body: Body, ball: Ball, motion: BallMotion, deck: Deck, reaction: Reaction
    ) -> float:
        arm = body.race_radius + ball.radius
        return (
            0.4
            * ball.mass
            * arm
            * (arm * deck.acceleration - body.race_radius * reaction.acceleration)
        )

    def ball_energy(self, body: Body, ball: Ball, motion: BallMotion, deck: Deck) -> float:
        rim = (body.race_radius + ball.radius) * deck.speed - body.race_radius * motion.speed
        return 0.2 * ball.mass * rim * rim
