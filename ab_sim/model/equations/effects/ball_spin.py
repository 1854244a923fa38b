"""Spin inertia of balls that roll on the race without slipping."""

from typing import NamedTuple

from ab_sim.model.equations.motion import Ball
from ab_sim.scene.registry import register


@register(
    "ball_spin",
    equation="energy I (w - s'/a)^2 / 2, I = 2/5 m a^2: inertia m + I/a^2 along the race, and the "
    "spindle's acceleration spins the ball up",
    source="thesis (2-2), (2-8), (2-11)",
    uses_ball_radius=True,
)
class BallSpin(NamedTuple):
    """Solid balls roll without slipping, so moving along the race also spins them up.

    The spin is the *absolute* one, which makes the thesis' (2-11) exactly the no-slip Lagrangian
    (docs/equations.md, 6).
    """

    def ball_inertia(self, ball: Ball) -> float:
        return 0.4 * ball.mass  # I / a^2
