"""A start-up whose speed a controller decides while it runs, from what a sensor reads."""

import math
from collections.abc import Mapping
from typing import Literal

from ab_sim.control import SensorFacts, StartUpSettings, checked
from ab_sim.errors import InputError, exact, nearest
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.section import Section
from ab_sim.scene.segments import KIND
from ab_sim.scene.sensors import RATE_TOLERANCE, Sampled, SensorName

LEAST_SAMPLES = 4
"""Samples in a turn at the target speed, below which they do not show how large the whirl is."""


class RunUp(Section):
    """What kinds of profiles that run up to a speed have in common."""

    acceleration: Number = quantity("of the run-up", "rad/s^2", ge=1e-6, le=1e6)
    target_speed: Number = quantity("speed that is kept at the end", "rad/s", gt=0, le=1e5)


class AdaptiveProfile(RunUp):
    """A start-up that finds the critical speed and dwells by itself (``ab_sim.control``).

    It knows neither the drive's stiffness nor its unbalance: a sensor's readings, the spindle's
    angle and its speed tell it, and once per ``command_period`` it commands a speed, which changes
    by no more than the acceleration.
    """

    kind: Literal["adaptive"] = KIND
    sensor: SensorName = quantity(
        "which of the scene's sensors or probes it is told of, by its name", "-"
    )
    command_period: Number = quantity(
        "time between two commands; a whole number of steps", "s", ge=1e-4, le=0.1, default=0.005
    )

    def steps_per_command(self, step: float) -> int:
        """How many integration steps of ``step`` [s] there are between two commands.

        Raises:
            ValueError: not a whole number; names the nearest periods that are.
        """
        steps = self.command_period / step
        whole = max(1, round(steps))
        if abs(steps - whole) <= RATE_TOLERANCE * whole:
            return whole
        below = math.floor(steps)
        nearby = [f"{count * step:.10g}" for count in (below, below + 1) if count]
        raise ValueError(
            f"profile.command_period = {exact(self.command_period)} s: must be a whole number of "
            f"steps of solver.step = {step:g} s; the nearest such: {' and '.join(nearby)} s"
        )

    def settings(self, sensing: SensorFacts, limit: float = math.inf) -> StartUpSettings:
        """What its controller is told.

        Args:
            sensing: of the sensor.
            limit: of the sensor's readings, in their unit.
        """
        return StartUpSettings(
            self.target_speed, self.acceleration, sensing, self.command_period, limit=limit
        )

    def check_start(self, first: float) -> None:
        """See whether a run may begin at a speed [rad/s].

        Raises:
            ValueError: names the key, its value and what is allowed.
        """
        try:
            checked(self.settings(SensorFacts("acceleration", 2)))
        except InputError as error:
            raise ValueError(f"profile of kind adaptive: {error}") from error
        # A state that was recorded at the target speed has it but for rounding.
        if not 0.0 <= first <= self.target_speed * (1.0 + RATE_TOLERANCE):
            raise ValueError(
                f"start.speed = {exact(first)} rad/s: an adaptive start-up begins between 0 and "
                f"profile.target_speed = {exact(self.target_speed)} rad/s"
            )

    def check_sensors(self, sensors: Mapping[str, Sampled], step: float | None) -> None:
        """See whether a scene's sensors and step tell it what it needs.

        Args:
            sensors: by name, probes among them.
            step: integration step [s]; None while it is not chosen yet, and then only those are
                that suit.

        Raises:
            ValueError: names the key, its value and what is allowed.
        """
        sensor = sensors.get(self.sensor)
        if sensor is None:
            known = f"has {', '.join(sensors)}" if sensors else "has no sensor"
            raise ValueError(
                f"profile.sensor = {self.sensor!r}: there is no such sensor, the scene {known}"
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
