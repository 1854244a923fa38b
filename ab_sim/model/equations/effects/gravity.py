"""Gravity across the shaft, for any mounting angle of the drive."""

from math import hypot
from typing import TYPE_CHECKING, Annotated, NamedTuple

from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register
from ab_sim.tracing.functions import cos, sin

if TYPE_CHECKING:
    from ab_sim.scene.model import Scene


@register(
    "gravity",
    equation="g (sin(tilt) cos(direction), sin(tilt) sin(direction), -cos(tilt)) on moving parts",
    source="Newton; the equations contain acceleration less gravity, as an accelerometer reads it",
)
class Gravity(NamedTuple):
    """Weight of deck, unbalance and balls in the plane of the disc.

    On a deck in the plane, only the component across the shaft acts, and displacements count from
    the position at rest under gravity. On a deck in space, the component along the shaft acts too,
    and displacements count from the position with relaxed mounts.
    """

    tilt: Annotated[
        Number,
        quantity(
            "angle between shaft and vertical: 0 the disc lies flat, pi/2 the drive stands on edge",
            "rad",
            ge=-6.3,
            le=6.3,
        ),
    ]
    direction: Annotated[
        Number,
        quantity(
            "direction of gravity in the plane of the disc, from the x axis", "rad", ge=-6.3, le=6.3
        ),
    ] = -1.5707963267948966
    acceleration: Annotated[
        Number, quantity("g, acceleration of free fall", "m/s^2", ge=0, le=1e3)
    ] = 9.80665

    def gravity(self) -> tuple[float, float]:
        across = self.acceleration * sin(self.tilt)
        return (across * cos(self.direction), across * sin(self.direction))

    def weight(self) -> tuple[float, float, float]:
        across = self.acceleration * sin(self.tilt)
        along = -self.acceleration * cos(self.tilt)
        return (across * cos(self.direction), across * sin(self.direction), along)

    def check_scene(self, scene: "Scene") -> None:
        """Refuse gravity in the plane of the disc if no spring holds the deck."""
        if scene.deck is not None:
            return  # the position at rest is searched for, and a deck that nothing holds may fall
        pull = hypot(*self.gravity())
        held = (
            ("suspension", "stiffness"),
            ("unequal_suspension", "stiffness_1"),
            ("hardening_suspension", "cubic_stiffness"),
        )
        stiff = [
            name
            for name, key in held
            if name in scene.effects and getattr(scene.effects[name], key) > 0
        ]
        if pull > 0 and not stiff:
            raise ValueError(
                f"effects.gravity: pulls the deck aside with {pull:.3g} m/s^2, and no "
                "suspension with a stiffness holds it; name the effect suspension, leave out "
                "gravity, or lay the disc flat (tilt: 0)"
            )
