"""The energy balance: power of the motor, and power dissipated."""

from collections.abc import Sequence
from typing import Any

from ab_sim.equations.arrowhead import Arrow, Solved, normal_force
from ab_sim.equations.motion import SpindleMotion
from ab_sim.equations.race import BallConstants, OnRace
from ab_sim.equations.sums import Number, over_balls, over_effects


def motor_torque(arrow: Arrow, balls: int, solved: Solved) -> Number:
    """Torque that keeps the spindle at its prescribed speed [N m]: residual of its equation."""
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
    """Power of the motor, and power dissipated [W].

    Args:
        effects, balls, on, spindle: of the scene, and how they move.
        arrow, solved: the equations of motion there, and the accelerations.
        friction: coefficient of each ball with the sign of its sliding, or None.
        prescribed: whether the spindle's speed is.
        suspension_loss: what the suspension dissipates [W].
    """
    n, path = balls.number, on.path
    torque = motor_torque(arrow, n, solved) if prescribed else spindle.torque
    drag = over_effects(effects, "ball_drag", 0.0, balls.each)
    loss = suspension_loss + over_balls(n, drag * path * path)
    if friction is not None:
        loss = loss + over_balls(n, friction * normal_force(arrow, solved.x) * path)
    return [torque * spindle.speed, loss]
