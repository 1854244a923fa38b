"""Decisions of a start-up firmware: when to leave the variable-speed period.

The module needs no middleware and no clock. Its caller passes samples as they arrive, calls
``tick`` at a fixed rate, and sends the speed that ``tick`` returns. ``c/start_up.c`` is the same
code in C.

Slightly above the critical speed, the whirl is large and drives the balls to the balanced
position. The firmware holds this speed until the vibration that turns with the spindle has fallen.
This part of the vibration is caused by the residual unbalance; the total vibration also contains
the slowly decaying free whirl of the deck, noise and gravity.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass

TURN = 2.0 * math.pi


@dataclass(frozen=True)
class Settings:
    """Settings for one drive; the defaults fit the scene ``balanced-start-up``."""

    ramp: float = 200.0
    """Acceleration up and down [rad/s^2]; less than the drive's ``spindle.max_acceleration``."""
    hold_speed: float = 110.0
    """Speed of the hold [rad/s]: a tenth above the critical speed of 100 rad/s."""
    final_speed: float = 200.0
    """Running speed [rad/s]."""
    turns: float = 10.0
    """Number of turns over which the vibration that turns with the spindle is averaged."""
    quiet: float = 0.1
    """Share of its largest value in the hold to which this vibration must fall, to end the hold."""
    permissible: float = 1.2
    """Vibration [m/s^2] that also ends the hold: the limit for a balanced drive. A drive that is
    quiet from the beginning has no large vibration to compare with."""
    longest_hold: float = 8.0
    """Longest duration of the hold [s]; then the start-up continues, and reports this."""
    settle: float = 2.0
    """Time at the final speed before the vibration is judged [s]."""
    limit: float = 150.0
    """Largest allowed vibration [m/s^2]; a larger one ends the run."""
    silence: float = 2.0
    """Time without valid samples of spindle or vibration after which the run ends [s]."""
    catching_up: float = 5.0
    """Longest time for the spindle to reach the commanded speed [s]."""


