"""A race that is off the shaft axis, or oval."""

from typing import TYPE_CHECKING, Annotated, NamedTuple

from ab_sim.base.errors import exact
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register
from ab_sim.tracing.functions import cos, sin

if TYPE_CHECKING:
    from ab_sim.scene.model import Scene


@register(
    "race_runout",
    equation="X(theta) = d + h n + h' t with h = R + lobe cos 2 (theta - lobe_angle), n = (cos "
    "theta, sin theta)",
    source="support function of a convex curve, Gray, Modern Differential Geometry of Curves and "
    "Surfaces (1997), 6.8; d and lobe as measured by roundness standards (ISO 12181)",
)
class RaceRunout(NamedTuple):
    """Race that is displaced from the shaft axis by a vector d, and two-lobed (oval).

    X is the curve of the balls' centres. theta is the direction of its outward normal at the ball;
    on a round race this is the ball's direction from the race's centre. The oval's width in the
    direction theta is 2 h(theta).
    """

    offset_1: Annotated[
        Number, quantity("offset of the race's centre towards the unbalance", "m", ge=-1, le=1)
    ] = 0.0
    offset_2: Annotated[
        Number,
        quantity("offset of the race's centre 90 deg ahead of the unbalance", "m", ge=-1, le=1),
    ] = 0.0
    lobe: Annotated[
        Number, quantity("two-lobe amplitude: the radius varies by +-lobe", "m", ge=0, le=1)
    ] = 0.0
    lobe_angle: Annotated[
        Number,
        quantity("angle from the unbalance at which the race is widest", "rad", ge=-6.3, le=6.3),
    ] = 0.0

    def race_shape(self, c: float, s: float) -> tuple[float, float, float, float]:
        """Return h - R, the place along the tangent, l - R and dl/dtheta [m], at normal (c, s)."""
        two = 2.0 * self.lobe_angle
        ct, st = cos(two), sin(two)
        wide = (c * c - s * s) * ct + 2.0 * s * c * st
        skew = 2.0 * s * c * ct - (c * c - s * s) * st
        beyond = self.lobe * wide + self.offset_1 * c + self.offset_2 * s
        across = -2.0 * self.lobe * skew - self.offset_1 * s + self.offset_2 * c
        return (beyond, across, -3.0 * self.lobe * wide, 6.0 * self.lobe * skew)

    def race_arc(self, theta: float) -> float:
        """Return the length along the race up to theta, less R theta [m]."""
        return -1.5 * self.lobe * sin(2.0 * (theta - self.lobe_angle))

    def check_scene(self, scene: "Scene") -> None:
        """Refuse a race that is not convex, or that does not go around the shaft."""
        R, most = scene.race.radius, scene.race.radius / 4
        for key in ("offset_1", "offset_2", "lobe"):
            value = getattr(self, key)
            if abs(value) > most:
                raise ValueError(
                    f"effects.race_runout.{key} = {exact(value)} m: must be at most a quarter of "
                    f"race.radius = {exact(R)} m, so that the race is convex and goes around "
                    "the shaft"
                )
