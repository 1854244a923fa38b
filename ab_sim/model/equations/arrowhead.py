"""Solution of the equations of motion: docs/equations.md, 2.

The deck and the spindle have K accelerations x; the last one is the spindle's. With the
balls fixed to the race, their equations are B x = F, B symmetric. A ball's path acceleration g =
s'' obeys

    mu g = path_force + coupling.x - friction N,    N = load + normal_coupling.x,

and deck and spindle receive -coupling g. So the matrix of all equations is an arrowhead. Each ball,
or each row of balls that move as one, is eliminated. There remain K equations, or K - 1 if the
spindle's acceleration is prescribed.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ab_sim.model.equations.motion import BallConstants, OnRace, SpindleMotion
from ab_sim.model.equations.sums import Number, over_balls, over_effects


class Arrow(NamedTuple):
    """Coefficients of the equations of motion, whose matrix is an arrowhead."""

    block: list[list[Number]]
    """B, shape (K, K), with the balls as if fixed to the race; only the upper triangle is used."""
    force: list[Number]
    """F [N, N m], shape (K,)."""
    coupling: list[Number]
    """Coefficients of x in the force along each ball's path, shape (K,): minus the mass that
    couples x with the ball's path acceleration."""
    normal_coupling: list[Number]
    """Coefficients of x in each ball's normal force, dN/dx, shape (K,)."""
    load: Number
    """Normal force N of each ball without the terms of the accelerations [N]."""
    path_force: Number
    """Force along the race on each ball, without friction and accelerations [N]."""


class Solved(NamedTuple):
    """Accelerations that satisfy the equations of motion."""

    x: list[Number]
    """Accelerations of deck and spindle, the spindle's last [m/s^2, rad/s^2], shape (K,)."""
    path: Number
    """Path acceleration g of each ball [m/s^2]."""


Mobility = Callable[[Number], Number]
"""Function from forces along the race on the balls [N] to their path accelerations [m/s^2]: a
division by mu; 0 for a ball that sticks, and one acceleration for all balls of a row that moves as
one."""


def solve(
    arrow: Arrow,
    balls: int,
    mobility: Mobility,
    friction: Number | None = None,
    spindle_acceleration: Number | None = None,
) -> Solved:
    """Solve the equations of motion for the accelerations.

    Parameters
    ----------
    arrow
        The equations of motion.
    balls
        Number of balls.
    mobility
        See ``Mobility``.
    friction
        Coefficient of sliding friction of each ball, with the sign of its sliding; None without
        friction, where the equations are symmetric.
    spindle_acceleration
        Prescribed acceleration [rad/s^2]; None: unknown.
    """
    unknowns = len(arrow.force)
    free = unknowns if spindle_acceleration is None else unknowns - 1
    rows, path_force = list(arrow.coupling), arrow.path_force
    if friction is not None:
        rows = [c - friction * n for c, n in zip(rows, arrow.normal_coupling, strict=True)]
        path_force = path_force - friction * arrow.load
    force = list(arrow.force[:free])
    if spindle_acceleration is not None:
        path_force = path_force + rows[-1] * spindle_acceleration
        force = [f - arrow.block[r][free] * spindle_acceleration for r, f in enumerate(force)]
    # A ball's g at x = 0, and its derivatives with respect to each entry of x.
    at_zero = mobility(path_force)
    gain = [mobility(rows[r]) for r in range(free)]
    reduced = [[0.0] * free for _ in range(free)]
    for r in range(free):
        for q in range(free):
            if q < r and friction is None:
                reduced[r][q] = reduced[q][r]
                continue
            entry = arrow.block[min(r, q)][max(r, q)]
            reduced[r][q] = entry - over_balls(balls, arrow.coupling[r] * gain[q])
        force[r] = force[r] + over_balls(balls, arrow.coupling[r] * at_zero)
    x = _solve_dense(reduced, force)
    path = at_zero
    for r in range(free):
        path = path + gain[r] * x[r]
    if spindle_acceleration is not None:
        x = [*x, spindle_acceleration]
    return Solved(x, path)


def _solve_dense(matrix: Sequence[Sequence[Number]], force: Sequence[Number]) -> list[Number]:
    """Solve ``matrix x = force`` for x, without pivoting, which mass matrices do not need.

    Parameters
    ----------
    matrix
        Shape (n, n), n at least 2.
    force
        Shape (n,).
    """
    a, f, n = [list(row) for row in matrix], list(force), len(force)
    # From the last unknown up, until two remain.
    for p in range(n - 1, 1, -1):
        pivot = 1.0 / a[p][p]
        for r in range(p):
            factor = a[r][p] * pivot
            for q in range(p):
                a[r][q] = a[r][q] - factor * a[p][q]
            f[r] = f[r] - factor * f[p]
    inverse = 1.0 / (a[0][0] * a[1][1] - a[0][1] * a[1][0])
    x = [
        (f[0] * a[1][1] - f[1] * a[0][1]) * inverse,
        (f[1] * a[0][0] - f[0] * a[1][0]) * inverse,
    ]
    for p in range(2, n):
        rest = f[p]
        for q in range(p):
            rest = rest - a[p][q] * x[q]
        x.append(rest * (1.0 / a[p][p]))
    return x


def normal_force(arrow: Arrow, x: Sequence[Number]) -> Number:
    """Return the race's normal force on each ball [N], from the accelerations x."""
    force = arrow.load
    for normal_coupling, acceleration in zip(arrow.normal_coupling, x, strict=True):
        force = force + normal_coupling * acceleration
    return force


def motor_torque(arrow: Arrow, balls: int, solved: Solved) -> Number:
    """Return the motor torque that maintains the prescribed spindle speed [N m].

    The torque is the residual of the spindle's equation of motion.
    """
    row, torque = len(arrow.force) - 1, -arrow.force[-1]
    for r, x in enumerate(solved.x):
        torque = torque + arrow.block[min(r, row)][row] * x
    return torque - over_balls(balls, arrow.coupling[row] * solved.path)


def powers(
    effects: Any,
    balls: BallConstants,
    on: OnRace,
    spindle: SpindleMotion,
    arrow: Arrow,
    solved: Solved,
    *,
    friction: Number | None,
    prescribed: bool,
    suspension_loss: Number,
) -> Sequence[Number]:
    """Return the power of the motor, and the dissipated power [W].

    Parameters
    ----------
    effects, balls, on, spindle
        Effects and balls of the scene, and their motion.
    arrow, solved
        The equations of motion, and the accelerations.
    friction
        Coefficient of each ball with the sign of its sliding, or None.
    prescribed
        True if the spindle's speed is prescribed.
    suspension_loss
        Dissipated power of the suspension [W].
    """
    n, path = balls.number, on.path
    torque = motor_torque(arrow, n, solved) if prescribed else spindle.torque
    drag = over_effects(effects, "ball_drag", 0.0, balls.each)
    loss = suspension_loss + over_balls(n, drag * path * path)
    if friction is not None:
        loss = loss + over_balls(n, friction * normal_force(arrow, solved.x) * path)
    return [torque * spindle.speed, loss]
