"""Observation of a drive at one instant, snapshot of its complete state, and readers of samples."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.ordered_sum import ordered_dot
from ab_sim.base.sample_columns import ANGLE, DECK, STEP
from ab_sim.drive.closed_forms import DrivenBalls
from ab_sim.drive.pickup import Pickup, PickupState
from ab_sim.drive.trajectory import Trajectory, channels_for, tilt_of
from ab_sim.model.dynamics.assemble import start_state
from ab_sim.model.dynamics.system import (
    DIRECTION,
    LOADED,
    MASS,
    System,
    has_friction,
    has_motor,
    layout_of,
)
from ab_sim.model.equations.mounts import turn_of
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene.model import Scene


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
    """Readings on the sensors' axes [m/s^2] by sensor, shape (2,), or (3,) for a deck in space."""

    @property
    def whirl(self) -> float:
        """Return the whirl radius W = |u| [m]."""
        return float(np.hypot(*self.u))

    @property
    def tilt(self) -> np.ndarray:
        """Return the deck's angles alpha, beta, gamma [rad], shape (3,).

        See ``trajectory.tilt_of``.
        """
        return tilt_of(self.turn)


class EnergyBalance(NamedTuple):
    """Energy balance since the start [J]: stored = at_start + motor_work - dissipated."""

    stored: float
    at_start: float
    motor_work: float
    dissipated: float


class Snapshot(NamedTuple):
    """Everything on which a drive's future depends, except its scene."""

    steps: int
    """Number of steps taken since t = 0."""
    step: float
    """Step [s]."""
    state: np.ndarray
    """State of the system, shape (states,)."""
    discrete_state: np.ndarray
    """Active branches and whole turns, shape (balls + 1, DISCRETE_COLUMNS)."""
    memory: np.ndarray
    """Values that the stepper carries from one step to the next."""
    schedule: SpeedSchedule
    command: float | None
    """Commanded speed [rad/s]; None before the first command."""
    acceleration: float
    """Acceleration towards the commanded speed [rad/s^2]."""
    pickups: dict[str, PickupState]
    controller: Any = None
    """JSON-able state of the profile controller; None if the profile is known in advance."""

    def check_like(self, other: "Snapshot") -> None:
        """Refuse a snapshot that cannot belong to the same scene as another one.

        Raises
        ------
        ValueError
            Balls, step, effects or sensors differ; the message states the difference.
        """
        if self.state.shape != other.state.shape or self.step != other.step:
            raise ValueError("the snapshot is of a drive with other balls, step or energy balance")
        if self.discrete_state.shape != other.discrete_state.shape:
            raise ValueError("the snapshot is of a drive with other effects")
        for name, kept in self.pickups.items():
            pickup = other.pickups.get(name)
            if pickup is None or [a.shape for a in kept] != [a.shape for a in pickup]:
                raise ValueError("the snapshot is of a drive with other sensors")


def channels_of(scene: Scene, system: System) -> tuple[str, ...]:
    """Return the names of a scene's channels."""
    kind, balls = type(system.deck_model), scene.balls.count
    sensors = [f"{name}_{axis + 1}" for name in scene.pickups for axis in range(kind.AXES)]
    return channels_for(kind.CHANNELS, balls, has_motor(system.effects), sensors)


