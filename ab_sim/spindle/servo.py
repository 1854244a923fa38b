"""The speed servo: follows live commands with a limited acceleration."""

import math
from typing import NamedTuple

from ab_sim.errors import CommandError, exact
from ab_sim.spindle.profile import SpeedProfile
from ab_sim.spindle.segments import Ramp


class SpeedServo(NamedTuple):
    """Drives the spindle to a commanded speed at a constant acceleration, then holds it."""

    max_speed: float
    """rad/s; a command beyond this magnitude is rejected."""
    max_acceleration: float
    """rad/s^2."""

    def accepts(self, command: float) -> bool:
        """Whether a command [rad/s] may be followed; one that is no number may not."""
        return abs(command) <= self.max_speed

    def check(self, command: float) -> float:
        """The command itself [rad/s], if it may be followed.

        Raises:
            CommandError: it is not a finite number or beyond ``max_speed``.
        """
        try:
            command = float(command)
        except (TypeError, ValueError, OverflowError) as error:
            raise CommandError(f"command = {command!r}: must be a number [rad/s]") from error
        if not math.isfinite(command):
            raise CommandError(
                f"command = {command} rad/s: must be a finite number; the speed stays as it was"
            )
        if not self.accepts(command):
            raise CommandError(
                f"command = {exact(command)} rad/s: must be within +-{exact(self.max_speed)} rad/s "
                "(spindle.max_speed of the scene); the speed stays as it was"
            )
        return command

    def approach(self, time: float, angle: float, speed: float, command: float) -> SpeedProfile:
        """The profile from now on: from ``speed`` to ``command`` [rad/s], from ``time`` [s] on."""
        target = self.check(command)
        slope = math.copysign(self.max_acceleration, target - speed)
        duration = (target - speed) / slope
        ramp = [(duration, Ramp(speed, slope))] if duration > 0 else []
        return SpeedProfile(ramp, target, start=time, start_angle=angle)
