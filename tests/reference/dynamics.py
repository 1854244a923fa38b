"""Accelerations in a given mode: one dense linear system with all forces of constraint.

Unknowns (q'', F, lambda), for every ball and every contact, from

    M q'' - B^T F - C^T lambda = Q - V^T W b   (row psi: psi'' prescribed, unless a motor turns it)
    ball free:    F = 0
    ball slips:   F + s f N = 0,  N = -m (P'' - g) . n,  s = +-1
    ball sticks:  psi_i'' - psi'' = 0
    contact closed:  gap'' = 0,   open:  lambda = 0

B has the rows s' = B q', the path speeds along the race; C the rows gap' = C q' times R, so that
lambda is a force.
"""

from typing import NamedTuple

import numpy as np

from . import motor as motors
from .contact import Chain
from .model import Array, Model

FREE, STUCK, FORWARD, BACKWARD = 0, 2, 1, -1


class Mode(NamedTuple):
    """What each ball does (one of the above), which contacts are closed, the motor's regime."""

    balls: tuple[int, ...]
    closed: tuple[bool, ...]
    regime: motors.Regime


class Forces(NamedTuple):
    """Accelerations and the forces that go with them."""

    accelerations: Array
    """q''."""
    friction: Array
    """F, along the race."""
    normal: Array
    """N, inwards on the ball."""
    contact: Array
    """lambda, tangential."""
    torque: float
    """On the rotor, from outside."""
    integrator: float
    """z'."""
    path: Array
    """ds/dtheta of each ball."""


def solve(
    model: Model, chain: Chain, mode: Mode, asked: motors.Command, q: Array, rates: Array, z: float
) -> Forces:
    """Solve the system above."""
    p, n, size = model.p, model.count, model.size
    k = model.kinematics(q, rates)
    total = size + n + chain.size
    matrix, right = np.zeros((total, total)), np.zeros(total)
    matrix[:size, :size] = k.mass
    right[:size] = model.known_forces(k, q, rates)
    if p.motor is not None:
        raw = motors.raw_torque(p.motor, asked, rates[2], z)
        right[2] += motors.torque(p.motor, mode.regime, raw, rates[2])
    for i in range(n):
        matrix[3 + i, size + i], matrix[2, size + i] = -k.path[i], k.path[i]
    directions, turning = chain.directions(q), chain.bias(q, rates)
    matrix[:size, size + n :] = -p.race_radius * directions.T

    # N = normal_rows . unknowns + normal_known
    gx, gy = p.gravity
    in_x, in_y = slice(5, 5 + n), slice(5 + n, 5 + 2 * n)
    normal_rows = np.zeros((n, total))
    pull_x, pull_y = -model.masses * k.cosines, -model.masses * k.sines
    normal_rows[:, :size] = pull_x[:, None] * k.rows[in_x] + pull_y[:, None] * k.rows[in_y]
    normal_known = pull_x * (k.bias[in_x] - gx) + pull_y * (k.bias[in_y] - gy)

    for i, state in enumerate(mode.balls):
        row = size + i
        if state == STUCK:
            matrix[row, 3 + i], matrix[row, 2] = 1.0, -1.0
            continue
        matrix[row, row] = 1.0
        if state != FREE:
            matrix[row] += state * model.coefficients[i] * normal_rows[i]
            right[row] = -state * model.coefficients[i] * normal_known[i]
    for c, closed in enumerate(mode.closed):
        row = size + n + c
        if closed:
            matrix[row, :size], right[row] = directions[c], -turning[c]
        else:
            matrix[row, row] = 1.0

    held = asked.acceleration if p.spindle.feel_acceleration else 0.0
    spindle_row, spindle_right = matrix[2].copy(), right[2]
    if p.motor is None:
        matrix[2], right[2] = 0.0, held
        matrix[2, 2] = 1.0
    unknowns = np.linalg.solve(matrix, right)
    normal = normal_rows @ unknowns + normal_known
    accelerations = unknowns[:size].copy()
    if p.motor is None:
        torque = float(spindle_row @ unknowns - spindle_right)
        accelerations[2:] += asked.acceleration - held
        integrator = 0.0
    else:
        torque = motors.torque(p.motor, mode.regime, raw, rates[2])
        integrator = motors.integrator_rate(p.motor, mode.regime, asked, rates[2], z)
    friction, contact = unknowns[size : size + n], unknowns[size + n :]
    return Forces(accelerations, friction, normal, contact, torque, integrator, k.path)
