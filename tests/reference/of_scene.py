"""From a scene to the reference's parameters, so that both simulate the same drive."""

import math
from typing import Any

from tests.reference.params import (
    Contact,
    Friction,
    Motor,
    Params,
    Runout,
    Spindle,
    Suspension,
    Swing,
)


def params_of(scene: Any) -> Params:
    """The parameters of a scene."""
    effects = scene.effects
    gravity = effects.get("gravity")
    runout = effects.get("race_runout")
    rolling, dry = effects.get("rolling_friction"), effects.get("race_friction")
    touch, motor = effects.get("ball_contact"), effects.get("motor")
    n = scene.balls.count
    return Params(
        mass=scene.total_mass,
        suspension=_suspension(effects),
        eccentricity=scene.rotor.eccentricity,
        race_radius=scene.race.radius,
        ball_masses=scene.balls.masses,
        ball_radii=tuple(1e-3 if math.isnan(a) else a for a in scene.balls.radii),
        unbalance_mass=scene.eccentric_mass,
        drag=effects["viscous_drag"].coefficient if "viscous_drag" in effects else 0.0,
        spin="ball_spin" in effects,
        gravity=(0.0, 0.0) if gravity is None else gravity.gravity(),
        runout=Runout()
        if runout is None
        else Runout((runout.offset_1, runout.offset_2), runout.lobe, runout.lobe_angle),
        friction=Friction(
            0.0 if rolling is None else rolling.arm, 0.0 if dry is None else dry.coefficient
        ),
        spindle=Spindle(
            scene.start.speed,
            scene.start.angle,
            _segments(scene),
            "spindle_acceleration" in effects,
        ),
        motor=None
        if motor is None
        else Motor(
            motor.rotor_inertia,
            motor.proportional_gain,
            motor.integral_gain,
            motor.torque_limit,
            motor.back_emf_slope,
        ),
        contact=None
        if touch is None or n < 2
        else Contact(touch.restitution_coefficient, touch.rest_speed),
    )


def _suspension(effects: Any) -> Suspension:
    cubic = 0.0
    if "hardening_suspension" in effects:
        cubic = effects["hardening_suspension"].cubic_stiffness
    if "unequal_suspension" in effects:
        s = effects["unequal_suspension"]
        return Suspension(
            s.stiffness_1, s.stiffness_2, s.damping_1, s.damping_2, s.axis_angle, cubic
        )
    if "suspension" in effects:
        s = effects["suspension"]
        return Suspension(s.stiffness, s.stiffness, s.damping, s.damping, 0.0, cubic)
    return Suspension(0.0, 0.0, cubic=cubic)


def _segments(scene: Any) -> tuple[tuple[float, float] | Swing, ...]:
    """As the reference wants them; the drive's own pieces would be no check."""
    profile = scene.profile
    if profile is None:
        return ()
    if profile.kind == "speed_change":
        change = profile.to_speed - scene.start.speed
        return ((profile.start_time, 0.0), Swing(profile.duration, change))
    first, slope, last = scene.start.speed, profile.acceleration, profile.target_speed
    period = profile.variable_speed_period
    if period is None:
        return (((last - first) / slope, slope),)
    begins = period.start_time
    if begins is None:
        begins = (period.start_speed - first) / slope
    after = first + slope * begins + period.acceleration * period.duration
    return (
        (begins, slope),
        (period.duration, period.acceleration),
        ((last - after) / slope, slope),
    )
