"""Event functions, which become negative when a branch of a set-valued law ends.

Each law has *event functions*: smooth functions of the motion that are not negative while its
branch holds. An event is a time at which one of them reaches zero; ``location`` finds it. The
slots for n balls are:

    SLIDE    Sliding ball: path speed in the direction of sliding. Stuck ball: margin of friction
             against being pushed back, summed over it and the stuck balls behind that touch it.
    HOLD     Stuck ball: margin of friction against being pushed forward, summed over it and the
             stuck balls ahead that touch it. A ball that is not loaded has no friction, but can
             be stuck between others.
    LOAD     Loaded ball: normal force of the race. Ball that is not loaded: its negative.
    TOUCH    Balls apart: distance between them. Joined balls: their push on each other.
    MOTOR    Two slots. Below its limit: margins of torque to both limits. At its limit: commanded
             torque beyond it.
"""

from ab_sim.engine.compiling.kinds import Floats
from ab_sim.engine.events.balls import (
    ROUNDING,
    around,
    ball_at,
    gap_between,
    is_stuck,
    largest_friction,
    path_speed,
    put_pushes,
    row_start,
)
from ab_sim.engine.events.run import COMMANDED, MOST, PULL, SIZE, BallEvents, Run
from ab_sim.model.dynamics.system import DIRECTION, JOINED, LOADED, SPACING

SLIDE, HOLD, LOAD, TOUCH, MOTOR = 0, 1, 2, 3, 4
"""Kinds of slots. The slot is kind times n, plus the ball (TOUCH: the contact); the motor's two
come last."""
NEVER = 1e300
"""Value of a function whose event is impossible, and rate of a function without an exact rate."""
TOUCHING = 1e-12
"""Bound of a gap's rounding error, relative to the distance of the balls' centres. The gap is
computed to about 1e-14."""
RATE_ROUNDING = 1e-14
"""Bound of a rate's rounding error [rad/s]."""


def slots(balls: int) -> int:
    """Return the number of event functions for a number of balls, including a motor's."""
    return MOTOR * balls + 2


def event_functions(
    balls: BallEvents, state: Floats, slope: Floats, value: Floats, rounding: Floats, rate: Floats
) -> None:
    """Compute all event functions at a state, right after ``evaluate`` there.

    Parameters
    ----------
    balls
        Balls with the results of the evaluation.
    state
        State of the system.
    slope
        Time derivative of the state.
    value
        Output, values of the functions, shape (slots,). Slots of laws that the scene does not have
        keep their initial value NEVER.
    rounding
        Output, bounds of the values' rounding errors, same shape.
    rate
        Output, time derivatives of functions that are speeds or distances, same shape; NEVER for
        forces.
    """
    if balls.has_friction:
        _friction_functions(balls, state, slope, value, rounding, rate)
        if balls.has_contact:
            _add_leaning_balls(balls, value, rounding)
    if balls.has_contact:
        put_pushes(balls)
        _contact_functions(balls, state, value, rounding, rate)
    if balls.has_motor:
        motor_functions(balls, value, rounding)


def evaluate_at_start(run: Run) -> None:
    """Compute all event functions at a step's start, right after ``evaluate`` there.

    Rates of forces are marked as not measured.
    """
    work = run.work
    event_functions(run.balls, run.state, work.slope, work.value, work.rounding, work.rate)
    work.measured[0] = 0.0


def _friction_functions(
    balls: BallEvents, state: Floats, slope: Floats, value: Floats, rounding: Floats, rate: Floats
) -> None:
    """Compute SLIDE, HOLD and LOAD for each ball, without the balls that lean on it."""
    n, first = balls.number, balls.first_rate
    for i in range(n):
        force, direction = balls.force[i], balls.discrete[i, DIRECTION]
        loaded = balls.discrete[i, LOADED] == 1
        pull, coarse = balls.table[PULL, i], ROUNDING * balls.table[SIZE, i]
        value[LOAD * n + i] = force if loaded else -force
        rounding[LOAD * n + i] = coarse
        if direction == 0:
            margin = largest_friction(balls, i)
            value[SLIDE * n + i] = margin + pull
            value[HOLD * n + i] = margin - pull
            rate[SLIDE * n + i] = NEVER
            rounding[SLIDE * n + i] = rounding[HOLD * n + i] = coarse
            continue
        value[HOLD * n + i] = NEVER
        rounding[HOLD * n + i] = 0.0
        value[SLIDE * n + i] = direction * state[first + i] if loaded else NEVER
        rate[SLIDE * n + i] = direction * slope[first + i] if loaded else NEVER
        rounding[SLIDE * n + i] = RATE_ROUNDING


def _add_leaning_balls(balls: BallEvents, value: Floats, rounding: Floats) -> None:
    """Add the margins of stuck balls that touch, as a push on one is passed on to the next.

    SLIDE sums the margins from behind, HOLD those from ahead: a row of stuck balls moves only if
    the friction of all its balls is exceeded.
    """
    n, begin = balls.number, row_start(balls)
    for step in range(n - 1):
        k = around(balls, begin + step)
        if _leans(balls, k):
            behind, here = SLIDE * n + ball_at(balls, k), SLIDE * n + ball_at(balls, k + 1)
            value[here] += value[behind]
            rounding[here] += rounding[behind]
        k = around(balls, begin + n - 2 - step)
        if _leans(balls, k):
            here, ahead = HOLD * n + ball_at(balls, k), HOLD * n + ball_at(balls, k + 1)
            value[here] += value[ahead]
            rounding[here] += rounding[ahead]


def _leans(balls: BallEvents, k: int) -> bool:
    """Return whether the balls at contact k touch and both stick."""
    if balls.discrete[k, JOINED] == 0:
        return False
    return is_stuck(balls, ball_at(balls, k)) and is_stuck(balls, ball_at(balls, k + 1))


def _contact_functions(
    balls: BallEvents, state: Floats, value: Floats, rounding: Floats, rate: Floats
) -> None:
    """Compute TOUCH: gaps of balls apart, pushes between joined balls."""
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
    """Compute MOTOR: margins of torque, or torque beyond the limit."""
    commanded, most, slot = balls.motor[COMMANDED], balls.motor[MOST], MOTOR * balls.number
    limited = balls.discrete[balls.number, DIRECTION]
    if limited == 0:
        value[slot] = most + commanded
        value[slot + 1] = most - commanded
    else:
        value[slot] = limited * commanded - most
        value[slot + 1] = NEVER
    rounding[slot] = rounding[slot + 1] = ROUNDING * (most + abs(commanded))
