"""When to leave the variable-speed period: the decisions of a spindle's firmware, and nothing else.

No middleware and no clock: whoever uses it hands over samples as they come, calls ``tick`` at a
fixed rate and sends what that returns. ``c/start_up.c`` is the same, line by line.

At a speed a little above the critical one the whirl is large and drives the balls to where they
balance; there the vibration that turns with the spindle goes down, and that is what is watched: it
is the unbalance that is left, where the whole vibration also holds the deck's slowly dying free
whirl, noise and gravity.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass

TURN = 2.0 * math.pi


@dataclass(frozen=True)
class Settings:
    """What the drive's designer says; the defaults fit the scene ``balanced-start-up``."""

    ramp: float = 200.0
    """rad/s^2, up and down; less than the drive's ``spindle.max_acceleration``."""
    hold_speed: float = 110.0
    """rad/s; a tenth above the critical speed of 100 rad/s."""
    final_speed: float = 200.0
    """rad/s."""
    turns: float = 10.0
    """Whole turns over which the vibration that turns with the spindle is measured."""
    quiet: float = 0.1
    """The hold is over when that vibration is down to this share of its largest there ..."""
    permissible: float = 1.2
    """... or to this [m/s^2]: what a balanced drive may shake there. One that is quiet from the
    beginning has no large vibration to compare with."""
    longest_hold: float = 8.0
    """s; after that it goes on anyway, and says so."""
    settle: float = 2.0
    """s at the final speed before the vibration is judged."""
    limit: float = 150.0
    """m/s^2; a larger vibration at any time ends the run."""
    silence: float = 2.0
    """s without a good sample of either kind after which the run ends."""
    catching_up: float = 5.0
    """s that the spindle may need for reaching the speed that is commanded."""


class StartUp:
    """One start-up: waiting, run up, hold, to final, at speed; run down and off at any time.

    Args:
        settings: of the drive.
        say: told each decision, in a line for people.
    """

    def __init__(self, settings: Settings, say: Callable[[str], None] = print) -> None:
        self.settings, self._say = settings, say
        self.state = "waiting"
        self.failed = False
        self.command = 0.0
        self.amplitude = math.nan
        """Of the vibration that turns with the spindle, over the last whole window [m/s^2]."""
        self._in_state = 0.0
        self._largest = 0.0
        self._judged = False
        self._angle = self._speed = 0.0
        self._angle_time = self._vibration_time = -math.inf
        self._spindle_silent = self._vibration_silent = math.inf
        self._sum, self._count, self._begin = 0j, 0, 0.0

    def spindle(self, time: float, angle: float, speed: float) -> None:
        """A sample of the spindle: when [s], angle [rad], speed [rad/s]."""
        if not (math.isfinite(angle) and math.isfinite(speed)):
            return  # As good as silence.
        if time < self._angle_time:
            self._time_went_back()
        self._angle_time, self._angle, self._speed = time, angle, speed
        self._spindle_silent = 0.0

    def vibration(self, time: float, x: float, y: float) -> None:
        """A sample of the deck's acceleration [m/s^2] along two axes across the shaft."""
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
        # The samples need not come in pairs: the spindle goes on from its last one.
        angle = self._angle + self._speed * (time - self._angle_time)
        if self._count == 0:
            self._begin = angle
        self._sum += complex(x, y) * cmath.exp(-1j * angle)
        self._count += 1
        if abs(angle - self._begin) >= self.settings.turns * TURN:
            # From too few samples a turn, one cannot tell what turns from what does not.
            if self._count >= 4 * self.settings.turns:
                self._window(abs(self._sum) / self._count)
            self._sum, self._count = 0j, 0

    def tick(self, passed: float) -> float:
        """To be called at a fixed rate: the speed to command now [rad/s].

        Args:
            passed: s since the last call.
        """
        settings = self.settings
        self._in_state += passed
        self._spindle_silent += passed
        self._vibration_silent += passed
        heard = max(self._spindle_silent, self._vibration_silent) <= settings.silence
        if self.state == "waiting":
            if heard:
                # The disc may be turning already: this firmware may have been restarted.
                self.command = self._speed
                self._enter("run up", f"to {settings.hold_speed:g} rad/s")
            return self.command
        if not heard:
            self.fail(f"no good sample for {settings.silence:g} s")
        if self.state == "run up" and self._reached(settings.hold_speed, passed):
            self._largest = 0.0
            self._enter("hold", f"at {settings.hold_speed:g} rad/s, until the balls are in place")
        elif self.state == "hold" and self._in_state >= settings.longest_hold:
            self._leave_hold("though that is not quiet: the hold was as long as it may be")
        elif self.state == "to final" and self._reached(settings.final_speed, passed):
            self._enter("at speed", f"of {settings.final_speed:g} rad/s")
        elif self.state == "run down" and self._reached(0.0, passed):
            self._enter("off", "standing still")
        return self.command

    def stop(self) -> None:
        """Run down; nothing new if that is under way."""
        if self.state == "waiting":
            self._enter("off", "never started")
        elif self.state not in ("run down", "off"):
            self._enter("run down", "asked to stop")

    def fail(self, why: str) -> None:
        """Run down because of a failure; while running down for another reason, note it."""
        if self.state == "off" or (self.state == "run down" and self.failed):
            return
        self.failed = True
        self._enter("run down", f"failure: {why}")

    def _reached(self, goal: float, passed: float) -> bool:
        """One more step along the ramp; whether the spindle is there, too."""
        change = self.settings.ramp * passed
        self.command += min(max(goal - self.command, -change), change)
        if self.command != goal:
            self._in_state = 0.0
        elif abs(self._speed - goal) <= 0.01 * self.settings.hold_speed:
            return True
        elif self._in_state > self.settings.catching_up:
            if self.state == "run down":
                self._enter("off", f"though the spindle was last heard at {self._speed:.3g} rad/s")
            else:
                self.fail(f"the spindle stays at {self._speed:.4g} rad/s, commanded {goal:g}")
        return False

    def _window(self, amplitude: float) -> None:
        """The vibration that turns with the spindle, over some whole turns."""
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
        """The drive was reset: it stands still, and a ramp down would first set it going."""
        self._vibration_time = self._angle_time = -math.inf
        self._sum, self._count = 0j, 0
        self.fail("the drive's time went back")
        self.command = 0.0
