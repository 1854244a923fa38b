"""Figures of merit of a start-up, as the thesis defines them, from samples of a run."""

import math

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq, minimize_scalar

from ab_sim.dynamics.driving_force import driving_force
from ab_sim.scene.model import Scene
from ab_sim.trajectory import Trajectory


def driving_forces(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """Driving force on each ball [N], shape (samples, balls): thesis (2-15), signed."""
    return driving_force(
        scene,
        trajectory["x"][:, None],
        trajectory["y"][:, None],
        trajectory["angle"][:, None] + trajectory.ball_angles,
        trajectory["speed"][:, None] + trajectory.ball_rates,
    )


def peak_whirl(trajectory: Trajectory) -> tuple[float, float]:
    """Largest whirl radius [m] and its time [s], found between the samples around it."""
    whirl, time = trajectory.whirl, trajectory["time"]
    top = int(np.argmax(whirl))
    if 0 < top < len(whirl) - 1:
        near = slice(top - 1, top + 2)
        path = CubicHermiteSpline(
            time[near],
            trajectory.position[near],
            np.column_stack([trajectory["vx"][near], trajectory["vy"][near]]),
        )
        best = minimize_scalar(
            lambda t: -math.hypot(*path(t)),
            bounds=(time[top - 1], time[top + 1]),
            method="bounded",
            options={"xatol": 1e-9},
        )
        if -best.fun > whirl[top]:
            return float(-best.fun), float(best.x)
    return float(whirl[top]), float(time[top])


def settling_period(trajectory: Trajectory, start: float) -> float | None:
    """Settling period [s]: from ``start`` to the first instant at which all balls have settled.

    Args:
        trajectory: consecutive samples.
        start: start of the variable-speed period [s].

    Returns:
        Time from ``start`` until all balls have theta <= -180 deg, unwrapped (thesis 4.4); None
        if that does not happen after ``start``, or there are no balls.
    """
    time = trajectory["time"]
    if trajectory.balls == 0 or len(time) < 2:
        return None
    settled = np.all(trajectory.ball_angles <= -math.pi, axis=1) & (time >= start)
    if not settled.any():
        return None
    k = int(np.argmax(settled))
    if k == 0 or time[k - 1] < start:
        return float(time[k] - start)
    near = slice(k - 1, k + 1)
    angle = CubicHermiteSpline(
        time[near], trajectory.ball_angles[near], trajectory.ball_rates[near]
    )

    def last_ball(t: float) -> float:
        return float(np.max(angle(t))) + math.pi

    if last_ball(time[k - 1]) <= 0:
        return float(time[k] - start)
    return float(brentq(last_ball, time[k - 1], time[k]) - start)


def time_of_speed(trajectory: Trajectory, speed: float) -> float | None:
    """When the spindle first reaches a speed [rad/s], rising; interpolated; None if never."""
    reached = trajectory["speed"] >= speed * (1 - 1e-12)
    if not reached.any():
        return None
    k = int(np.argmax(reached))
    if k == 0:
        return float(trajectory["time"][0])
    near = slice(k - 1, k + 1)
    return float(np.interp(speed, trajectory["speed"][near], trajectory["time"][near]))