class RowReader:
    """Converter of a kernel's rows to trajectories and observations, with sensor readings.

    Parameters
    ----------
    scene
        Scene of the rows.
    system
        The same scene as a system.
    """

    def __init__(self, scene: Scene, system: System) -> None:
        self._scene, self._system, self._step = scene, system, scene.solver.step
        # No force drives a lost ball.
        masses = tuple(system.balls[:, MASS].tolist())
        self._driven = DrivenBalls.of(scene)._replace(masses=masses)
        self._deck_model, self._layout = system.deck_model, layout_of(system)
        self._motor, self._ways = bool(has_motor(system.effects)), type(system.deck_model).AXES
        self._friction = bool(has_friction(system.effects))
        sensors = scene.pickups
        self._points = {name: sensor.position for name, sensor in sensors.items()}
        seeds = [sensor.seed for sensor in sensors.values()]
        self.pickups = {
            name: Pickup(sensor, self._step, self._ways, seeds[:k].count(sensor.seed))
            for k, (name, sensor) in enumerate(sensors.items())
        }
        self.channels = channels_of(scene, system)
        self._deck_columns = slice(DECK, DECK + len(type(system.deck_model).CHANNELS))
        self.reset()

    def reset(self) -> None:
        """Reset the sensors to t = 0."""
        start = start_state(self._scene, self._system)[self._layout.deck]
        at_rest = self._deck_model.at_rest(start)
        for name, pickup in self.pickups.items():
            # The sensors have settled, as if the drive had always been at rest.
            pickup.reset(self.sensed(name, at_rest)[0])

    def trajectory(self, samples: np.ndarray) -> Trajectory:
        """Return the trajectory of some steps; sensor readings continue from the last call.

        Parameters
        ----------
        samples
            Rows as written by ``fixed_step.record``, shape (steps, channels). The last columns
            receive the sensor readings; the trajectory owns the array.
        """
        if self.pickups and len(samples):
            first = int(samples[0, STEP])
            for (name, pickup), at in zip(self.pickups.items(), self._readings(), strict=True):
                force = self.sensed(name, samples[:, self._deck_columns])
                samples[:, at] = pickup.process(first, force)
        return Trajectory(self.channels, samples)

    def present(self, sample: np.ndarray) -> Trajectory:
        """Return the trajectory of one sample, with the readings that the sensors hold.

        Parameters
        ----------
        sample
            Row as in ``trajectory``, shape (1, channels).
        """
        for pickup, at in zip(self.pickups.values(), self._readings(), strict=True):
            sample[:, at] = pickup.reading
        return Trajectory(self.channels, sample)

    def observation(
        self, present: Trajectory, time: float, discrete_state: np.ndarray
    ) -> Observation:
        """Return the observation of one sample with derived quantities.

        Parameters
        ----------
        present
            As returned by ``present``.
        time
            Time of the sample [s].
        discrete_state
            Active branches of friction at that time.
        """
        row = present.samples[0]
        psi, omega, command = (float(x) for x in row[ANGLE:DECK])
        place, velocity = present.position[0], present.velocity[0]
        c, s = math.cos(psi), math.sin(psi)
        theta, rate = present.ball_angles[0], present.ball_rates[0]
        return Observation(
            time=time,
            steps=int(row[STEP]),
            psi=psi,
            omega=omega,
            command=command,
            u=_turned(c, s, place),
            v=_turned(c, s, velocity),
            position=place,
            velocity=velocity,
            acceleration=present.acceleration[0],
            turn=present.turn[0],
            angular_velocity=present.angular_velocity[0],
            angular_acceleration=present.angular_acceleration[0],
            theta=theta.copy(),
            theta_rate=rate.copy(),
            stuck=self._stuck(discrete_state[: present.balls]),
            driving_force=self._driven.forces(present)[0],
            motor_torque=float(present["motor_torque"][0]) if self._motor else math.nan,
            readings={name: pickup.reading for name, pickup in self.pickups.items()},
        )

    def _stuck(self, discrete_state: np.ndarray) -> np.ndarray:
        """Return whether friction holds each ball on the race, shape (balls,)."""
        held = (discrete_state[:, DIRECTION] == 0) & (discrete_state[:, LOADED] == 1)
        stuck: np.ndarray = held & self._friction
        return stuck

    def _readings(self) -> list[slice]:
        """Return the columns of each sensor's readings."""
        ways, first = self._ways, len(self.channels) - self._ways * len(self.pickups)
        return [slice(at, at + ways) for at in range(first, len(self.channels), ways)]

    def sensed(self, name: str, samples: np.ndarray) -> np.ndarray:
        """Return the quantity that a sensor measures, without the sensor's own dynamics and noise.

        Parameters
        ----------
        name
            Name of the sensor.
        samples
            Channels of the deck model, shape (samples, channels).

        Returns
        -------
        np.ndarray
            Specific force on the deck's axes [m/s^2] for an accelerometer, displacement on inertial
            axes [m] for a probe; shape (samples, axes).
        """
        point, effects = self._points[name], self._system.effects
        if name in self._scene.probes:
            return self._displaced(samples, np.array(point))
        return np.column_stack(self._deck_model.specific_force(effects, samples.T, point))

    def _displaced(self, samples: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Return the displacement of a deck point on inertial axes [m], shape (samples, axes)."""
        names = type(self._deck_model).CHANNELS
        moved: np.ndarray = samples[:, [names.index(axis) for axis in "xyz"[: self._ways]]]
        if "qw" in names:
            q = samples[:, [names.index(f"q{part}") for part in "wxyz"]]
            turn = np.array(turn_of(list(q.T))).reshape(3, 3, -1)
            moved = moved + ordered_dot(turn.transpose(2, 0, 1), point) - point
        return moved


def _turned(c: float, s: float, vector: np.ndarray) -> np.ndarray:
    """Return a vector's first two components on axes turned by an angle with cosine c and sine s.

    BLAS is not used, because its kernels round differently.
    """
    x, y = vector[:2].tolist()
    return np.array([c * x + s * y, c * y - s * x])
