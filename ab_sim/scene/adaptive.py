"""Adaptive start-up profile: a controller sets the speed during the run from sensor readings."""

import math
from collections.abc import Mapping
from typing import Literal

from ab_sim.base.errors import InputError, exact, nearest
from ab_sim.control import SensorFacts, StartUpSettings, checked
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.section import Section
from ab_sim.scene.segments import KIND
from ab_sim.scene.sensors import RATE_TOLERANCE, Sampled, SensorName

LEAST_SAMPLES = 4
"""Smallest number of samples per turn at the target speed; fewer do not show the whirl's size."""


class RunUp(Section):
    """Common part of profiles that run up to a speed."""

    acceleration: Number = quantity("acceleration of the run-up", "rad/s^2", ge=1e-6, le=1e6)
    target_speed: Number = quantity("final speed", "rad/s", gt=0, le=1e5)


class AdaptiveProfile(RunUp):
    """A start-up that finds the critical speed and dwells automatically (``ab_sim.control``).

    The controller is not given the drive's stiffness or unbalance. It estimates them from a
    sensor's readings, the spindle's angle and its speed. Once per ``command_period`` it commands a
    speed. The commanded speed changes at most at the rate ``acceleration``.
    """

    kind: Literal["adaptive"] = KIND
    sensor: SensorName = quantity(
        "name of the sensor or probe in the scene whose readings the controller gets", "-"
    )
    command_period: Number = quantity(
        "time between two commands, a whole number of steps", "s", ge=1e-4, le=0.1, default=0.005
    )

    def steps_per_command(self, step: float) -> int:
        """Return the number of integration steps of ``step`` [s] between two commands.

        Raises:
            ValueError: the number is not an integer; the message names the nearest periods that
                fit.
        """
        steps = self.command_period / step
        whole = max(1, round(steps))
        if abs(steps - whole) <= RATE_TOLERANCE * whole:
            return whole
        below = math.floor(steps)
        nearby = [f"{count * step:.10g}" for count in (below, below + 1) if count]
        raise ValueError(
            f"profile.command_period = {exact(self.command_period)} s: must be a whole number of "
            f"steps of solver.step = {step:g} s; nearest: {' and '.join(nearby)} s"
        )

    def settings(self, sensing: SensorFacts, limit: float = math.inf) -> StartUpSettings:
        """Return the settings of the controller.

        Args:
            sensing: properties of the sensor.
            limit: largest reading of the sensor, in its unit.
        """
        return StartUpSettings(
            self.target_speed, self.acceleration, sensing, self.command_period, limit=limit
        )

    def check_start(self, first: float) -> None:
        """Check that a run may begin at a speed [rad/s].

        Raises:
            ValueError: the speed is not allowed; the message names key, value and allowed range.
        """
        try:
            checked(self.settings(SensorFacts("acceleration", 2)))
        except InputError as error:
            raise ValueError(f"profile of kind adaptive: {error}") from error
        # A start speed from a recorded state at the target speed may exceed it by rounding.
        if not 0.0 <= first <= self.target_speed * (1.0 + RATE_TOLERANCE):
            raise ValueError(
                f"start.speed = {exact(first)} rad/s: an adaptive start-up begins between 0 and "
                f"profile.target_speed = {exact(self.target_speed)} rad/s"
            )

    def check_sensors(self, sensors: Mapping[str, Sampled], step: float | None) -> None:
        """Check that a scene's sensors and step suit the controller.

        Args:
            sensors: sensors and probes by name.
            step: integration step [s]; None if a step that suits the controller is chosen later.

        Raises:
            ValueError: the sensor is missing or samples too slowly, or the command period is not
                a whole number of steps; the message names key, value and allowed range.
        """
        sensor = sensors.get(self.sensor)
        if sensor is None:
            has = f"has {', '.join(sensors)}" if sensors else "has no sensor"
            raise ValueError(
                f"profile.sensor = {self.sensor!r}: there is no such sensor, the scene {has}"
                f"{nearest(self.sensor, sensors)}; name one, or add it: sensors: {{{self.sensor}: "
                "{}}"
            )
        least = LEAST_SAMPLES * self.target_speed / (2.0 * math.pi)
        if sensor.sample_rate < least:
            raise ValueError(
                f"sample_rate of {self.sensor} = {sensor.sample_rate:.10g} Hz: an adaptive "
                f"start-up needs at least {LEAST_SAMPLES} samples in a turn, {least:.4g} Hz at "
                f"profile.target_speed = {exact(self.target_speed)} rad/s"
            )
        if step is not None:
            self.steps_per_command(step)
