"""Suspension that stiffens with displacement."""

from typing import Annotated, NamedTuple

from ab_sim.model.equations.motion import DeckMotion
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register


@register(
    "hardening_suspension",
    equation="f = -k_3 |u|^2 u",
    source="Duffing's spring, isotropic; Genta, Dynamics of Rotating Systems (2005), ch. 8",
)
class HardeningSuspension(NamedTuple):
    """Cubic spring in parallel with the linear suspension, equal in all directions: rubber mounts.

    A deck in space has this spring in each of its mounts.
    """

    cubic_stiffness: Annotated[
        Number, quantity("k_3, force per displacement cubed", "N/m^3", ge=0, le=1e18)
    ]

    def deck_force(self, deck: DeckMotion) -> tuple[float, float]:
        stiffness = self.cubic_stiffness * (deck.x * deck.x + deck.y * deck.y)
        return (-stiffness * deck.x, -stiffness * deck.y)

    def mount_stiffening(self, square: float) -> float:
        return self.cubic_stiffness * square

    def mount_energy(self, square: float) -> float:
        return 0.25 * self.cubic_stiffness * square * square

    def deck_energy(self, deck: DeckMotion) -> float:
        square = deck.x * deck.x + deck.y * deck.y
        return 0.25 * self.cubic_stiffness * square * square
