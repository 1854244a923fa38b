"""What kernels write of each step: a sample but for its sensors' readings."""

from math import pi
from typing import Any

import numba
from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.layout import angle_at, rate_at, spindle_angle_at, spindle_speed_at
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.spindle_motion import spindle_motion
from ab_sim.dynamics.system import (
    TURNS,
    Place,
    System,
    ball_count,
    channel_count,
    has_motor,
    segment_angle,
    segment_speed,
    show,
)

STEP, TIME, ANGLE, SPEED, COMMAND, CARRIER = range(6)
"""Columns of a sample: how many steps have been taken; time [s]; angle and speed of the spindle
[rad, rad/s]; the speed asked for; the first of the carrier's channels. Behind these are each ball's
angle and rate, and a motor's torque; sensors' readings are the caller's."""


@register_jitable(**INLINED)
def row_width(system: System) -> int:
    """How many columns a kernel computes: those of a *row*, which is a sample from ANGLE on."""
    spindle, motor = CARRIER - ANGLE, int(has_motor(system.effects))
    return int(spindle + channel_count(system.carrier) + 2 * ball_count(system) + motor)


@register_jitable(**INLINED)
def along(place: Place, time: Any) -> Any:
    """Angle and speed that the profile has at a local time [s]."""
    angle = place.angle + segment_angle(place.segment, time)
    return angle, segment_speed(place.segment, time)


@numba.njit(**INLINED)
def record(plant, profile, time, state, row):  # type: ignore[no-untyped-def]
    """One row, right after ``evaluate``.

    Args:
        plant: the Plant.
        profile: angle and speed along the profile, see ``along``.
        time: local time [s].
        state: the state, in whose angles whole turns may be left out.
        row: where it goes.
    """
    system, modes = plant.system, plant.modes
    n, first = ball_count(system), CARRIER - ANGLE
    spindle = spindle_motion(plant, time, state)
    angle, command = profile
    row[0], row[1], row[2] = angle, command, command
    if has_motor(system.effects):
        at = spindle_angle_at(system)
        angle = state[at] + 2.0 * pi * modes[n, TURNS]
        row[0], row[1] = angle, state[spindle_speed_at(system)]
    c, s = cos_sin(angle)
    show(system.carrier, plant, spindle, c, s, state, plant.room.acceleration, row[first:])
    balls = first + channel_count(system.carrier)
    for i in range(n):
        row[balls + 2 * i] = state[angle_at(system, i)] + 2.0 * pi * modes[i, TURNS]
        row[balls + 2 * i + 1] = state[rate_at(system, i)]
    if has_motor(system.effects):
        row[balls + 2 * n] = spindle.torque
