"""The speed servo: follows live commands with limited acceleration."""

import math
from typing import NamedTuple

from ab_sim.base.errors import CommandError, exact, short
from ab_sim.model.spindle.schedule import SpeedSchedule
from ab_sim.model.spindle.speed_laws import Ramp


class SpeedServo(NamedTuple):
    """Servo that drives the spindle to a speed at constant acceleration, then holds it."""

    max_speed: float
    """Largest speed [rad/s]; a command beyond this magnitude is rejected."""
    max_acceleration: float
    """Largest acceleration [rad/s^2]."""

    def accepts(self, command: float) -> bool:
        """Return whether a command [rad/s] may be followed; NaN may not."""
        return abs(command) <= self.max_speed

    def check(self, command: float, name: str = "command") -> float:
        """Return the command [rad/s], if it may be followed; ``name`` is for the error's text.

        Raises:
            CommandError: the command is not a finite number, or is beyond ``max_speed``.
        """
        command = _as_float(name, command, "rad/s")
        if not abs(command) < math.inf:
            raise CommandError(
                f"{name} = {command} rad/s: must be a finite number; the speed stays as it was"
            )
        if not self.accepts(command):
            raise CommandError(
                f"{name} = {exact(command)} rad/s: must be within +-{exact(self.max_speed)} rad/s "
                "(spindle.max_speed of the scene, or a limit set below it); the speed stays as it "
                "was"
            )
        return command

    def check_acceleration(self, acceleration: float) -> float:
        """Return the acceleration [rad/s^2], if the servo may use it.

        Raises:
            CommandError: the acceleration is not a number, not above 0, or beyond
                ``max_acceleration``.
        """
        acceleration = _as_float("acceleration", acceleration, "rad/s^2")
        if not 0.0 < acceleration <= self.max_acceleration:
            raise CommandError(
                f"acceleration = {exact(acceleration)} rad/s^2: must be above 0 and at most "
                f"{exact(self.max_acceleration)} rad/s^2 (spindle.max_acceleration of the scene)"
            )
        return acceleration

    def approach(
        self, time: float, angle: float, speed: float, command: float, acceleration: float
    ) -> SpeedSchedule:
        """Return the schedule from ``speed`` to ``command`` [rad/s], from ``time`` [s] on."""
        target = self.check(command)
        slope = math.copysign(self.check_acceleration(acceleration), target - speed)
        duration = (target - speed) / slope
        ramp = [(duration, Ramp(speed, slope))] if duration > 0 else []
        return SpeedSchedule(ramp, target, start=time, start_angle=angle)


def _as_float(name: str, value: float, unit: str) -> float:
    """Return a number as a float.

    An int beyond the range of floats is returned unchanged, so that it is reported as too large.
    """
    try:
        return float(value)
    except OverflowError:
        return value
    except (TypeError, ValueError) as error:
        raise CommandError(f"{name} = {short(value)}: must be a number [{unit}]") from error
