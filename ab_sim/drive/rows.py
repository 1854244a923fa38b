"""From the rows that a kernel writes to a trajectory."""

import math

import numpy as np

from ab_sim.drive.driving_forces import DrivenBalls
from ab_sim.drive.observation import Observation
from ab_sim.drive.trajectory import SPINDLE_CHANNELS, Trajectory, channels_for
from ab_sim.dynamics.assemble import start_state
from ab_sim.dynamics.layout import layout_of
from ab_sim.dynamics.system import MASS, System, carrier_outputs, has_motor
from ab_sim.integrate.fixed_step import row_width
from ab_sim.scene.model import Scene
from ab_sim.sensing import Pickup
from ab_sim.spindle.stretches import Stretch


def channels_of(scene: Scene, system: System) -> tuple[str, ...]:
    """Names of a scene's channels."""
    kind, balls = type(system.carrier), scene.balls.count
    sensors = [f"{name}_{axis + 1}" for name in scene.sensors for axis in range(kind.WAYS)]
    return channels_for(kind.CHANNELS, balls, has_motor(system.effects), sensors)


class RowReader:
    """How a scene's rows are read.

    Args:
        scene: what the rows are of.
        system: the same as a system.
    """

    def __init__(self, scene: Scene, system: System) -> None:
        self._scene, self._system, self._step = scene, system, scene.solver.step
        # Nothing drives a ball that is lost.
        masses = tuple(system.balls[:, MASS].tolist())
        self._driven = DrivenBalls.of(scene)._replace(masses=masses)
        self._carrier, self._layout = system.carrier, layout_of(system)
        self._motor, self._ways = bool(has_motor(system.effects)), type(system.carrier).WAYS
        self.pickups = {
            name: Pickup(sensor, self._step, self._ways) for name, sensor in scene.sensors.items()
        }
        self.channels = channels_of(scene, system)
        self._balls = len(SPINDLE_CHANNELS) + len(type(system.carrier).CHANNELS)
        self.width = row_width(self._layout.size, carrier_outputs(system.carrier))
        """Of a row."""
        self.reset()

    def reset(self) -> None:
        """Back to t = 0."""
        start = start_state(self._scene, self._system)[None, self._layout.carrier]
        at_rest = np.zeros((1, carrier_outputs(self._carrier)))
        for name, pickup in self.pickups.items():
            # As if the drive had hung there at rest for ever.
            pickup.reset(self._felt(name, self._carrier.stopped(start), at_rest, np.zeros(1))[0])

    def trajectory(self, steps: np.ndarray, rows: np.ndarray, spindle: np.ndarray) -> Trajectory:
        """The trajectory of some steps; readings of sensors go on from the last.

        Args:
            steps: the rows' steps, 1 being the first of a run; with sensors none is left out.
                Shape (rows,).
            rows: as the kernel writes them, shape (rows, width).
            spindle: angle and speed of the profile, and the speed asked for, shape (rows, 3).
        """
        samples = self._samples(steps, rows, spindle)
        if len(steps):
            states, beyond = rows[:, self._layout.carrier], rows[:, self._layout.size : -1]
            for (name, pickup), at in zip(self.pickups.items(), self._readings(), strict=True):
                force = self._felt(name, states, beyond, samples[:, 2])
                samples[:, at] = pickup.process(int(steps[0]), force)
        return Trajectory(self.channels, samples)

    def present(
        self, step: int, row: np.ndarray, spindle: tuple[float, float, float]
    ) -> Trajectory:
        """One sample; the readings of sensors are those that they hold.

        Args:
            step: the row's.
            row: shape (width,).
            spindle: as a row of ``trajectory``.
        """
        samples = self._samples(np.array([step]), row[None, :], np.array([spindle]))
        for pickup, at in zip(self.pickups.values(), self._readings(), strict=True):
            samples[:, at] = pickup.reading
        return Trajectory(self.channels, samples)

    def observation(self, present: Trajectory, time: float, stuck: np.ndarray) -> Observation:
        """One sample with what follows from it.

        Args:
            present: as ``present`` gives it.
            time: s.
            stuck: whether friction holds a ball on the race, shape (balls,).
        """
        row = present.samples[0]
        psi, omega, command = (float(x) for x in row[2:5])
        place, velocity = present.position[0], present.velocity[0]
        c, s = math.cos(psi), math.sin(psi)
        turn = np.array([[c, s], [-s, c]])
        theta, rate = present.ball_angles[0], present.ball_rates[0]
        return Observation(
            time=time,
            steps=int(row[0]),
            psi=psi,
            omega=omega,
            command=command,
            u=turn @ place[:2],
            v=turn @ velocity[:2],
            position=place,
            velocity=velocity,
            acceleration=present.acceleration[0],
            turn=present.turn[0],
            angular_velocity=present.angular_velocity[0],
            angular_acceleration=present.angular_acceleration[0],
            theta=theta.copy(),
            theta_rate=rate.copy(),
            stuck=stuck,
            driving_force=self._driven.forces(present)[0],
            motor_torque=float(present["motor_torque"][0]) if self._motor else math.nan,
            readings={name: pickup.reading for name, pickup in self.pickups.items()},
        )

    def _readings(self) -> list[slice]:
        """Columns of each sensor's readings."""
        ways, first = self._ways, len(self.channels) - self._ways * len(self.pickups)
        return [slice(at, at + ways) for at in range(first, len(self.channels), ways)]

    def _felt(
        self, name: str, states: np.ndarray, beyond: np.ndarray, psi: np.ndarray
    ) -> np.ndarray:
        """Specific force where a sensor is, on the deck's axes [m/s^2], shape (samples, ways)."""
        point = np.array(self._scene.sensors[name].position)
        force: np.ndarray = self._carrier.felt(self._system, states, beyond, psi, point)
        return force

    def _samples(self, steps: np.ndarray, rows: np.ndarray, spindle: np.ndarray) -> np.ndarray:
        layout, balls = self._layout, self._balls
        samples = np.empty((len(rows), len(self.channels)))
        samples[:, 0] = steps
        samples[:, 1] = samples[:, 0] * self._step
        samples[:, 2:5] = spindle
        if self._motor:
            samples[:, 2:4] = rows[:, layout.spindle][:, :2]
        beyond = rows[:, layout.size : -1]
        own = self._carrier.read(rows[:, layout.carrier], beyond, samples[:, 2])
        samples[:, len(SPINDLE_CHANNELS) : balls] = own
        after = balls + 2 * self._scene.balls.count
        samples[:, balls:after:2] = rows[:, layout.angles]
        samples[:, balls + 1 : after : 2] = rows[:, layout.rates]
        if self._motor:
            samples[:, after] = rows[:, -1]
        return samples


def follow(stretch: Stretch, step: float, spindle: np.ndarray) -> None:
    """Fill in the profile's angle [rad] and speed [rad/s] at the end of each of the steps.

    Args:
        stretch: where the steps lie.
        step: s.
        spindle: shape (steps, 2), one row for a part of a step.
    """
    piece = stretch.piece
    local = np.arange(stretch.first + 1, stretch.first + 1 + len(spindle)) * step - piece.start
    spindle[:, 0] = piece.start_angle + piece.segment.angle(local)
    spindle[:, 1] = piece.segment.speed(local)
