"""Metrics of a start-up as defined in the thesis, and the outcome of an adaptive start-up."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.control import Estimates, State
from ab_sim.drive.closed_forms import resultant
from ab_sim.drive.controllers import AdaptiveController, EstimatesAt
from ab_sim.drive.trajectory import Trajectory, whirl_of
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene.model import Scene

_ROUNDS = 12
"""Number of Newton steps; a smooth curve between two samples needs four or five."""


class Peaks(NamedTuple):
    """Largest whirl of each run."""

    whirl: np.ndarray
    """Largest whirl [m], shape (runs,)."""
    time: np.ndarray
    """Time of the largest whirl [s], shape (runs,)."""


def peak_whirl(trajectory: Trajectory) -> tuple[float, float]:
    """Return the largest whirl [m] and its time [s], interpolated between samples."""
    whirl, time = trajectory.whirl, trajectory["time"]
    top = int(np.argmax(whirl))
    if 0 < top < len(whirl) - 1:
        near = slice(top - 1, top + 2)
        channels = (trajectory[name][None, near] for name in ("time", "x", "y", "vx", "vy"))
        peak, at = (float(values[0]) for values in peaks_between(*channels))
        if peak > whirl[top]:
            return peak, at
    return float(whirl[top]), float(time[top])


def peaks_between(
    time: np.ndarray, x: np.ndarray, y: np.ndarray, vx: np.ndarray, vy: np.ndarray
) -> Peaks:
    """Return the largest whirls along cubic interpolants of positions and velocities.

    Parameters
    ----------
    time
        Times of three samples of each run [s], the largest whirl at the second, shape (runs, 3).
    x, y
        Positions at these times [m], same shape.
    vx, vy
        Velocities at these times [m/s], same shape.
    """
    runs = np.arange(len(time))
    # If the whirl still rises at the middle sample, its maximum lies after it, otherwise before it.
    rises = x[:, 1] * vx[:, 1] + y[:, 1] * vy[:, 1] > 0.0
    one, other = np.where(rises, 1, 0), np.where(rises, 2, 1)
    begin, lasts = time[runs, one], time[runs, other] - time[runs, one]
    paths = [
        _cubic(place[runs, one], place[runs, other], v[runs, one] * lasts, v[runs, other] * lasts)
        for place, v in ((x, vx), (y, vy))
    ]
    # Half the derivative of the squared whirl along s from 0 to 1: p p' + q q'.
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
    """Return the coefficients of 1, s, s^2, s^3 of the cubic Hermite interpolant on [0, 1].

    Parameters
    ----------
    first, last
        Values at s = 0 and s = 1, any shape.
    leaves, arrives
        Derivatives by s there, same shape.
    """
    way = last - first
    return [first, leaves, 3.0 * way - 2.0 * leaves - arrives, leaves + arrives - 2.0 * way]


def _value(coefficients: Sequence[np.ndarray] | np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return polynomials with coefficients of 1, s, s^2, ... at s = ``at`` (Horner's scheme)."""
    values = np.zeros(at.shape)
    for coefficient in reversed(coefficients):
        values = values * at + coefficient
    return values


def _falling_zero(coefficients: np.ndarray) -> np.ndarray:
    """Return roots in [0, 1] at which polynomials change from positive to negative.

    Newton's method takes a bisection step when it would leave the bracket. The number of steps is
    fixed, so that a result does not depend on the other polynomials.

    Parameters
    ----------
    coefficients
        Coefficients of 1, s, s^2, ..., shape (degree + 1, polynomials).

    Returns
    -------
    np.ndarray
        Roots, shape (polynomials,).
    """
    derived = [k * coefficient for k, coefficient in enumerate(coefficients)][1:]
    low, high = np.zeros(coefficients.shape[1]), np.ones(coefficients.shape[1])
    at = np.full(coefficients.shape[1], 0.5)
    for _ in range(_ROUNDS):
        value, rate = _value(coefficients, at), _value(derived, at)
        low, high = np.where(value > 0.0, at, low), np.where(value > 0.0, high, at)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = at - value / rate
        at = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
    return at


