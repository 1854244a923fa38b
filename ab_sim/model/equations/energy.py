"""The energy balance: power of the motor, and dissipated power."""

from collections.abc import Sequence
from typing import Any

from ab_sim.model.equations.arrowhead import Arrow, Solved, normal_force
from ab_sim.model.equations.motion import SpindleMotion
from ab_sim.model.equations.race import BallConstants, OnRace
from ab_sim.model.equations.sums import Number, over_balls, over_effects


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

    Args:
        effects, balls, on, spindle: effects and balls of the scene, and their motion.
        arrow, solved: the equations of motion, and the accelerations.
        friction: coefficient of each ball with the sign of its sliding, or None.
        prescribed: True if the spindle's speed is prescribed.
        suspension_loss: dissipated power of the suspension [W].
    """
    n, path = balls.number, on.path
    torque = motor_torque(arrow, n, solved) if prescribed else spindle.torque
    drag = over_effects(effects, "ball_drag", 0.0, balls.each)
    loss = suspension_loss + over_balls(n, drag * path * path)
    if friction is not None:
        loss = loss + over_balls(n, friction * normal_force(arrow, solved.x) * path)
    return [torque * spindle.speed, loss]
