"""An independent reference of the planar model: inertial frame, dense mass matrix, scipy.

Slow, small, and sharing no line with ab_sim: what the corotating O(n) kernel is compared with.

    result = simulate(Params(...), theta0, times)
    result.x, result.vx, result.theta, result.theta_rate, result.w, result.events, result.energy()
"""

from .params import Contact, Friction, Motor, Params, Runout, Spindle, Suspension
from .run import Event, Result, Start, simulate

__all__ = [
    "Contact", "Event", "Friction", "Motor", "Params", "Result", "Runout", "Spindle", "Start",
    "Suspension", "simulate",
]  # fmt: skip
