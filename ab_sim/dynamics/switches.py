"""When the branch of a set-valued law that is in force stops being the right one.

Each law keeps *margins*: smooth functions of the motion that are not negative while its branch
holds. An event is a margin that reaches zero; integrate/events.py finds when. Slots, for n balls:

    SLIDE    a sliding ball: its path speed the way it slides. A stuck one: the friction that is
             left against being pushed back, for it and the stuck balls behind that it touches.
    HOLD     a stuck ball: the friction left against being pushed forward, with those ahead of it.
             A ball that the race does not carry adds nothing to either, but can be stuck between
             others.
    LOAD     the race's normal force; its opposite while the race does not carry the ball.
    TOUCH    two balls apart: the distance between them. Joined: their push on each other.
    MOTOR    two: torque left below and above; at its limit, torque asked for beyond it.
"""

from math import cos, pi, sin
from typing import Any

import numba
from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import APART, INLINED, only_if
from ab_sim.dynamics.motion import Ball
from ab_sim.dynamics.neighbours import race_length
from ab_sim.dynamics.reactions import pull_at, reactions
from ab_sim.dynamics.rows import moves_along, row_start, sticks
from ab_sim.dynamics.scratch import FORCE, PUSH
from ab_sim.dynamics.system import (
    DIRECTION,
    FIRST_TURNS,
    JOINED,
    LOADED,
    MASS,
    RADIUS,
    SPACING,
    TURNS,
    ball_at,
    ball_count,
    friction_coefficient,
    has_contact,
    has_friction,
    has_motor,
    has_runout,
    loop_torque,
    race_arc,
    race_shape,
    segment_speed,
    torque_limit,
)

SLIDE, HOLD, LOAD, TOUCH, MOTOR = 0, 1, 2, 3, 4
"""Slot = kind times n + ball (TOUCH: contact); the motor's two come last."""
NEVER = 1e300
"""Margin of what cannot happen."""
TOUCHING = 1e-12
"""Part of the distance between two centres that counts as none: it is found to 1e-14 or so."""
ROUNDING = 1e-12
"""Relative size of a margin that may be rounding."""
RATE_GRAIN = 1e-14
"""rad/s, of a rate that may be rounding."""


def slots(system: Any) -> int:
    """How many margins a system has."""
    return 4 * ball_count(system) + 2


@numba.njit(**INLINED)
def coarseness(system, i, A1, A2, pull, scratch):  # type: ignore[no-untyped-def]
    """What of the forces on ball i, ``pull`` along the race, may be rounding [N]."""
    size = system.balls[i, MASS] * (abs(A1) + abs(A2)) + abs(pull)
    if has_friction(system.effects):
        size += abs(scratch[i, FORCE])
    return ROUNDING * size


@numba.njit(**INLINED)
def friction_margins(system, state, modes, A1, A2, al, scratch, margin, grain):  # type: ignore[no-untyped-def]
    """SLIDE, HOLD and LOAD."""
    n = ball_count(system)
    for i in range(n):
        force = scratch[i, FORCE]
        pull = pull_at(system, i, A1, A2, al, scratch)
        coarse = coarseness(system, i, A1, A2, pull, scratch)
        margin[LOAD * n + i] = force if modes[i, LOADED] == 1 else -force
        grain[LOAD * n + i] = coarse
        if modes[i, DIRECTION] == 0:
            left = capacity(system, i, scratch)
            margin[SLIDE * n + i] = left + pull
            margin[HOLD * n + i] = left - pull
            grain[SLIDE * n + i] = grain[HOLD * n + i] = coarse
        elif modes[i, LOADED] == 1:
            margin[SLIDE * n + i] = modes[i, DIRECTION] * state[4 + n + i]
            grain[SLIDE * n + i] = RATE_GRAIN
    if has_contact(system.effects):
        # Stuck balls that touch lean on each other: a push on one is a push on the next.
        begin = row_start(system, modes)
        for place in range(1, n):
            k = (begin + place - 1) % n
            before, here = ball_at(system, k), ball_at(system, (k + 1) % n)
            if leans(system, modes, k):
                margin[SLIDE * n + here] += margin[SLIDE * n + before]
                grain[SLIDE * n + here] += grain[SLIDE * n + before]
        for place in range(n - 2, -1, -1):
            k = (begin + place) % n
            here, ahead = ball_at(system, k), ball_at(system, (k + 1) % n)
            if leans(system, modes, k):
                margin[HOLD * n + here] += margin[HOLD * n + ahead]
                grain[HOLD * n + here] += grain[HOLD * n + ahead]


@numba.njit(**INLINED)
def contact_margins(system, state, modes, A1, A2, al, scratch, margin, grain):  # type: ignore[no-untyped-def]
    """TOUCH."""
    n = system.contacts.shape[0]
    for k in range(n):
        slot = TOUCH * n + k
        if modes[k, JOINED] == 0:
            margin[slot] = gap(system, state, modes, k)
            grain[slot] = TOUCHING * system.contacts[k, SPACING]
        elif moves_along(system, modes, k):
            margin[slot] = scratch[k, PUSH]
            for i in (ball_at(system, k), ball_at(system, (k + 1) % n)):
                pull = pull_at(system, i, A1, A2, al, scratch)
                grain[slot] += coarseness(system, i, A1, A2, pull, scratch)


