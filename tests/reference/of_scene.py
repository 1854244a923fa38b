"""Conversion of a scene to the reference's parameters, so that both simulate the same drive."""

import math
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.reference.deck_model import DeckModel
from tests.reference.deck_params import Ball, Body, DeckParams, Disc, Mount, Race
from tests.reference.model import Model
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
from tests.reference.plant import Array, Plant


def plant_of(scene: Any) -> Plant:
    """Return a scene's plant, in the plane or in space."""
    return Model(params_of(scene)) if scene.deck is None else DeckModel(deck_of(scene))


def params_of(scene: Any) -> Params:
    """Return the parameters of a scene in the plane."""
    effects = scene.effects
    gravity = effects.get("gravity")
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
        runout=_runout(effects),
        friction=_friction(effects),
        spindle=_spindle(scene),
        motor=_motor(effects),
        contact=_contact(scene),
    )


def deck_of(scene: Any) -> DeckParams:
    """Return the parameters of a scene in space."""
    effects, rotor, balls = scene.effects, scene.rotor, scene.balls
    if sorted(balls.races) != [*balls.races]:
        raise ValueError(f"the reference counts balls race by race, not {balls.races}")
    gravity, springs = effects.get("gravity"), effects.get("hardening_suspension")
    drag = effects["viscous_drag"].coefficient if "viscous_drag" in effects else 0.0
    radius, rolls = scene.race.radius, "ball_spin" in effects
    held = [[] for _ in scene.race.heights]
    for m, a, race in zip(balls.masses, balls.radii, balls.races, strict=True):
        held[race].append(Ball(m) if math.isnan(a) else Ball(m, a, 0.4 * m * a**2 * rolls))
    return DeckParams(
        Body(
            scene.total_mass - balls.total_mass - scene.eccentric_mass,
            scene.deck.center,
            _inertia(scene.deck.inertia),
        ),
        Disc(scene.eccentric_mass, rotor.height, rotor.eccentricity, 0.0, _inertia(rotor.inertia)),
        tuple(
            Race(radius, tuple(there), height, drag * radius**2, _runout(effects))
            for height, there in zip(scene.race.heights, held, strict=True)
        ),
        tuple(
            Mount(
                mount.position,
                np.broadcast_to(mount.stiffness, 3),
                np.broadcast_to(mount.damping, 3),
                Rotation.from_rotvec(mount.turned).as_matrix(),
                0.0 if springs is None else springs.cubic_stiffness,
            )
            for mount in scene.mounts
        ),
        (0.0, 0.0, 0.0) if gravity is None else _weight(gravity),
        _spindle(scene),
        _motor(effects),
        _friction(effects),
        _contact(scene),
    )


def _weight(gravity: Any) -> Array:
    """Return gravity [m/s^2]: -Z for a flat disc, turned by the tilt about a level axis."""
    across, along = math.sin(gravity.tilt), -math.cos(gravity.tilt)
    level = math.cos(gravity.direction), math.sin(gravity.direction)
    return gravity.acceleration * np.array([across * level[0], across * level[1], along])


def _inertia(given: Any) -> Array:
    xx, yy, zz, xy, xz, yz = (*given, 0.0, 0.0, 0.0)[:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _runout(effects: Any) -> Runout:
    runout = effects.get("race_runout")
    if runout is None:
        return Runout()
    return Runout((runout.offset_1, runout.offset_2), runout.lobe, runout.lobe_angle)


def _friction(effects: Any) -> Friction:
    rolling, dry = effects.get("rolling_friction"), effects.get("race_friction")
    return Friction(
        0.0 if rolling is None else rolling.arm, 0.0 if dry is None else dry.coefficient
    )


def _spindle(scene: Any) -> Spindle:
    return Spindle(
        scene.start.speed,
        scene.start.angle,
        _segments(scene),
        "spindle_acceleration" in scene.effects,
    )


def _motor(effects: Any) -> Motor | None:
    motor = effects.get("motor")
    if motor is None:
        return None
    return Motor(
        motor.rotor_inertia,
        motor.proportional_gain,
        motor.integral_gain,
        motor.torque_limit,
        motor.back_emf_slope,
    )


def _contact(scene: Any) -> Contact | None:
    touch = scene.effects.get("ball_contact")
    if touch is None or scene.balls.count < 2:
        return None
    return Contact(touch.restitution_coefficient, touch.rest_speed)


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
    """Return the segments of the profile; they do not use those of the drive, to be a check."""
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
