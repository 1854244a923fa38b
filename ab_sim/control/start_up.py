"""A start-up that finds its own way: sensor and spindle in, speed commands out."""

import math

from ab_sim.control.belief import Belief, Decision, State
from ab_sim.control.settings import Settings, checked


class StartUp:
    """Runs a drive up so that its balls balance it, without knowing the drive.

    It has no clock, allocates nothing that grows, and is deterministic: the same calls give the
    same commands to the bit. ``examples/firmware_prototype/c/adaptive.c`` is the same in C.

    Parameters
    ----------
    settings : Settings
        The drive's limits and its sensor.

    Raises
    ------
    InputError
        A setting is out of range.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = checked(settings)
        self.state = State.WAITING
        self.words = "waiting: for the first sample"
        self.decision = Decision(0, "")
        self._command = 0.0
        self._time = math.nan
        self._heard = 0.0
        self._speed = math.nan

    def sample(
        self, time: float, angle: float, speed: float, first: float, second: float = 0.0
    ) -> None:
        """One reading of the sensor.

        Parameters
        ----------
        time : float
            On the sensor's clock [s].
        angle, speed : float
            Of the spindle at that time [rad, rad/s]; the angle may be wrapped or not.
        first, second : float
            The reading along each axis [m or m/s^2]; the second counts with two axes only.
        """
        if all(map(math.isfinite, (time, angle, speed, first, second))):
            self._heard, self._speed = 0.0, speed

    def command(self, time: float) -> float:
        """Once a period: decide.

        Parameters
        ----------
        time : float
            On the caller's clock [s].

        Returns
        -------
        float
            The speed to command now [rad/s]; it changes by at most the acceleration times the
            period.
        """
        settings, period = self.settings, self.settings.period
        self._time = time
        self._heard += period
        if self.state is State.WAITING and not math.isnan(self._speed):
            self._command = self._speed
            self._enter(State.RUN_UP, f"to {settings.final_speed:g} rad/s")
        if not (self.state in (State.WAITING, State.ABORTING) or self.state.over):
            if self._heard > settings.silence:
                self.abort(time, f"no good sample for {settings.silence:g} s")
        if self.state is State.RUN_UP and self._towards(settings.final_speed):
            self._enter(State.DONE, "at the final speed")
        if self.state is State.ABORTING and self._towards(0.0):
            self._enter(State.ABORTED, "standing still")
        return self._command

    def abort(self, time: float, why: str) -> None:
        """Run down to standstill; nothing new if that is under way.

        Parameters
        ----------
        time : float
            On the caller's clock [s].
        why : str
            For people.
        """
        if self.state not in (State.ABORTING, State.ABORTED):
            self._enter(State.ABORTING, why)

    @property
    def belief(self) -> Belief:
        """What it believes of the drive."""
        return Belief(math.nan, math.nan, complex(math.nan, math.nan), math.nan, math.nan, 0, 0)

    def state_numbers(self) -> tuple[float, ...]:
        """Its whole state, to go on from with ``restore``; in C the same numbers in this order."""
        return (float(self.state), self._command, self._time, self._heard, self._speed)

    def restore(self, numbers: tuple[float, ...]) -> None:
        """Go on from a state of a ``StartUp`` with the same settings.

        Raises
        ------
        ValueError
            It is no such state.
        """
        if len(numbers) != 5:
            raise ValueError(f"a state has 5 numbers, not {len(numbers)}")
        state, self._command, self._time, self._heard, self._speed = numbers
        self.state = State(int(state))
        self.words = self.state.text

    def _towards(self, goal: float) -> bool:
        change = self.settings.acceleration * self.settings.period
        self._command += min(max(goal - self._command, -change), change)
        return self._command == goal

    def _enter(self, state: State, why: str) -> None:
        self.state = state
        self.words = f"{state.text}: {why}"
        self.decision = Decision(self.decision.number + 1, self.words)