@numba.njit(**INLINED)
def capacity(system, i, scratch):  # type: ignore[no-untyped-def]
    """Largest friction on ball i [N]."""
    ball = Ball(system.balls[i, MASS], system.balls[i, RADIUS])
    return friction_coefficient(system.effects, ball) * max(scratch[i, FORCE], 0.0)


@numba.njit(**INLINED)
def leans(system, modes, k):  # type: ignore[no-untyped-def]
    """Whether the balls at contact k touch and both stick."""
    if modes[k, JOINED] == 0:
        return False
    return sticks(system, modes, ball_at(system, k)) and sticks(
        system, modes, ball_at(system, (k + 1) % system.contacts.shape[0])
    )


length_between = register_jitable(**INLINED)(race_length)


@register_jitable(**INLINED)
def gap(system: Any, state: Any, modes: Any, k: int) -> float:
    """Distance along the race between the balls at contact k [m]; negative where they overlap."""
    n = system.contacts.shape[0]
    i, j = ball_at(system, k), ball_at(system, (k + 1) % n)
    turns = (modes[j, TURNS] - system.balls[j, FIRST_TURNS]) - (
        modes[i, TURNS] - system.balls[i, FIRST_TURNS]
    )
    if k == n - 1:
        turns += 1.0
    behind, ahead = state[4 + i], state[4 + j]
    apart = length_between(
        system.body.race_radius,
        behind,
        ahead + 2.0 * pi * turns,
        race_arc(system.effects, behind),
        race_arc(system.effects, ahead),
    )
    return float(apart - system.contacts[k, SPACING])


@numba.njit(**INLINED)
def motor_margins(system, place, time, state, modes, margin, grain):  # type: ignore[no-untyped-def]
    """MOTOR."""
    n, effects = ball_count(system), system.effects
    error = segment_speed(place.segment, time) - state[5 + 2 * n]
    asked, most = loop_torque(effects, error, state[6 + 2 * n]), torque_limit(effects)
    if modes[n, DIRECTION] == 0:
        margin[MOTOR * n] = most + asked
        margin[MOTOR * n + 1] = most - asked
    else:
        margin[MOTOR * n] = modes[n, DIRECTION] * asked - most
    grain[MOTOR * n] = grain[MOTOR * n + 1] = ROUNDING * (most + abs(asked))


add_friction_margins = only_if(has_friction, friction_margins)
add_contact_margins = only_if(has_contact, contact_margins)
add_motor_margins = only_if(has_motor, motor_margins)


@numba.njit(**APART)
def margins(system, place, time, state, modes, A1, A2, al, scratch, margin, grain):  # type: ignore[no-untyped-def]
    """All margins at a state, right after ``derivatives`` there.

    Args:
        system, place, time, state, modes, scratch: as for ``derivatives``.
        A1, A2, al: what it returned.
        margin: where the margins go, shape (slots,).
        grain: where it goes what rounding may make of each, same shape.
    """
    margin[:] = NEVER
    grain[:] = 0.0
    reactions(system, A1, A2, al, modes, scratch)
    add_friction_margins(system, state, modes, A1, A2, al, scratch, margin, grain)
    add_contact_margins(system, state, modes, A1, A2, al, scratch, margin, grain)
    add_motor_margins(system, place, time, state, modes, margin, grain)


inlined_margins = numba.njit(**INLINED)(margins.py_func)
"""``margins`` for the two places that see every step."""


@numba.njit(**APART)
def motion_rate(system, state, slope, modes, slot):  # type: ignore[no-untyped-def]
    """Time derivative of a margin that is a speed or a distance; NEVER for forces."""
    n = ball_count(system)
    if has_friction(system.effects) and slot < n and not sticks(system, modes, slot):
        return modes[slot, DIRECTION] * slope[4 + n + slot]
    if has_contact(system.effects) and TOUCH * n <= slot < MOTOR * n:
        k = slot - TOUCH * n
        if modes[k, JOINED] == 0:
            return parting_speed(system, state, k)
    return NEVER


@numba.njit(**INLINED)
def parting_speed(system, state, k):  # type: ignore[no-untyped-def]
    """How fast the balls at contact k part, along the race [m/s]."""
    n = system.contacts.shape[0]
    i, j = ball_at(system, k), ball_at(system, (k + 1) % n)
    return path_speed(system, state, j) - path_speed(system, state, i)


@numba.njit(**INLINED)
def path_speed(system, state, i):  # type: ignore[no-untyped-def]
    """Speed of ball i along the race [m/s]."""
    n = ball_count(system)
    return path_radius(system, state, i) * state[4 + n + i]


@numba.njit(**INLINED)
def path_radius(system, state, i):  # type: ignore[no-untyped-def]
    """Radius of curvature of the race at ball i [m]."""
    if has_runout(system.effects):
        shape = race_shape(system.effects, cos(state[4 + i]), sin(state[4 + i]))
        return system.body.race_radius + shape[2]
    return system.body.race_radius
