"""Balls that cannot pass each other."""

from typing import TYPE_CHECKING, Annotated, NamedTuple

from ab_sim.model.equations.neighbours import check_row
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register
from ab_sim.tracing.functions import where

if TYPE_CHECKING:
    from ab_sim.scene.model import Scene


@register(
    "ball_contact",
    equation="s_i+1 - s_i >= D along the race, D from a_i + a_i+1; after an impact the balls part "
    "with restitution times the speed of approach",
    source="Newton's law of impact; Brogliato, Nonsmooth Mechanics (2016), ch. 4",
    uses_ball_radius=True,
)
class BallContact(NamedTuple):
    """Balls have a size: they collide, and can rest against each other in a packed row.

    Impacts are located within a step and pass on momentum, to the deck as well; they never add
    energy. Newton's law holds for all balls that touch at the instant: a ball that hits a row at
    rest starts all of it, unlike in Newton's cradle, where elastic waves pass through one after
    the other.
    Friction is not part of an impact, and balls do not rub against each other. A push acts along
    the race: that its line leans outwards, and so presses both balls on the race, is left out. D is
    the same all along an oval race: where its radius of curvature is l, balls touch too late by
    some (a_i + a_i+1)^3 (1/l^2 - 1/R^2) / 24, or early by its opposite.
    """

    restitution_coefficient: Annotated[
        Number, quantity("separation speed divided by approach speed", "1", ge=0, le=1)
    ]
    rest_speed: Annotated[
        Number,
        quantity(
            "approach speed below which balls do not bounce but stay together", "m/s", gt=0, le=1.0
        ),
    ] = 1e-5

    def restitution(self, approach: float) -> float:
        return where(approach > self.rest_speed, self.restitution_coefficient, 0.0)

    def check_scene(self, scene: "Scene") -> None:
        """Refuse balls that do not fit on the race, or that overlap at the start."""
        if len(set(scene.balls.races)) > 1:
            raise ValueError(
                "effects.ball_contact: balls in more than one race (balls.race) cannot be told who "
                "touches whom; put them into one race, or leave the effect out"
            )
        check_row(scene)
