"""Figures of a start-up, as the thesis defines them, from samples of a run."""

import math

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq, minimize_scalar

from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene
from ab_sim.spindle import SpeedSchedule


def peak_whirl(trajectory: Trajectory) -> tuple[float, float]:
    """Largest whirl radius [m] and its time [s], found between the samples around it."""
    whirl, time = trajectory.whirl, trajectory["time"]
    top = int(np.argmax(whirl))
    if 0 < top < len(whirl) - 1:
        near = slice(top - 1, top + 2)
        path = CubicHermiteSpline(
            time[near],
            trajectory.position[near, :2],
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


def first_passage_of_opposite(trajectory: Trajectory) -> float | None:
    """When all balls first have theta <= -180 deg, unwrapped [s]: opposite the unbalance.

    The thesis' "settling period" (4.4) is this less the time at which its variable-speed period
    starts. It does not say that balls stay there, nor that the rotor is balanced: balls whose
    unbalance together is more than twice the rotor's make it worse there.

    Args:
        trajectory: consecutive samples.

    Returns:
        The time, found between samples; None if it does not happen, or there are no balls.
    """
    time = trajectory["time"]
    if trajectory.balls == 0 or len(time) < 2:
        return None
    passed = np.all(trajectory.ball_angles <= -math.pi, axis=1)
    if not passed.any():
        return None
    k = int(np.argmax(passed))
    if k == 0:
        return float(time[0])
    near = slice(k - 1, k + 1)
    angle = CubicHermiteSpline(
        time[near], trajectory.ball_angles[near], trajectory.ball_rates[near]
    )
    return float(brentq(lambda t: float(np.max(angle(t))) + math.pi, time[k - 1], time[k]))


def settling_begins(scene: Scene) -> float | None:
    """When the thesis' settling period begins [s] (its section 4.4).

    That is where the variable-speed period of a start-up begins; without one, as the page on the
    thesis has it, where the profile reaches the critical speed sqrt(k/M) (4-1).

    Returns:
        None if the scene has no start-up, or one that neither has a period ahead nor reaches the
        critical speed.
    """
    profile, critical = scene.profile, scene.critical_speed
    if profile is None or profile.kind != "start_up":
        return None
    begins = SpeedSchedule.of_scene(scene).variable_speed_period
    if begins is not None or critical is None:
        return begins
    if not scene.start.speed <= critical <= profile.target_speed:
        return None
    return (critical - scene.start.speed) / profile.acceleration


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
