"""When the branch of a set-valued law that is in force stops being the right one.

Each law has *event functions*: smooth functions of the motion that are not negative while its
branch holds. An event is one that reaches zero; ``location`` finds when. Slots, for n balls:

    SLIDE    a sliding ball: its path speed the way it slides. A stuck one: the friction that is
             left against being pushed back, for it and the stuck balls behind that it touches.
    HOLD     a stuck ball: the friction left against being pushed forward, with those ahead of it.
             A ball that the race does not carry adds nothing to either, but can be stuck between
             others.
    LOAD     the race's normal force; its opposite while the race does not carry the ball.
    TOUCH    two balls apart: the distance between them. Joined: their push on each other.
    MOTOR    two: torque left below and above; at its limit, torque asked for beyond it.
"""

from ab_sim.compiling.kinds import Floats
from ab_sim.dynamics.system import DIRECTION, JOINED, LOADED, SPACING
from ab_sim.events.balls import (
    around,
    ball_at,
    gap_between,
    is_stuck,
    path_speed,
    row_start,
)
from ab_sim.events.reactions import ROUNDING, largest_friction, put_pushes
from ab_sim.events.run import ASKED, MOST, PULL, SIZE, BallEvents, Run

SLIDE, HOLD, LOAD, TOUCH, MOTOR = 0, 1, 2, 3, 4
"""Slot = kind times n + ball (TOUCH: contact); the motor's two come last."""
NEVER = 1e300
"""Value of what cannot happen."""
TOUCHING = 1e-12
"""Part of the distance between two centres that counts as none: it is found to 1e-14 or so."""
RATE_ROUNDING = 1e-14
"""rad/s, of a rate that may be rounding."""


def slots(balls: int) -> int:
    """How many event functions a number of balls has, with those of a motor."""
    return MOTOR * balls + 2


def event_functions(
    balls: BallEvents, state: Floats, slope: Floats, value: Floats, rounding: Floats, rate: Floats
) -> None:
    """All of them at a state, right after ``evaluate`` there.

    Args:
        balls: with what the evaluation said.
        state: the state.
        slope: its time derivative.
        value: where they go, shape (slots,); NEVER where there is no such law, as it was made.
        rounding: where it goes what rounding may make of each, same shape.
        rate: where the time derivatives go of those that are speeds or distances; NEVER for
            forces. Same shape.
    """
    if balls.has_friction:
        friction_functions(balls, state, slope, value, rounding, rate)
        if balls.has_contact:
            add_leaning_balls(balls, value, rounding)
    if balls.has_contact:
        put_pushes(balls)
        contact_functions(balls, state, value, rounding, rate)
    if balls.has_motor:
        motor_functions(balls, value, rounding)


def look_at_start(run: Run) -> None:
    """All of them at a step's start, right after ``evaluate`` there; of forces no rates yet."""
    work = run.work
    event_functions(run.balls, run.state, work.slope, work.value, work.rounding, work.rate)
    work.measured[0] = 0.0


def friction_functions(
    balls: BallEvents, state: Floats, slope: Floats, value: Floats, rounding: Floats, rate: Floats
) -> None:
    """SLIDE, HOLD and LOAD, each ball by itself."""
    n, first = balls.number, balls.first_rate
    for i in range(n):
        force, direction = balls.force[i], balls.discrete[i, DIRECTION]
        loaded = balls.discrete[i, LOADED] == 1
        pull, coarse = balls.table[PULL, i], ROUNDING * balls.table[SIZE, i]
        value[LOAD * n + i] = force if loaded else -force
        rounding[LOAD * n + i] = coarse
        if direction == 0:
            left = largest_friction(balls, i)
            value[SLIDE * n + i] = left + pull
            value[HOLD * n + i] = left - pull
            rate[SLIDE * n + i] = NEVER
            rounding[SLIDE * n + i] = rounding[HOLD * n + i] = coarse
            continue
        value[HOLD * n + i] = NEVER
        rounding[HOLD * n + i] = 0.0
        value[SLIDE * n + i] = direction * state[first + i] if loaded else NEVER
        rate[SLIDE * n + i] = direction * slope[first + i] if loaded else NEVER
        rounding[SLIDE * n + i] = RATE_ROUNDING


def add_leaning_balls(balls: BallEvents, value: Floats, rounding: Floats) -> None:
    """Stuck balls that touch lean on each other: a push on one is a push on the next."""
    n, begin = balls.number, row_start(balls)
    for step in range(n - 1):
        k = around(balls, begin + step)
        if leans(balls, k):
            behind, here = SLIDE * n + ball_at(balls, k), SLIDE * n + ball_at(balls, k + 1)
            value[here] += value[behind]
            rounding[here] += rounding[behind]
        k = around(balls, begin + n - 2 - step)
        if leans(balls, k):
            here, ahead = HOLD * n + ball_at(balls, k), HOLD * n + ball_at(balls, k + 1)
            value[here] += value[ahead]
            rounding[here] += rounding[ahead]


def leans(balls: BallEvents, k: int) -> bool:
    """Whether the balls at contact k touch and both stick."""
    if balls.discrete[k, JOINED] == 0:
        return False
    return is_stuck(balls, ball_at(balls, k)) and is_stuck(balls, ball_at(balls, k + 1))


def contact_functions(
    balls: BallEvents, state: Floats, value: Floats, rounding: Floats, rate: Floats
) -> None:
    """TOUCH."""
    j = ball_at(balls, 0)
    for k in range(balls.number):
        slot, i = TOUCH * balls.number + k, j
        j = ball_at(balls, k + 1)
        if balls.discrete[k, JOINED] == 0:
            value[slot] = gap_between(balls, k, i, j)
            rounding[slot] = TOUCHING * balls.contacts[k, SPACING]
            rate[slot] = path_speed(balls, state, j) - path_speed(balls, state, i)
        else:
            stuck = is_stuck(balls, i) or is_stuck(balls, j)
            value[slot] = NEVER if stuck else balls.push[k]
            rate[slot] = NEVER
            rounding[slot] = ROUNDING * (balls.table[SIZE, i] + balls.table[SIZE, j])


def motor_functions(balls: BallEvents, value: Floats, rounding: Floats) -> None:
    """MOTOR."""
    asked, most, slot = balls.motor[ASKED], balls.motor[MOST], MOTOR * balls.number
    limited = balls.discrete[balls.number, DIRECTION]
    if limited == 0:
        value[slot] = most + asked
        value[slot + 1] = most - asked
    else:
        value[slot] = limited * asked - most
        value[slot + 1] = NEVER
    rounding[slot] = rounding[slot + 1] = ROUNDING * (most + abs(asked))
