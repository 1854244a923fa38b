"""Linear suspension that is not equal in every direction."""

from typing import TYPE_CHECKING, Annotated, NamedTuple

from ab_sim.model.equations.motion import DeckMotion
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register
from ab_sim.tracing.functions import cos, sin

if TYPE_CHECKING:
    from ab_sim.scene.model import Scene


@register(
    "unequal_suspension",
    equation="f_j = -c_j v_j - k_j u_j along the principal axes j = 1, 2, fixed in space",
    source="Genta, Dynamics of Rotating Systems (2005), ch. 3 (anisotropic supports)",
)
class UnequalSuspension(NamedTuple):
    """Springs and dampers along two principal axes; replaces the effect suspension."""

    stiffness_1: Annotated[
        Number, quantity("k_1, stiffness along principal axis 1", "N/m", ge=0, le=1e12)
    ]
    stiffness_2: Annotated[
        Number, quantity("k_2, stiffness along principal axis 2", "N/m", ge=0, le=1e12)
    ]
    damping_1: Annotated[
        Number, quantity("c_1, damping along principal axis 1", "N s/m", ge=0, le=1e9)
    ]
    damping_2: Annotated[
        Number, quantity("c_2, damping along principal axis 2", "N s/m", ge=0, le=1e9)
    ]
    axis_angle: Annotated[
        Number, quantity("angle from the x axis to principal axis 1", "rad", ge=-6.3, le=6.3)
    ] = 0.0

    def space_force(self, deck: DeckMotion) -> tuple[float, float]:
        c, s = cos(self.axis_angle), sin(self.axis_angle)
        f_p = -self.stiffness_1 * (c * deck.x + s * deck.y)
        f_p -= self.damping_1 * (c * deck.vx + s * deck.vy)
        f_q = -self.stiffness_2 * (c * deck.y - s * deck.x)
        f_q -= self.damping_2 * (c * deck.vy - s * deck.vx)
        return (c * f_p - s * f_q, s * f_p + c * f_q)

    def space_energy(self, deck: DeckMotion) -> float:
        c, s = cos(self.axis_angle), sin(self.axis_angle)
        u_p, u_q = c * deck.x + s * deck.y, c * deck.y - s * deck.x
        return 0.5 * (self.stiffness_1 * u_p * u_p + self.stiffness_2 * u_q * u_q)

    def space_loss(self, deck: DeckMotion) -> float:
        c, s = cos(self.axis_angle), sin(self.axis_angle)
        v_p, v_q = c * deck.vx + s * deck.vy, c * deck.vy - s * deck.vx
        return self.damping_1 * v_p * v_p + self.damping_2 * v_q * v_q

    def check_scene(self, scene: "Scene") -> None:
        """Refuse a second linear suspension."""
        if "suspension" in scene.effects:
            raise ValueError(
                "effects.unequal_suspension: replaces the effect suspension, and the scene names "
                "both; remove one of them"
            )
