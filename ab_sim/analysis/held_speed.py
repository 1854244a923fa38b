"""Equations of motion of a scene at constant spindle speed."""

import numpy as np

from ab_sim.base.errors import InputError, SceneError, exact
from ab_sim.engine.integrate.vector_field import VectorField
from ab_sim.model.dynamics.assemble import start_discrete_state, system_of
from ab_sim.model.dynamics.system import System, has_motor, layout_of
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene.model import Scene

FASTEST = 1e5
"""Largest absolute speed that can be held [rad/s], equal to the limit of scenes."""
SLOWEST = 1e-6
"""Smallest absolute speed other than 0; powers of lower ones are lost in rounding [rad/s]."""
SPEEDS = f"must be a number within +-{FASTEST:g} rad/s, and 0 or at least {SLOWEST:g} in size"


def last_speed(scene: Scene) -> float:
    """Return the final speed of a scene's profile [rad/s]; without a profile, the start speed."""
    if scene.profile is not None and scene.profile.kind == "adaptive":
        return scene.profile.target_speed
    profile = SpeedSchedule.of_scene(scene)
    return float(profile.speed(profile.end))


def as_speed(speed: float | None, scene: Scene) -> float:
    """Return a constant speed [rad/s]; None: the final speed of the scene.

    Raises
    ------
    InputError
        The speed is not a number, or is outside the range of ``SPEEDS``.
    """
    if speed is None:
        return last_speed(scene)
    if not can_be_held(speed):
        raise InputError(f"speed = {exact(speed)}: {SPEEDS}")
    return float(speed)


def can_be_held(speed: float) -> bool:
    """Return whether a speed [rad/s] is in the range of ``SPEEDS``."""
    return speed == 0.0 or SLOWEST <= abs(speed) <= FASTEST


def held(scene: Scene, speed: float, angle: float = 0.0) -> VectorField:
    """Return the equations of motion y' = f(t, y) at one spindle speed, with the Jacobian of f.

    ``model.dynamics.system.has_spindle_angle(field.system)`` is True if f depends on t through the
    spindle angle. Otherwise there can be resting states.

    Parameters
    ----------
    scene
        Scene; its profile is ignored.
    speed
        Spindle speed w [rad/s].
    angle
        Spindle angle psi at t = 0 [rad].

    Raises
    ------
    SceneError
        The spindle's speed is a state of the scene.
    """
    system = system_of(scene)
    if has_motor(system.effects):
        raise SceneError(
            "effects.motor: the spindle's speed follows from the equations and cannot be held; "
            "remove the effect (--set effects.motor=) to analyse a constant speed"
        )
    scheduled = SpeedSchedule.constant(speed, angle).segment_at(0.0)
    return VectorField(system, scheduled, start_discrete_state(scene, system))


def state_scale(system: System, length: float, speed: float) -> np.ndarray:
    """Return magnitudes of the states for scaling residuals and steps, shape (states,).

    Parameters
    ----------
    system
        Equations of motion, which define the states.
    length
        Magnitude of the deck's displacement [m].
    speed
        Spindle speed w [rad/s], of either sign.
    """
    layout = layout_of(system)
    scale = np.ones(layout.size)
    scale[layout.deck] = system.deck_model.scale(length, abs(speed))
    scale[layout.rates] = abs(speed)
    return scale
