"""Inertia forces of the spindle's angular acceleration."""

from typing import NamedTuple

from ab_sim.scene.registry import register


@register(
    "spindle_acceleration",
    equation="M0 e psi'' across the unbalance; (m h - I/a) psi'' on each ball",
    source="thesis (2-9)..(2-11)",
)
class SpindleAcceleration(NamedTuple):
    """Inertia terms with the spindle's acceleration psi'', on unbalance and balls.

    Without this effect, the speed still follows its profile, but these terms are omitted, as if the
    speed changed infinitely slowly.
    """

    def spindle_acceleration(self, acceleration: float) -> float:
        return acceleration
