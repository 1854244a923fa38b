"""Balls along the race: neighbours, gaps, rows that move as one, and what a scene is told of it."""

import math

from ab_sim.compiling.kinds import Floats
from ab_sim.dynamics.system import (
    DIRECTION,
    FIRST_TURNS,
    JOINED,
    LOADED,
    MOBILITY,
    ORDER,
    RACE_RADIUS,
    ROLLING_MASS,
    SPACING,
    TURNS,
)
from ab_sim.events.run import ALONG, CURVE, BallEvents


def around(balls: BallEvents, place: int) -> int:
    """The same place of the row, which closes in itself, from -n .. 2 n - 1."""
    if place >= balls.number:
        return place - balls.number
    return place + balls.number if place < 0 else place


def ball_at(balls: BallEvents, place: int) -> int:
    """The ball at a place of the row, from -n .. 2 n - 1."""
    return int(balls.contacts[around(balls, place), ORDER])


def is_stuck(balls: BallEvents, i: int) -> bool:
    """Whether ball i does not move along the race: by friction, or held between others."""
    return balls.has_friction and balls.discrete[i, DIRECTION] == 0


def moves_along(balls: BallEvents, k: int) -> bool:
    """Whether the balls at contact k touch and move together."""
    if not balls.has_contact or balls.discrete[k, JOINED] == 0:
        return False
    return not (is_stuck(balls, ball_at(balls, k)) or is_stuck(balls, ball_at(balls, k + 1)))


def row_start(balls: BallEvents) -> int:
    """A place at which a row of joined balls begins: no more than n - 1 contacts are closed."""
    for k in range(balls.number):
        if balls.discrete[around(balls, k - 1), JOINED] == 0:
            return k
    return 0


def gap(balls: BallEvents, k: int) -> float:
    """Distance along the race between the balls at contact k [m]; negative where they overlap."""
    return gap_between(balls, k, ball_at(balls, k), ball_at(balls, k + 1))


def gap_between(balls: BallEvents, k: int, i: int, j: int) -> float:
    """The same, of the balls i and j there."""
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
    """Speed of ball i along the race [m/s], where the table holds the race's shape at it."""
    return balls.table[CURVE, i] * state[balls.first_rate + i]


def sign(x: float) -> int:
    """-1, 0 or 1: the direction in which a ball with this speed slides."""
    if x > 0.0:
        return 1
    return -1 if x < 0.0 else 0


def put_branches(balls: BallEvents) -> None:
    """Tell the scene what the discrete state is.

    ``branches`` holds the sign of each ball's sliding friction, 0 if it sticks or is not loaded;
    what a force on a ball makes of path accelerations [1/kg], of each ball by itself without
    contact, and with contact as a matrix, of all balls that move in one row; and the direction in
    which the motor gives all it can.
    """
    n, b, discrete = balls.number, balls.branches, balls.discrete
    for i in range(n):
        b[i] = float(discrete[i, DIRECTION] * discrete[i, LOADED])
    if balls.has_contact:
        put_mobility_of_rows(balls)
        b[n + n * n] = float(discrete[n, DIRECTION])
        return
    for i in range(n):
        b[n + i] = 0.0 if is_stuck(balls, i) else balls.constants[i, MOBILITY]
    b[2 * n] = float(discrete[n, DIRECTION])


def put_mobility_of_rows(balls: BallEvents) -> None:
    """1 / (the row's inertia) of any two balls in the same row that moves, else 0."""
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
