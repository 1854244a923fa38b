"""Reaction forces, which the equations of motion do not contain: race on ball, ball on ball."""

from ab_sim.engine.compiling.kinds import Floats
from ab_sim.engine.events.balls import around, ball_at, moves_along, row_start
from ab_sim.engine.events.run import (
    COUPLING,
    FRICTION,
    GRIP,
    INERTIA,
    LOAD,
    PATH_ACCELERATION,
    PATH_FORCE,
    PULL,
    BallEvents,
)
from ab_sim.model.dynamics.system import JOINED, MASS

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
