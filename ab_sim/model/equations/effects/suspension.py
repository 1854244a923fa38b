"""Linear, isotropic suspension of the deck."""

from typing import Annotated, NamedTuple

from ab_sim.model.equations.motion import DeckMotion
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register


@register(
    "suspension",
    equation="f = -c v - k u",
    source="thesis (2-3), (2-4), (2-9), (2-10)",
)
class Suspension(NamedTuple):
    """Insulators between deck and housing: a spring and a damper, equal in every direction."""

    stiffness: Annotated[Number, quantity("k, stiffness of the spring", "N/m", ge=0, le=1e12)]
    damping: Annotated[Number, quantity("c, damping of the damper", "N s/m", ge=0, le=1e9)]

    def deck_force(self, deck: DeckMotion) -> tuple[float, float]:
        k, c = self.stiffness, self.damping
        return (-c * deck.vx - k * deck.x, -c * deck.vy - k * deck.y)

    def deck_energy(self, deck: DeckMotion) -> float:
        return 0.5 * self.stiffness * (deck.x * deck.x + deck.y * deck.y)

    def deck_loss(self, deck: DeckMotion) -> float:
        return self.damping * (deck.vx * deck.vx + deck.vy * deck.vy)
