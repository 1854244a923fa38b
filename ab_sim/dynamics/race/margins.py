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

from typing import Any

from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import APART, INLINED, holds, number_of
from ab_sim.dynamics.race.elimination import moves_along, row_start, sticks
from ab_sim.dynamics.race.race import Race, around, ball_at, gap, path_speed
from ab_sim.dynamics.race.reactions import reactions, rubbed_pull_at
from ab_sim.dynamics.race.table import FORCE, GRIP, PUSH
from ab_sim.dynamics.system import DIRECTION, JOINED, LOADED, MASS, SPACING

SLIDE, HOLD, LOAD, TOUCH, MOTOR = 0, 1, 2, 3, 4
"""Slot = kind times n + ball (TOUCH: contact); the motor's two come last."""
NEVER = 1e300
"""Margin of what cannot happen."""
TOUCHING = 1e-12
"""Part of the distance between two centres that counts as none: it is found to 1e-14 or so."""
ROUNDING = 1e-12
"""Relative size of a margin that may be rounding."""
RATE_ROUNDING = 1e-14
"""rad/s, of a rate that may be rounding."""
ASKED, MOST, SPEED = 0, 1, 2
"""Entries of ``Room.motor``."""


@register_jitable(**INLINED)
def slots(balls: int) -> int:
    """How many margins a number of balls has, with those of a motor."""
    return MOTOR * balls + 2


@register_jitable(**INLINED)
def force_rounding(race: Race, i: int, x: Any, pull: float) -> Any:
    """What of the forces on ball i, ``pull`` along the race, may be rounding [N]."""
    size = abs(pull)
    # What tilts a carrier acts through its weight at the ball, which is in the forces.
    size += race.balls[i, MASS] * (abs(x[0]) + abs(x[1]))
    if holds(race.rubs):
        size += abs(race.room.table[i, FORCE])
    return ROUNDING * size


@register_jitable(**INLINED)
def friction_margins(
    race: Race, state: Any, slope: Any, margin: Any, rounding: Any, rate: Any
) -> None:
    """SLIDE, HOLD and LOAD."""
    n, table, modes, x = number_of(race.number), race.room.table, race.modes, race.room.acceleration
    for i in range(n):
        force = table[i, FORCE]
        pull = rubbed_pull_at(race, i, x)
        coarse = force_rounding(race, i, x, pull)
        margin[LOAD * n + i] = force if modes[i, LOADED] == 1 else -force
        rounding[LOAD * n + i] = coarse
        if modes[i, DIRECTION] == 0:
            left = capacity(race, i)
            margin[SLIDE * n + i] = left + pull
            margin[HOLD * n + i] = left - pull
            rounding[SLIDE * n + i] = rounding[HOLD * n + i] = coarse
        elif modes[i, LOADED] == 1:
            margin[SLIDE * n + i] = modes[i, DIRECTION] * state[race.first_rate + i]
            rounding[SLIDE * n + i] = RATE_ROUNDING
            rate[SLIDE * n + i] = modes[i, DIRECTION] * slope[race.first_rate + i]
    if holds(race.meets):
        # Stuck balls that touch lean on each other: a push on one is a push on the next.
        begin = row_start(race)
        for place in range(1, n):
            k = around(race, begin + place - 1)
            before, here = ball_at(race, k), ball_at(race, around(race, k + 1))
            if leans(race, k):
                margin[SLIDE * n + here] += margin[SLIDE * n + before]
                rounding[SLIDE * n + here] += rounding[SLIDE * n + before]
        for place in range(n - 2, -1, -1):
            k = around(race, begin + place)
            here, ahead = ball_at(race, k), ball_at(race, around(race, k + 1))
            if leans(race, k):
                margin[HOLD * n + here] += margin[HOLD * n + ahead]
                rounding[HOLD * n + here] += rounding[HOLD * n + ahead]


@register_jitable(**INLINED)
def contact_margins(race: Race, state: Any, margin: Any, rounding: Any, rate: Any) -> None:
    """TOUCH."""
    n, x = number_of(race.number), race.room.acceleration
    for k in range(n):
        slot = TOUCH * n + k
        if race.modes[k, JOINED] == 0:
            i, j = ball_at(race, k), ball_at(race, around(race, k + 1))
            margin[slot] = gap(race, k)
            rounding[slot] = TOUCHING * race.contacts[k, SPACING]
            rate[slot] = path_speed(race, state, j) - path_speed(race, state, i)
        elif moves_along(race, k):
            margin[slot] = race.room.table[k, PUSH]
            for i in (ball_at(race, k), ball_at(race, around(race, k + 1))):
                rounding[slot] += force_rounding(race, i, x, rubbed_pull_at(race, i, x))


@register_jitable(**INLINED)
def capacity(race: Race, i: int) -> Any:
    """Largest friction on ball i [N]."""
    return race.room.table[i, GRIP] * max(race.room.table[i, FORCE], 0.0)


@register_jitable(**INLINED)
def leans(race: Race, k: int) -> bool:
    """Whether the balls at contact k touch and both stick."""
    if race.modes[k, JOINED] == 0:
        return False
    return sticks(race, ball_at(race, k)) and sticks(race, ball_at(race, around(race, k + 1)))


@register_jitable(**INLINED)
def motor_margins(race: Race, margin: Any, rounding: Any) -> None:
    """MOTOR."""
    n = number_of(race.number)
    asked, most = race.room.motor[ASKED], race.room.motor[MOST]
    if race.modes[n, DIRECTION] == 0:
        margin[MOTOR * n] = most + asked
        margin[MOTOR * n + 1] = most - asked
    else:
        margin[MOTOR * n] = race.modes[n, DIRECTION] * asked - most
    rounding[MOTOR * n] = rounding[MOTOR * n + 1] = ROUNDING * (most + abs(asked))


@register_jitable(**APART)
def margins(race: Race, state: Any, slope: Any, margin: Any, rounding: Any, rate: Any) -> None:
    """All margins at a state, right after an evaluation of the equations there.

    Args:
        race: the balls.
        state: the state.
        slope: its time derivative.
        margin: where the margins go, shape (slots,).
        rounding: where it goes what rounding may make of each, same shape.
        rate: where the time derivatives go of those that are speeds or distances; NEVER for
            forces. Same shape.
    """
    for slot in range(margin.size):
        margin[slot] = NEVER
        rounding[slot] = 0.0
        rate[slot] = NEVER
    reactions(race)
    if holds(race.rubs):
        friction_margins(race, state, slope, margin, rounding, rate)
    if holds(race.meets):
        contact_margins(race, state, margin, rounding, rate)
    if holds(race.driven):
        motor_margins(race, margin, rounding)
