"""From the rows that a kernel writes to a trajectory."""

from typing import Any

import numpy as np

from ab_sim.drive.trajectory import Trajectory, channels_for
from ab_sim.dynamics.system import gravity, has_motor
from ab_sim.scene.model import Scene
from ab_sim.sensing import Pickup
from ab_sim.spindle.stretches import Stretch

BEYOND_STATES = 3
"""Columns of a row behind the states: the deck's acceleration on rotating axes, the torque."""


class RowReader:
    """How a scene's rows are read.

    Args:
        scene: what the rows are of.
        effects: the scene's, as its system has them.
    """

    def __init__(self, scene: Scene, effects: tuple[Any, ...]) -> None:
        self._balls, self._step = scene.balls.count, scene.solver.step
        self._motor = bool(has_motor(effects))
        self._gravity = np.array(gravity(effects))
        self.pickups = {name: Pickup(sensor, self._step) for name, sensor in scene.sensors.items()}
        self.channels = channels_for(self._balls, self._motor, scene.sensors)
        self.reset()

    def reset(self) -> None:
        """Back to t = 0."""
        for pickup in self.pickups.values():
            # As if the drive had hung at rest for ever.
            pickup.reset(-self._gravity)

    def trajectory(self, steps: np.ndarray, rows: np.ndarray, spindle: np.ndarray) -> Trajectory:
        """The trajectory of some steps; readings of sensors go on from the last.

        Args:
            steps: the rows' steps, 1 being the first of a run; with sensors none is left out.
                Shape (rows,).
            rows: as the kernel writes them, shape (rows, states + 3).
            spindle: angle and speed of the profile, and the speed asked for, shape (rows, 3).
        """
        n = self._balls
        samples = np.empty((len(rows), len(self.channels)))
        samples[:, 0] = steps
        samples[:, 1] = samples[:, 0] * self._step
        samples[:, 2:5] = spindle
        if self._motor:
            samples[:, 2:4] = rows[:, 4 + 2 * n : 6 + 2 * n]
        c, s = np.cos(samples[:, 2]), np.sin(samples[:, 2])
        for column, at in ((5, 0), (7, 2), (9, rows.shape[1] - BEYOND_STATES)):
            one, two = rows[:, at], rows[:, at + 1]
            samples[:, column] = c * one - s * two
            samples[:, column + 1] = s * one + c * two
        after = 11 + 2 * n
        samples[:, 11:after:2] = rows[:, 4 : 4 + n]
        samples[:, 12:after:2] = rows[:, 4 + n : 4 + 2 * n]
        if self._motor:
            samples[:, after] = rows[:, -1]
        if len(steps):
            force = samples[:, 9:11] - self._gravity
            for at, pickup in enumerate(self.pickups.values()):
                column = after + self._motor + 2 * at
                samples[:, column : column + 2] = pickup.process(int(steps[0]), force)
        return Trajectory(self.channels, samples)


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
