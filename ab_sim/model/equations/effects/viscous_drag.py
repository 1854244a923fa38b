"""Viscous drag of the race's filling on the balls."""

from typing import Annotated, NamedTuple

from ab_sim.model.equations.motion import Ball
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register


@register(
    "viscous_drag",
    equation="F_i = -c_b s_i', s_i' the ball's speed along the race: R theta_i' on a round one",
    source="thesis (2-4), (2-11); relative-stability (9), (10)",
)
class ViscousDrag(NamedTuple):
    """Drag on each ball against its speed relative to the race."""

    coefficient: Annotated[
        Number, quantity("c_b, drag force per speed relative to the race", "N s/m", ge=0, le=1e9)
    ]

    def ball_drag(self, ball: Ball) -> float:
        return self.coefficient