class StartUp:
    """One start-up, in the states waiting, run up, hold, to final, at speed, run down, off.

    Parameters
    ----------
    settings
        Settings for the drive.
    say
        Function that is called with each decision, as a line of text.
    """

    def __init__(self, settings: Settings, say: Callable[[str], None] = print) -> None:
        self.settings, self._say = settings, say
        self.state = "waiting"
        self.failed = False
        self.command = 0.0
        self.amplitude = math.nan
        """Amplitude of the vibration that turns with the spindle, over the last window [m/s^2]."""
        self._in_state = 0.0
        self._largest = 0.0
        self._judged = False
        self._angle = self._speed = 0.0
        self._angle_time = self._vibration_time = -math.inf
        self._spindle_silent = self._vibration_silent = math.inf
        self._sum, self._count, self._begin = 0j, 0, 0.0

    def spindle(self, time: float, angle: float, speed: float) -> None:
        """Process a sample of the spindle: time [s], angle [rad], speed [rad/s]."""
        if not (math.isfinite(angle) and math.isfinite(speed)):
            return  # An invalid sample counts as silence.
        if time < self._angle_time:
            self._time_went_back()
        self._angle_time, self._angle, self._speed = time, angle, speed
        self._spindle_silent = 0.0

    def vibration(self, time: float, x: float, y: float) -> None:
        """Process a sample of the deck's acceleration along two axes across the shaft [m/s^2]."""
        if not (math.isfinite(x) and math.isfinite(y)):
            return
        if time < self._vibration_time:
            self._time_went_back()
        self._vibration_time = time
        self._vibration_silent = 0.0
        if math.hypot(x, y) > self.settings.limit:
            self.fail(f"vibration of {math.hypot(x, y):.3g} m/s^2")
        if not math.isfinite(self._angle_time):
            return
        # Spindle and vibration may be sampled at different times: extrapolate the angle.
        angle = self._angle + self._speed * (time - self._angle_time)
        if self._count == 0:
            self._begin = angle
        self._sum += complex(x, y) * cmath.exp(-1j * angle)
        self._count += 1
        if abs(angle - self._begin) >= self.settings.turns * TURN:
            # With fewer samples per turn, parts of the vibration that do not turn would alias.
            if self._count >= 4 * self.settings.turns:
                self._window(abs(self._sum) / self._count)
            self._sum, self._count = 0j, 0

    def tick(self, passed: float) -> float:
        """Return the speed to command now [rad/s]; call this method at a fixed rate.

        Parameters
        ----------
        passed
            Time since the last call [s].
        """
        settings = self.settings
        self._in_state += passed
        self._spindle_silent += passed
        self._vibration_silent += passed
        valid = max(self._spindle_silent, self._vibration_silent) <= settings.silence
        if self.state == "waiting":
            if valid:
                # The disc may be turning already, if this firmware was restarted.
                self.command = self._speed
                self._enter("run up", f"to {settings.hold_speed:g} rad/s")
            return self.command
        if not valid:
            self.fail(f"no valid sample for {settings.silence:g} s")
        if self.state == "run up" and self._reached(settings.hold_speed, passed):
            self._largest = 0.0
            self._enter("hold", f"at {settings.hold_speed:g} rad/s, until the balls are in place")
        elif self.state == "hold" and self._in_state >= settings.longest_hold:
            self._leave_hold("not quiet, but the longest hold is over")
        elif self.state == "to final" and self._reached(settings.final_speed, passed):
            self._enter("at speed", f"{settings.final_speed:g} rad/s")
        elif self.state == "run down" and self._reached(0.0, passed):
            self._enter("off", "standing still")
        return self.command

    def stop(self) -> None:
        """Run down to standstill; if that is in progress, do nothing."""
        if self.state == "waiting":
            self._enter("off", "never started")
        elif self.state not in ("run down", "off"):
            self._enter("run down", "stop requested")

    def fail(self, why: str) -> None:
        """Run down because of a failure; if already running down, record the failure only."""
        if self.state == "off" or (self.state == "run down" and self.failed):
            return
        self.failed = True
        self._enter("run down", f"failure: {why}")

    def _reached(self, goal: float, passed: float) -> bool:
        """Move the command one step towards a speed; return whether the spindle has reached it.

        Parameters
        ----------
        goal
            Speed to reach [rad/s].
        passed
            Time since the last call [s].
        """
        change = self.settings.ramp * passed
        self.command += min(max(goal - self.command, -change), change)
        if self.command != goal:
            self._in_state = 0.0
        elif abs(self._speed - goal) <= 0.01 * self.settings.hold_speed:
            return True
        elif self._in_state > self.settings.catching_up:
            if self.state == "run down":
                self._enter("off", f"but the last reported speed is {self._speed:.3g} rad/s")
            else:
                self.fail(f"the spindle stays at {self._speed:.4g} rad/s, commanded {goal:g}")
        return False

    def _window(self, amplitude: float) -> None:
        """Decide on a new amplitude of the vibration that turns with the spindle [m/s^2]."""
        self.amplitude = amplitude
        if self.state == "hold":
            self._largest = max(self._largest, amplitude)
            if amplitude <= max(self.settings.quiet * self._largest, self.settings.permissible):
                self._leave_hold("quiet")
        elif self.state == "at speed" and not self._judged:
            if self._in_state >= self.settings.settle:
                self._judged = True
                whirl = amplitude / self._speed**2
                self._say(f"balanced to {amplitude:.3g} m/s^2, a whirl of {1e6 * whirl:.3g} um")

    def _leave_hold(self, why: str) -> None:
        now = f"vibration {self.amplitude:.3g} of at most {self._largest:.3g} m/s^2"
        self._enter("to final", f"after {self._in_state:.2f} s, {now}, {why}")

    def _enter(self, state: str, why: str) -> None:
        self.state = state
        self._in_state = 0.0
        self._sum, self._count = 0j, 0
        self._say(f"{state}: {why}")

    def _time_went_back(self) -> None:
        """Fail because the drive was reset. It stands still; a ramp down would first start it."""
        self._vibration_time = self._angle_time = -math.inf
        self._sum, self._count = 0j, 0
        self.fail("the drive's time went back")
        self.command = 0.0
