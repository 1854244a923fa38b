"""How the spindle moves: as its speed profile says, or as a motor drives it."""

import numba

from ab_sim.dynamics.dispatch import INLINED, chosen_by
from ab_sim.dynamics.layout import integral_at, spindle_angle_at, spindle_speed_at
from ab_sim.dynamics.motion import Spindle
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.race.margins import ASKED, MOST, SPEED
from ab_sim.dynamics.system import (
    DIRECTION,
    back_torque,
    ball_count,
    felt_acceleration,
    has_events,
    has_motor,
    has_spindle_angle,
    integral_rate,
    loop_torque,
    segment_acceleration,
    segment_angle,
    segment_speed,
    torque_limit,
)


@numba.njit(**INLINED)
def _prescribed(plant, time, state):  # type: ignore[no-untyped-def]
    system, place = plant.system, plant.place
    speed = segment_speed(place.segment, time)
    acceleration = felt_acceleration(system.effects, segment_acceleration(place.segment, time))
    c, s = 1.0, 0.0
    if has_spindle_angle(system):
        c, s = cos_sin(place.phase + segment_angle(place.segment, time))
    if has_events(system.effects):
        plant.room.motor[SPEED] = speed
    return Spindle(speed, acceleration, c, s, 0.0, 0.0)


@numba.njit(**INLINED)
def _driven(plant, time, state):  # type: ignore[no-untyped-def]
    system, effects = plant.system, plant.system.effects
    n = ball_count(system)
    psi, speed = state[spindle_angle_at(system)], state[spindle_speed_at(system)]
    error = segment_speed(plant.place.segment, time) - speed
    asked = given = loop_torque(effects, error, state[integral_at(system)])
    most = torque_limit(effects)
    if plant.modes[n, DIRECTION] != 0:
        given = plant.modes[n, DIRECTION] * most
    rate = integral_rate(effects, error, asked - given)
    torque = given - back_torque(effects, speed)
    c, s = 1.0, 0.0
    if has_spindle_angle(system):
        c, s = cos_sin(psi)
    plant.room.motor[ASKED] = asked
    plant.room.motor[MOST] = most
    plant.room.motor[SPEED] = speed
    return Spindle(speed, 0.0, c, s, torque, rate)


spindle_motion = chosen_by(has_motor, _driven, _prescribed)
"""The Spindle at a state; ``(plant, time, state)``, local time in the speed segment [s]."""
