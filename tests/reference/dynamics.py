"""Accelerations in a given mode: one dense linear system with all forces of constraint.

Unknowns (q'', F, lambda), for every ball and every contact, from

    M q'' - B^T F - C^T lambda = Q - V^T W b   (row psi: psi'' prescribed, unless a motor turns it)
    ball free:    F = 0
    ball slips:   F + s f N = 0,  N = -m (P'' - g) . n,  s = +-1
    ball sticks:  psi_i'' - psi'' = 0
    contact closed:  gap'' = 0,   open:  lambda = 0

B has the rows s' = B q', the path speeds along the race. C has the rows gap' = C q' times R, so
that lambda is a force.
"""

from typing import NamedTuple

import numpy as np

from . import motor as motors
from .contact import Chain
from .plant import Array, Plant

FREE, STUCK, FORWARD, BACKWARD = 0, 2, 1, -1


class Mode(NamedTuple):
    """State of each ball (as above), closed contacts, and regime of the motor."""

    balls: tuple[int, ...]
    closed: tuple[bool, ...]
    regime: motors.Regime


class Forces(NamedTuple):
    """Accelerations, and the forces that belong to them."""

    accelerations: Array
    """Accelerations q''."""
    friction: Array
    """Friction F along the race [N]."""
    normal: Array
    """Normal force N, inwards on the ball [N]."""
    contact: Array
    """Contact force lambda, tangential [N]."""
    torque: float
    """External torque on the rotor [N m]."""
    integrator: float
    """Rate z' of the speed loop's integral."""
    losses: Array
    """Losses in suspension, drag and friction [W]."""


def solve(
    plant: Plant, chain: Chain, mode: Mode, asked: motors.Command, q: Array, rates: Array, z: float
) -> Forces:
    """Solve the system of the module's docstring."""
    p, n, size, psi = plant.p, plant.count, plant.size, plant.psi
    k = plant.system(q, rates)
    total = size + n + chain.size
    matrix, right = np.zeros((total, total)), np.zeros(total)
    matrix[:size, :size] = k.mass
    right[:size] = k.known
    if p.motor is not None:
        raw = motors.raw_torque(p.motor, asked, rates[psi], z)
        right[psi] += motors.torque(p.motor, mode.regime, raw, rates[psi])
    for i in range(n):
        matrix[psi + 1 + i, size + i], matrix[psi, size + i] = -k.path[i], k.path[i]
    directions, turning = chain.directions(q), chain.bias(q, rates)
    matrix[:size, size + n :] = -chain.radius * directions.T

    for i, state in enumerate(mode.balls):
        row = size + i
        if state == STUCK:
            matrix[row, psi + 1 + i], matrix[row, psi] = 1.0, -1.0
            continue
        matrix[row, row] = 1.0
        if state != FREE:
            matrix[row, :size] += state * plant.coefficients[i] * k.normal_rows[i]
            right[row] = -state * plant.coefficients[i] * k.normal_known[i]
    for c, closed in enumerate(mode.closed):
        row = size + n + c
        if closed:
            matrix[row, :size], right[row] = directions[c], -turning[c]
        else:
            matrix[row, row] = 1.0

    held = asked.acceleration if p.spindle.feel_acceleration else 0.0
    spindle_row, spindle_right = matrix[psi].copy(), right[psi]
    if p.motor is None:
        matrix[psi], right[psi] = 0.0, held
        matrix[psi, psi] = 1.0
    unknowns = np.linalg.solve(matrix, right)
    normal = k.normal_rows @ unknowns[:size] + k.normal_known
    accelerations = unknowns[:size].copy()
    if p.motor is None:
        torque = float(spindle_row @ unknowns - spindle_right)
        accelerations[psi:] += asked.acceleration - held
        integrator = 0.0
    else:
        torque = motors.torque(p.motor, mode.regime, raw, rates[psi])
        integrator = motors.integrator_rate(p.motor, mode.regime, asked, rates[psi], z)
    friction, contact = unknowns[size : size + n], unknowns[size + n :]
    slip = k.path * plant.theta(rates)
    losses = np.array([k.damping, (plant.drag * slip) @ slip, -friction @ slip])
    return Forces(accelerations, friction, normal, contact, torque, integrator, losses)
