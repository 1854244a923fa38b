"""Balls along the race: neighbours, gaps, rows that move as one, branches, and reaction forces.

Reactions are the forces that the equations of motion do not contain: race on ball, ball on ball.
"""

import math

from ab_sim.engine.compiling.kinds import Floats
from ab_sim.engine.events.run import (
    ALONG,
    COUPLING,
    CURVE,
    FRICTION,
    GRIP,
    INERTIA,
    LOAD,
    PATH_ACCELERATION,
    PATH_FORCE,
    PULL,
    BallEvents,
)
from ab_sim.model.dynamics.system import (
    DIRECTION,
    FIRST_TURNS,
    JOINED,
    LOADED,
    MASS,
    MOBILITY,
    ORDER,
    RACE_RADIUS,
    ROLLING_MASS,
    SPACING,
    TURNS,
)


def around(balls: BallEvents, place: int) -> int:
    """Return a place in the ring of balls modulo n, for places from -n to 2 n - 1."""
    if place >= balls.number:
        return place - balls.number
    return place + balls.number if place < 0 else place


def ball_at(balls: BallEvents, place: int) -> int:
    """Return the ball at a place of the ring, from -n to 2 n - 1."""
    return int(balls.contacts[around(balls, place), ORDER])


def is_stuck(balls: BallEvents, i: int) -> bool:
    """Return whether ball i is at rest on the race, by friction or between other balls."""
    return balls.has_friction and balls.discrete[i, DIRECTION] == 0


def moves_along(balls: BallEvents, k: int) -> bool:
    """Return whether the balls at contact k touch and move together."""
    if not balls.has_contact or balls.discrete[k, JOINED] == 0:
        return False
    return not (is_stuck(balls, ball_at(balls, k)) or is_stuck(balls, ball_at(balls, k + 1)))


def row_start(balls: BallEvents) -> int:
    """Return a place at which a row of joined balls begins; at least one contact is open."""
    for k in range(balls.number):
        if balls.discrete[around(balls, k - 1), JOINED] == 0:
            return k
    return 0


def gap(balls: BallEvents, k: int) -> float:
    """Return the distance along the race between the balls at contact k [m].

    It is negative if they overlap.
    """
    return gap_between(balls, k, ball_at(balls, k), ball_at(balls, k + 1))


def gap_between(balls: BallEvents, k: int, i: int, j: int) -> float:
    """Return the distance along the race between balls i and j, the pair of contact k [m]."""
    discrete, constants = balls.discrete, balls.constants
    turns = (discrete[j, TURNS] - constants[j, FIRST_TURNS]) - (
        discrete[i, TURNS] - constants[i, FIRST_TURNS]
    )
    if k == balls.number - 1:
        turns += 1.0
    apart = balls.table[ALONG, j] - balls.table[ALONG, i]
    apart += 2.0 * math.pi * constants[j, RACE_RADIUS] * turns
    return apart - balls.contacts[k, SPACING]


def path_speed(balls: BallEvents, state: Floats, i: int) -> float:
    """Return the speed of ball i along the race [m/s], from the race's shape in the table."""
    return balls.table[CURVE, i] * state[balls.first_rate + i]


def sign(x: float) -> int:
    """Return the sign of a speed (-1, 0 or 1), the direction in which a ball slides."""
    if x > 0.0:
        return 1
    return -1 if x < 0.0 else 0


def put_branches(balls: BallEvents) -> None:
    """Write the discrete state to ``branches``, from which the scene's functions read it.

    ``branches`` holds the sign of each ball's sliding friction, 0 if it sticks or is not loaded;
    the mobility [1/kg], which is the path acceleration per force; and the direction in which the
    motor is at its limit. Without contact, the mobility is a number per ball. With contact, it is
    a matrix, as a force on a ball accelerates all balls of its row.
    """
    n, b, discrete = balls.number, balls.branches, balls.discrete
    for i in range(n):
        b[i] = float(discrete[i, DIRECTION] * discrete[i, LOADED])
    if balls.has_contact:
        _put_mobility_of_rows(balls)
        b[n + n * n] = float(discrete[n, DIRECTION])
        return
    for i in range(n):
        b[n + i] = 0.0 if is_stuck(balls, i) else balls.constants[i, MOBILITY]
    b[2 * n] = float(discrete[n, DIRECTION])


