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

    Impacts are located within a step. They transfer momentum between balls and deck, and never add
    energy. Newton's law holds for all balls in contact at the impact: a ball that hits a row at
    rest sets the whole row in motion. In Newton's cradle, in contrast, elastic waves pass through
    the balls one after the other.

    Impacts and contacts have no friction. Contact forces act along the race; their component that
    presses both balls against the race is neglected. D is constant along an oval race. Where its
    radius of curvature is l, balls therefore touch too late by about
    (a_i + a_i+1)^3 (1/l^2 - 1/R^2) / 24, or too early if this is negative.
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
                "effects.ball_contact: balls in more than one race (balls.race), where contacts "
                "are not modelled; put them into one race, or leave the effect out"
            )
        check_row(scene)
