"""Figures of a start-up, as the thesis defines them, from samples of a run."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.drive.trajectory import Trajectory, whirl_of
from ab_sim.scene.model import Scene
from ab_sim.spindle import SpeedSchedule

_ROUNDS = 12
"""Of Newton's method; where a curve is as smooth as between two samples it takes four or five."""


class Peaks(NamedTuple):
    """Largest whirls."""

    whirl: np.ndarray
    """m, shape (runs,)."""
    time: np.ndarray
    """s, the same."""


def peak_whirl(trajectory: Trajectory) -> tuple[float, float]:
    """Largest whirl radius [m] and its time [s], found between the samples around it."""
    whirl, time = trajectory.whirl, trajectory["time"]
    top = int(np.argmax(whirl))
    if 0 < top < len(whirl) - 1:
        near = slice(top - 1, top + 2)
        channels = (trajectory[name][None, near] for name in ("time", "x", "y", "vx", "vy"))
        peak, at = (float(found[0]) for found in peaks_between(*channels))
        if peak > whirl[top]:
            return peak, at
    return float(whirl[top]), float(time[top])


def peaks_between(
    time: np.ndarray, x: np.ndarray, y: np.ndarray, vx: np.ndarray, vy: np.ndarray
) -> Peaks:
    """Largest whirls along cubics through places and velocities.

    Args:
        time: of three samples of each run, the second with the largest whirl [s], shape (runs, 3).
        x, y: places there [m], the same.
        vx, vy: velocities [m/s], the same.
    """
    runs = np.arange(len(time))
    # Where the whirl rises at the sample in the middle, it is largest behind it, else before.
    rises = x[:, 1] * vx[:, 1] + y[:, 1] * vy[:, 1] > 0.0
    one, other = np.where(rises, 1, 0), np.where(rises, 2, 1)
    begin, lasts = time[runs, one], time[runs, other] - time[runs, one]
    paths = [
        _cubic(place[runs, one], place[runs, other], v[runs, one] * lasts, v[runs, other] * lasts)
        for place, v in ((x, vx), (y, vy))
    ]
    # Half the derivative of the whirl's square along the way s from 0 to 1: p p' + q q'.
    slope = np.zeros((6, len(runs)))
    for path in paths:
        for i, a in enumerate(path):
            for j in range(1, 4):
                slope[i + j - 1] += a * (j * path[j])
    at = _falling_zero(slope)
    whirl = whirl_of(*(_value(path, at) for path in paths))
    return Peaks(whirl, begin + at * lasts)


def _cubic(
    first: np.ndarray, last: np.ndarray, leaves: np.ndarray, arrives: np.ndarray
) -> list[np.ndarray]:
    """Coefficients of 1, s, s^2, s^3 of Hermite's cubic from s = 0 to 1."""
    way = last - first
    return [first, leaves, 3.0 * way - 2.0 * leaves - arrives, leaves + arrives - 2.0 * way]


def _value(coefficients: Sequence[np.ndarray] | np.ndarray, at: np.ndarray) -> np.ndarray:
    found = np.zeros(at.shape)
    for coefficient in reversed(coefficients):
        found = found * at + coefficient
    return found


def _falling_zero(coefficients: np.ndarray) -> np.ndarray:
    """Where between 0 and 1 polynomials fall from above 0 to below, shape as a coefficient's.

    By Newton's method, and by halves where that leaves the interval. The rounds are as many for
    each, so that what is found does not depend on the others.
    """
    derived = [k * coefficient for k, coefficient in enumerate(coefficients)][1:]
    low, high = np.zeros(coefficients.shape[1]), np.ones(coefficients.shape[1])
    at = np.full(coefficients.shape[1], 0.5)
    for _ in range(_ROUNDS):
        value, rate = _value(coefficients, at), _value(derived, at)
        low, high = np.where(value > 0.0, at, low), np.where(value > 0.0, high, at)
        with np.errstate(divide="ignore", invalid="ignore"):
            there = at - value / rate
        at = np.where((there >= low) & (there <= high), there, 0.5 * (low + high))
    return at


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
    length = float(time[k] - time[k - 1])
    angles, rates = trajectory.ball_angles, length * trajectory.ball_rates
    path = _cubic(angles[k - 1], angles[k], rates[k - 1], rates[k])
    before, after = 0.0, 1.0
    while before < (between := 0.5 * (before + after)) < after:
        if np.max(_value(path, np.full(trajectory.balls, between))) > -math.pi:
            before = between
        else:
            after = between
    return float(time[k - 1]) + after * length


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
