"""The speed servo: follows live commands with a limited acceleration."""

import math
from typing import NamedTuple

from ab_sim.errors import CommandError, exact
from ab_sim.quoting import short
from ab_sim.spindle.schedule import SpeedSchedule
from ab_sim.spindle.speed_laws import Ramp


class SpeedServo(NamedTuple):
    """Drives the spindle to a commanded speed at a constant acceleration, then holds it."""

    max_speed: float
    """rad/s; a command beyond this magnitude is rejected."""
    max_acceleration: float
    """rad/s^2."""

    def accepts(self, command: float) -> bool:
        """Whether a command [rad/s] may be followed; one that is no number may not."""
        return abs(command) <= self.max_speed

    def check(self, command: float, name: str = "command") -> float:
        """Return the command [rad/s], if it may be followed; ``name`` is for the error's text.

        Raises:
            CommandError: it is not a finite number or beyond ``max_speed``.
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
        """The acceleration itself [rad/s^2], if the spindle can do it.

        Raises:
            CommandError: it is no number, not above 0, or beyond ``max_acceleration``.
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
        """The profile from now on: from ``speed`` to ``command`` [rad/s], from ``time`` [s] on."""
        target = self.check(command)
        slope = math.copysign(self.check_acceleration(acceleration), target - speed)
        duration = (target - speed) / slope
        ramp = [(duration, Ramp(speed, slope))] if duration > 0 else []
        return SpeedSchedule(ramp, target, start=time, start_angle=angle)


def _as_float(name: str, value: float, unit: str) -> float:
    """A number; an int beyond all floats as it is, to be told as beyond what is allowed."""
    try:
        return float(value)
    except OverflowError:
        return value
    except (TypeError, ValueError) as error:
        raise CommandError(f"{name} = {short(value)}: must be a number [{unit}]") from error