def _put_mobility_of_rows(balls: BallEvents) -> None:
    """Write the mobility matrix: 1 / (inertia of the row) for two balls of a moving row, else 0."""
    n, b = balls.number, balls.branches
    for entry in range(n, n + n * n):
        b[entry] = 0.0
    begin, place = row_start(balls), 0
    while place < n:
        first, inertia = place, balls.constants[ball_at(balls, begin + place), ROLLING_MASS]
        while place < n - 1 and moves_along(balls, around(balls, begin + place)):
            place += 1
            inertia += balls.constants[ball_at(balls, begin + place), ROLLING_MASS]
        place += 1
        if not is_stuck(balls, ball_at(balls, begin + first)):
            for p in range(first, place):
                line = n + n * ball_at(balls, begin + p)
                for q in range(first, place):
                    b[line + ball_at(balls, begin + q)] = 1.0 / inertia


ROUNDING = 1e-12
"""Bound of a force's rounding error, relative to the magnitude of its terms."""


def put_normal_forces(balls: BallEvents, x: Floats) -> None:
    """Compute ``force``, the race's normal forces, from the accelerations x."""
    press = COUPLING + balls.accelerations
    for i in range(balls.number):
        force = balls.table[LOAD, i]
        for r in range(balls.accelerations):
            force += balls.table[press + r, i] * x[r]
        balls.force[i] = force


def path_force_at(balls: BallEvents, i: int, x: Floats) -> float:
    """Return the force along the race on ball i [N], without neighbours' pushes and friction."""
    pull = balls.table[PATH_FORCE, i]
    for r in range(balls.accelerations):
        pull += balls.table[COUPLING + r, i] * x[r]
    return pull


def path_force_less_friction(balls: BallEvents, i: int, x: Floats) -> float:
    """Return ``path_force_at`` less sliding friction [N]; after ``put_normal_forces``."""
    pull = path_force_at(balls, i, x)
    if balls.has_friction:
        pull -= balls.table[FRICTION, i] * balls.force[i]
    return pull


def force_rounding(balls: BallEvents, i: int, pull: float, x: Floats) -> float:
    """Return the bound of the rounding error of the forces on ball i [N].

    ``pull`` is the force along the race [N], and x are the accelerations of deck and spindle.
    """
    # A deck's tilt acts on a ball through its weight, which is part of the forces.
    size = abs(pull) + balls.constants[i, MASS] * (abs(x[0]) + abs(x[1]))
    if balls.has_friction:
        size += abs(balls.force[i])
    return ROUNDING * size


def largest_friction(balls: BallEvents, i: int) -> float:
    """Return the largest friction force on ball i [N]; after ``put_normal_forces``."""
    return balls.table[GRIP, i] * max(balls.force[i], 0.0)


def put_pushes(balls: BallEvents) -> None:
    """Compute ``push``, the forces between balls in contact, right after ``evaluate``."""
    begin, push = row_start(balls), 0.0
    for place in range(balls.number):
        k = around(balls, begin + place)
        if balls.discrete[k, JOINED] == 0:
            push = balls.push[k] = 0.0
            continue
        if moves_along(balls, k):
            # The push from behind, plus the part of the ball's own force that is not needed for
            # its acceleration, is passed on to the next ball.
            i = ball_at(balls, k)
            push += balls.table[PULL, i]
            push -= balls.table[INERTIA, i] * balls.table[PATH_ACCELERATION, i]
        else:
            push = 0.0
        balls.push[k] = push
