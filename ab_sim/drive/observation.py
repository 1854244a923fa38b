"""Observation of a drive at one instant, and snapshot of its complete state."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ab_sim.drive.orientation import tilt_of
from ab_sim.drive.sensing import PickupState
from ab_sim.model.spindle import SpeedSchedule


@dataclass(frozen=True)
class Observation:
    """State of a drive at one instant, in SI units; rotating axis 1 points at the unbalance."""

    time: float
    """Time [s]."""
    steps: int
    """Number of whole integration steps taken."""
    psi: float
    """Spindle angle [rad], unwrapped."""
    omega: float
    """Spindle speed [rad/s]."""
    command: float
    """Commanded spindle speed [rad/s]."""
    u: np.ndarray
    """Deck displacement on rotating axes [m], shape (2,)."""
    v: np.ndarray
    """Deck velocity, inertial, on rotating axes [m/s], shape (2,)."""
    position: np.ndarray
    """Deck displacement on inertial axes [m]: x, y; and z in space."""
    velocity: np.ndarray
    """Deck velocity on inertial axes [m/s], shape as ``position``."""
    acceleration: np.ndarray
    """Deck acceleration on inertial axes [m/s^2], shape as ``position``."""
    turn: np.ndarray
    """Quaternion (w, x, y, z) from deck axes to inertial axes; the identity in the plane."""
    angular_velocity: np.ndarray
    """Angular velocity of the deck on inertial axes [rad/s], shape (3,); 0 in the plane."""
    angular_acceleration: np.ndarray
    """Angular acceleration of the deck on inertial axes [rad/s^2], shape (3,); 0 in the plane."""
    theta: np.ndarray
    """Ball angles from the unbalance [rad], unwrapped, shape (balls,)."""
    theta_rate: np.ndarray
    """Ball speeds relative to the race [rad/s], shape (balls,)."""
    stuck: np.ndarray
    """True if friction holds a ball on the race, shape (balls,)."""
    driving_force: np.ndarray
    """Driving force on the balls [N], shape (balls,): thesis (2-15), signed; a positive force
    drives towards decreasing theta."""
    motor_torque: float
    """Motor torque [N m]; NaN if the speed is prescribed."""
    readings: dict[str, np.ndarray]
    """Reading of each sensor by name, on its axes [m/s^2], shape (2,), or (3,) in space."""

    @property
    def whirl(self) -> float:
        """Return the whirl radius W = |u| [m]."""
        return float(np.hypot(*self.u))

    @property
    def tilt(self) -> np.ndarray:
        """Return the deck's angles alpha, beta, gamma [rad], shape (3,).

        See ``orientation.tilt_of``.
        """
        return tilt_of(self.turn)

    @property
    def ball_rate(self) -> np.ndarray:
        """Return the absolute angular speeds of the balls [rad/s]."""
        return self.omega + self.theta_rate


class EnergyBalance(NamedTuple):
    """Energy balance since the start [J]: stored = at_start + motor_work - dissipated."""

    stored: float
    at_start: float
    motor_work: float
    dissipated: float


class Snapshot(NamedTuple):
    """Everything on which a drive's future depends, except its scene."""

    steps: int
    step: float
    state: np.ndarray
    discrete_state: np.ndarray
    memory: np.ndarray
    """Values that the stepper carries from one step to the next."""
    profile: SpeedSchedule
    command: float | None
    """Commanded speed [rad/s]; None before the first command."""
    acceleration: float
    """Acceleration towards the commanded speed [rad/s^2]."""
    pickups: dict[str, PickupState]
    controller: Any = None
    """JSON-able state of the profile controller; None if the profile is known in advance."""

    def check_like(self, other: "Snapshot") -> None:
        """Refuse a snapshot that cannot belong to the same scene as another one.

        Raises:
            ValueError: balls, step, effects or sensors differ; the message states the difference.
        """
        if self.state.shape != other.state.shape or self.step != other.step:
            raise ValueError("the snapshot is of a drive with other balls, step or energy balance")
        if self.discrete_state.shape != other.discrete_state.shape:
            raise ValueError("the snapshot is of a drive with other effects")
        for name, kept in self.pickups.items():
            pickup = other.pickups.get(name)
            if pickup is None or [a.shape for a in kept] != [a.shape for a in pickup]:
                raise ValueError("the snapshot is of a drive with other sensors")
