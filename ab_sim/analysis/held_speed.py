"""A scene's equations of motion while its spindle's speed is held for ever."""

from ab_sim.dynamics.assemble import start_discrete_state, system_of
from ab_sim.dynamics.system import has_motor
from ab_sim.errors import SceneError
from ab_sim.integrate.vector_field import VectorField
from ab_sim.scene.model import Scene
from ab_sim.spindle import SpeedSchedule

FASTEST = 1e5
"""Speed that can be held, as that of scenes [rad/s]."""


def last_speed(scene: Scene) -> float:
    """At which a scene's profile ends [rad/s]; of one without, its start's."""
    if scene.profile is not None and scene.profile.kind == "adaptive":
        return scene.profile.target_speed
    profile = SpeedSchedule.of_scene(scene)
    return float(profile.speed(profile.end))


def held(scene: Scene, speed: float, angle: float = 0.0) -> VectorField:
    """f of y' = f(t, y) at one spindle speed, and its exact Jacobian.

    ``dynamics.system.has_spindle_angle(field.system)`` says whether the spindle's angle stays in
    the equations; where not, f does not depend on t, and states can rest.

    Args:
        scene: what moves; its profile does not matter.
        speed: w [rad/s].
        angle: psi at t = 0 [rad].

    Raises:
        SceneError: the spindle's speed is a state of the scene.
    """
    system = system_of(scene)
    if has_motor(system.effects):
        raise SceneError(
            "effects.motor: with it the spindle's speed follows from the equations and cannot be "
            "held; take it out (--set effects.motor=) to ask what happens at a speed"
        )
    scheduled = SpeedSchedule.constant(speed, angle).segment_at(0.0)
    return VectorField(system, scheduled, start_discrete_state(scene, system))