def first_passage_of_opposite(trajectory: Trajectory) -> float | None:
    """Return the first time [s] at which all balls have unwrapped theta <= -180 deg.

    At -180 deg a ball is opposite the unbalance.

    The thesis' "settling period" (4.4) is this time minus the start of the variable-speed period.
    Balls may leave again, and the rotor may be unbalanced: balls with more than twice the rotor's
    unbalance increase the unbalance there.

    Parameters
    ----------
    trajectory
        Consecutive samples.

    Returns
    -------
    float | None
        The time, interpolated between samples; None if it does not occur or there are no balls.
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
    # Bisect to neighbouring floating-point numbers. The largest of the cubics has kinks, on which
    # Newton's method may fail.
    before, after = 0.0, 1.0
    while before < (between := 0.5 * (before + after)) < after:
        if np.max(_value(path, np.full(trajectory.balls, between))) > -math.pi:
            before = between
        else:
            after = between
    return float(time[k - 1]) + after * length


def settling_begins(scene: Scene) -> float | None:
    """Return the start of the settling period as defined in section 4.4 of the thesis [s].

    It is the start of the variable-speed period of a start-up. Without such a period it is the time
    at which the profile reaches the critical speed sqrt(k/M) (4-1), as on the thesis page.

    Returns
    -------
    float | None
        The time; None if the scene has no start-up, or one without a variable-speed period that
        does not reach the critical speed.
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
    """Return the time [s] at which the spindle first reaches a speed [rad/s]; None if never.

    The time is interpolated between samples.
    """
    reached = trajectory["speed"] >= speed * (1 - 1e-12)
    if not reached.any():
        return None
    k = int(np.argmax(reached))
    if k == 0:
        return float(trajectory["time"][0])
    near = slice(k - 1, k + 1)
    return float(np.interp(speed, trajectory["speed"][near], trajectory["time"][near]))


class AdaptiveOutcome(NamedTuple):
    """Actions and estimates of a controller during a run."""

    state: State
    """State of the controller at the end of the run."""
    words: str
    """Text for users: the controller's state at the end, and its reason."""
    estimates: Estimates
    """Estimates of the drive's parameters at the end of the run."""
    history: tuple[EstimatesAt, ...]
    """Estimates at each command period, including the start."""

    @classmethod
    def of(cls, controller: AdaptiveController) -> "AdaptiveOutcome":
        """Return the outcome of a start-up so far."""
        start_up, history = controller.start_up, tuple(controller.history)
        return cls(start_up.state, start_up.words, start_up.estimates, history)

    def report(self) -> dict[str, object]:
        """Return the outcome as JSON-able values in SI units; None for unknown values."""
        estimates = self.estimates
        return {
            "state": self.state.text,
            "words": self.words,
            "critical_speed": _known(estimates.critical_speed),
            "critical_speed_deviation": _known(estimates.critical_speed_deviation),
            "net_unbalance": _known(abs(estimates.net_unbalance)),
            "net_unbalance_deviation": _known(estimates.net_unbalance_deviation),
            "net_unbalance_before": _known(estimates.without_balls),
            "dwells": estimates.dwells,
            "retries": estimates.retries,
        }


def net_unbalance(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """Return the offset of the rotor's centre of mass, balls included [m], shape (samples,).

    It is abs(M0 e + sum m_i R exp(i theta_i)) / M, which an adaptive start-up estimates.
    """
    moments = np.array(scene.balls.masses) * scene.race.radius
    rotor_unbalance = scene.eccentric_mass * scene.rotor.eccentricity
    net: np.ndarray = (
        np.abs(rotor_unbalance + resultant(moments, trajectory.ball_angles)) / scene.total_mass
    )
    return net


def _known(value: float) -> float | None:
    """Return an estimate; None if it is not yet known, which is infinite or NaN."""
    return value if math.isfinite(value) else None
