"""The spindle's angular acceleration, as the bodies feel it."""

from typing import NamedTuple

from ab_sim.scene.registry import register


@register(
    "spindle_acceleration",
    equation="M0 e psi'' across the unbalance; (m h - I/a) psi'' on each ball",
    source="thesis (2-9)..(2-11)",
)
class SpindleAcceleration(NamedTuple):
    """Non-stationary spindle: the terms with psi'' act on unbalance and balls.

    Without it the speed still follows its profile, but as if it changed infinitely slowly.
    """

    def spindle_acceleration(self, acceleration: float) -> float:
        return acceleration
