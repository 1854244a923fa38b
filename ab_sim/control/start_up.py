"""Controller of the adaptive start-up: reads sensor and spindle, and commands the speed."""

import enum
import math
from typing import NamedTuple

from ab_sim.control import chosen
from ab_sim.control.observer import TEXTS, Observer, Reason
from ab_sim.control.settings import StartUpSettings, checked


class State(enum.IntEnum):
    """State of the start-up; the same numbers in C."""

    WAITING = 0
    """Waits for the first samples."""
    RUN_UP = 1
    """Accelerates, until there is an estimate of the critical speed to dwell at."""
    DWELL = 2
    """Holds a speed slightly above the critical speed, where the whirl moves the balls."""
    TO_FINAL = 3
    """Accelerates to the final speed after a dwell."""
    JUDGING = 4
    """Waits at the final speed, and judges the net unbalance."""
    RETRY = 5
    """Returns to the critical speed for another dwell."""
    DONE = 6
    """Holds the final speed, balanced."""
    GAVE_UP = 7
    """Holds the final speed, not balanced."""
    ABORTING = 8
    """Ramps down to standstill."""
    ABORTED = 9
    """Commands standstill."""

    @property
    def text(self) -> str:
        """Name in lower case, with spaces."""
        return self.name.lower().replace("_", " ")

    @property
    def over(self) -> bool:
        """True if the start-up has ended; an abort may still follow `DONE` and `GAVE_UP`."""
        return self in (State.DONE, State.GAVE_UP, State.ABORTED)


class Estimates(NamedTuple):
    """Estimates of the drive's parameters; NaN while unknown."""

    critical_speed: float
    critical_speed_deviation: float
    """Critical speed and its standard deviation [rad/s]."""
    net_unbalance: complex
    """Offset of the rotor's centre of mass, balls included, from the shaft [m], on axes that turn
    with the spindle."""
    net_unbalance_deviation: float
    """Standard deviation of the net unbalance [m]."""
    without_balls: float
    """Largest magnitude of the net unbalance since the critical speed was known [m], the scale for
    comparison. It approximates the unbalance before balls moved, and is usually between one and two
    times the unbalance of the rotor alone."""
    dwells: int
    retries: int
    """Number of dwells near the critical speed, and of returns for another dwell, so far."""


class Decision(NamedTuple):
    """Latest decision of the start-up."""

    number: int
    """Number of decisions so far; a caller sees by it that there is a new decision."""
    text: str
    """State and reason in plain words."""


def _words_of(
    state: State, reason: str, settings: StartUpSettings, estimates: Estimates, observer: Observer
) -> str:
    """Return the status text ``state: details`` of a start-up; ``reason`` is that of an abort."""
    deviation = estimates.critical_speed_deviation
    critical = f"critical speed {estimates.critical_speed:.1f} +- {deviation:.2g} rad/s"
    net = f"net unbalance {1e6 * abs(estimates.net_unbalance):.3g} um"
    if observer.scale > 0.0:
        net += f", {observer.fast / observer.scale:.0%} of the largest"
    circulating = ", balls circulate" if observer.circulating else ""
    is_known = observer.known == 1.0
    where = "the critical speed is not known yet"
    texts = {
        State.WAITING: "for the first samples",
        State.RUN_UP: f"towards {settings.final_speed:g} rad/s; {critical if is_known else where}",
        State.DWELL: f"number {estimates.dwells}, a little above the critical speed, where the "
        f"whirl drives the balls; {critical}, {net}{circulating}",
        State.TO_FINAL: f"dwell {estimates.dwells} is over; {net}{circulating}",
        State.JUDGING: f"at {settings.final_speed:g} rad/s; "
        f"{net if is_known else where}{circulating}",
        State.RETRY: f"number {estimates.retries}: {net}, and it does not fall{circulating}; back "
        f"to just above the critical speed",
        State.DONE: f"{net}; after {_count(estimates.dwells, 'dwell', 'dwells')}, {critical}",
        State.GAVE_UP: f"{net if is_known else 'the estimates are uncertain'}{circulating}; "
        f"stays at {settings.final_speed:g} rad/s after "
        f"{_count(estimates.retries, 'retry', 'retries')}",
        State.ABORTING: f"{reason}; runs down",
        State.ABORTED: f"{reason}; stands still",
    }
    return f"{state.text}: {texts[state]}"


def _count(number: int, one: str, several: str) -> str:
    return f"{number} {one if number == 1 else several}"


_OWN_NUMBERS = 16
"""Number of values in a state that precede the observer's; see ``StartUp.state_numbers``."""
_LAGS = (0.0, 1.0, -1.0, 2.0)
"""Factors on ``chosen.LAG_STEP`` in successive retries: a dwell closer to the critical speed, or
farther from it, may free balls that the last one did not."""


class StartUp:
    """Controller that starts an unknown drive such that its balls balance it.

    Slightly above the critical speed the whirl is large and drives the balls to the balanced
    position. The controller *dwells* there while the net unbalance q of rotor and balls falls. The
    smaller q is, the closer it dwells, so that the whirl stays large. If q rises, balls circulate,
    and the speed moves away a little. Then the speed rises to the final speed, slowly at first so
    that no free whirl is excited. There q is judged; if it is still large and no longer falls, the
    controller returns for another dwell.

    The controller reads no clock, has constant memory, and is deterministic: the same calls give
    the same commands to the bit. ``examples/firmware_prototype/c/adaptive.c`` is its C version.

    Parameters
    ----------
    settings : StartUpSettings
        The drive's limits and its sensor.

    Raises
    ------
    InputError
        A setting is out of range.
    """

    def __init__(self, settings: StartUpSettings) -> None:
        self.settings = checked(settings)
        self.observer = Observer(settings)
        self.state = State.WAITING
        self.decision = Decision(0, "")
        self._reason = Reason.NONE
        self._request = ""
        self._unit = chosen.UNIT / settings.final_speed
        self._command = self._time = self._elapsed = self._in_state = 0.0
        self._calls = self._since_sample = self._standing = self._distance = 0.0
        self._nudge = self._stagnant = self._before = self._dwells = self._retries = 0.0

    def sample(
        self, time: float, angle: float, speed: float, first: float, second: float = 0.0
    ) -> None:
        """Process a reading of the sensor; readings that are invalid or out of order are ignored.

        Parameters
        ----------
        time : float
            Time by the sensor's clock [s].
        angle, speed : float
            Angle and speed of the spindle at that time [rad, rad/s]; the angle may be wrapped or
            not.
        first, second : float
            Reading along each axis [m or m/s^2]; the second is used with two axes only.
        """
        good, wrong = self.observer.take(time, angle, speed, first, second)
        if good:
            self._since_sample = 0.0
        stopped = self.state in (State.ABORTING, State.ABORTED)
        if wrong and not stopped and (wrong is Reason.TIME_BACK or not self.state.over):
            self._abort(wrong)

    def command(self, time: float) -> float:
        """Decide, once per period, on the speed to command.

        Parameters
        ----------
        time : float
            Time by the caller's clock [s].

        Returns
        -------
        float
            Speed to command now [rad/s]. It changes by at most the acceleration times the period,
            except for a drive that was reset and stands still: then it is 0 immediately.
        """
        settings = self.settings
        passed = time - self._time
        if not 0.0 < passed <= 20.0 * settings.period or self._calls == 0.0:
            passed = settings.period
        self._calls, self._time = 1.0, time
        self._in_state += passed
        self._since_sample += passed
        state = self.state
        if state is State.WAITING:
            if self.observer.samples > 1.0:
                self._command = min(max(self.observer.speed, 0.0), settings.final_speed)
                self._elapsed = 0.0
                self._enter(State.RUN_UP)
            elif self._since_sample > chosen.FIRST_SAMPLES:
                self._abort(Reason.SILENT)
            return self._command
        self._elapsed += passed
        if state is State.ABORTING:
            # A drive that was reset stands still: a ramp down would first start it.
            stands = self.observer.speed < 0.01 * settings.final_speed
            if self._reason is Reason.TIME_BACK and stands:
                self._command = 0.0
            if self._ramp(0.0, settings.acceleration):
                self._enter(State.ABORTED)
            return self._command
        if state is State.ABORTED:
            return self._command
        if self._since_sample > settings.silence:
            self._abort(Reason.SILENT)
            return self._command
        if not state.over and self._fails_to_follow(passed):
            self._abort(Reason.NOT_FOLLOWING)
            return self._command
        if state in (State.RUN_UP, State.RETRY):
            self._approach()
        elif state is State.DWELL:
            self._dwell(passed)
        elif state is State.TO_FINAL:
            self._to_final()
        elif state is State.JUDGING:
            self._judge()
        return self._command

    def abort(self, time: float, why: str) -> None:
        """Ramp down to standstill; if that is in progress, do nothing.

        Parameters
        ----------
        time : float
            Time by the caller's clock [s].
        why : str
            Reason, as text.
        """
        if self.state not in (State.ABORTING, State.ABORTED):
            self._time = time
            self._request = why
            self._abort(Reason.REQUESTED)

    @property
    def estimates(self) -> Estimates:
        """Estimates of the drive's parameters."""
        observer = self.observer
        if observer.known == 0.0:
            nan = math.nan
            return Estimates(nan, nan, complex(nan, nan), nan, nan, self.dwells, self.retries)
        return Estimates(
            observer.critical,
            observer.critical_deviation,
            complex(observer.re, observer.im),
            observer.deviation,
            observer.scale if observer.scale > 0.0 else math.nan,
            self.dwells,
            self.retries,
        )

    @property
    def dwells(self) -> int:
        """Number of dwells near the critical speed so far."""
        return int(self._dwells)

    @property
    def retries(self) -> int:
        """Number of returns to the critical speed for another dwell so far."""
        return int(self._retries)

    @property
    def reason(self) -> str:
        """Reason for an abort; empty if there was none."""
        if self._reason is Reason.REQUESTED and self._request:
            return self._request
        return TEXTS.get(self._reason, "")

    @property
    def words(self) -> str:
        """Present action of the start-up and the reason for it, in plain words."""
        return _words_of(self.state, self.reason, self.settings, self.estimates, self.observer)

    def state_numbers(self) -> tuple[float, ...]:
        """Return the complete state, for ``restore``; the C version has the same numbers."""
        state = [float(self.state), float(self._reason), float(self.decision.number)]
        state += [
            self._command,
            self._time,
            self._elapsed,
            self._in_state,
            self._calls,
            self._since_sample,
        ]
        state += [self._standing, self._distance, self._nudge, self._stagnant, self._before]
        return (*state, self._dwells, self._retries, *self.observer.numbers())

    def restore(self, numbers: tuple[float, ...]) -> None:
        """Restore a state of a ``StartUp`` with the same settings.

        Raises
        ------
        ValueError
            The numbers are not such a state; nothing has changed.
        """
        expected = len(self.state_numbers())
        if len(numbers) != expected:
            raise ValueError(f"a state has {expected} numbers, not {len(numbers)}")
        values = [float(number) for number in numbers]
        if not all(map(math.isfinite, values)):
            raise ValueError("the state must have finite numbers only")
        if not 0.0 <= values[3] <= self.settings.final_speed:
            raise ValueError(
                f"the state commands {values[3]:g} rad/s; must be 0 to the final speed of "
                f"{self.settings.final_speed:g} rad/s"
            )
        state, reason = State(int(values[0])), Reason(int(values[1]))
        self.state, self._reason, self._request = state, reason, ""
        self._command, self._time, self._elapsed, self._in_state, self._calls = values[3:8]
        self._since_sample, self._standing, self._distance, self._nudge = values[8:12]
        self._stagnant, self._before, self._dwells, self._retries = values[12:16]
        self.observer.restore(values[_OWN_NUMBERS:])
        self.decision = Decision(int(values[2]), self.words)

    # --- action in each state

    def _approach(self) -> None:
        """Approach the dwell speed from either side.

        Without an estimate, continue to the final speed.
        """
        settings, observer = self.settings, self.observer
        goal = self.dwell_speed()
        if self.state is State.RUN_UP:
            is_known = observer.known == 1.0 and (
                observer.critical_deviation < chosen.KNOWN_CRITICAL * observer.critical
            )
            late = goal < observer.speed - 0.025 * settings.final_speed
            if not is_known or late or self._command < 0.3 * settings.final_speed:
                goal = settings.final_speed
        there = self._ramp(goal, settings.acceleration)
        if goal == settings.final_speed:
            if there and abs(observer.speed - goal) < 0.02 * goal:
                self._enter(State.JUDGING)
        elif there or abs(self._command - goal) < 0.005 * settings.final_speed:
            if abs(observer.speed - goal) < 0.02 * goal:
                self._nudge = self._stagnant = 0.0
                self._dwells += 1.0
                self._enter(State.DWELL)

    def _dwell(self, passed: float) -> None:
        """Dwell, so that the whirl drives the balls: closer as q falls, farther if q rises."""
        observer, unit = self.observer, self._unit
        rate, passed = observer.rate, passed / unit
        if rate > chosen.RISING:
            self._nudge += chosen.UP * passed
        else:
            self._nudge = max(self._nudge - chosen.DOWN * passed, 0.0)
        # The driving force on the balls grows with the square of the critical speed.
        relative = 2.0 * observer.critical / self.settings.final_speed
        if rate > -(chosen.FALLING * relative * relative):
            self._stagnant += passed
        else:
            self._stagnant = max(self._stagnant - 2.0 * passed, 0.0)
        # The dwell ends if the balls circulate however far the speed moves away, if q has stopped
        # falling, if time is over, or if q is small enough.
        net = self._net(observer.fast)
        self._ramp(self.dwell_speed(), self.settings.acceleration)
        if (
            self._nudge >= chosen.AWAY
            or self._stagnant > self._patience()
            or self._in_state > chosen.LONGEST_DWELL * unit
            or self._elapsed > self.settings.patience + chosen.LATE * unit
            or (net < chosen.SMALL and self._in_state > 0.1 * unit)
        ):
            self._nudge = self._stagnant = 0.0
            self._enter(State.TO_FINAL)

    def _to_final(self) -> None:
        """Accelerate to the final speed, slowly near the critical speed."""
        settings, observer = self.settings, self.observer
        # Leave the resonance slowly: the free whirl that a ramp excites grows with the acceleration
        # over the square of the distance from the critical speed.
        off = self._command - observer.critical
        slope = settings.acceleration
        if off > 0.0:
            slope = min(slope, chosen.LEAVING * off * off)
        if self._ramp(settings.final_speed, slope):
            if abs(observer.speed - settings.final_speed) < 0.02 * settings.final_speed:
                self._enter(State.JUDGING)

    def _judge(self) -> None:
        """Judge q at the final speed: balanced, wait, retry, or give up."""
        observer, settings = self.observer, self.settings
        settle = chosen.SETTLE * self._unit
        if self._in_state <= settle:
            return
        size = 0.5 * (observer.fast + observer.slow)
        net = self._net(size)
        # After a retry that gained little, a larger remainder is accepted: friction may hold it.
        good = net < chosen.BALANCED
        if not good and self._retries > 0.0:
            good = net < chosen.ACCEPTED and net > chosen.GAIN * self._before
        if good:
            if self._in_state > 2.0 * settle:
                self._enter(State.DONE)
            return
        if observer.known == 0.0 or observer.deviation > chosen.UNSURE * size:
            if self._in_state > chosen.WAIT * self._unit:
                self._enter(State.GAVE_UP)
            return
        # q falls exponentially while balls settle: wait if it will be small enough within WAIT. A
        # retry would take longer, and moves balls that are nearly in place.
        rate = observer.rate
        if rate < -0.01 and math.log(net / chosen.BALANCED) < -(rate * chosen.WAIT):
            return
        if self._retries >= settings.most_retries or self._elapsed > settings.patience:
            self._enter(State.GAVE_UP)
            return
        self._retries += 1.0
        self._before = net
        self._enter(State.RETRY)

    # --- helpers of the actions

    def _net(self, size: float) -> float:
        """Return a net unbalance [m] relative to the scale; 1 before there is a scale."""
        scale = self.observer.scale
        return size / scale if scale > 0.0 else 1.0

    def _patience(self) -> float:
        """Return the longest allowed stagnation, in units of time."""
        return chosen.STAGNANT + chosen.STAGNANT_PER_NET * self._net(self.observer.fast)

    def dwell_speed(self) -> float:
        """Return the speed to dwell at [rad/s].

        At the ratio r of speed to critical speed the whirl is |q| r^2 / (r^2 - 1). Its phase
        deviates from 180 degrees by atan(D r / (wn (r^2 - 1))).
        """
        observer, final = self.observer, self.settings.final_speed
        if observer.known == 0.0:
            return final
        largest, lag = chosen.FIRST_WHIRL, chosen.LARGEST_LAG
        if self._retries > 0.0:
            largest = chosen.LATER_WHIRL
            lag *= 1.0 + chosen.LAG_STEP * _LAGS[(int(self._retries) - 1) % 4]
        # Two lower limits of the distance: the whirl must not exceed ``largest``, and the lag must
        # be small, because with a large lag the whirl drives balls in the wrong direction.
        critical = observer.critical
        whirl = 1.0 / (1.0 - min(self._net(observer.fast) / largest, 0.8))
        least = chosen.LEAST_DISTANCE * (2.0 * critical / final)
        least *= 1.0 - chosen.NEARER * min(self._stagnant / self._patience(), 1.0)
        distance = min(max(observer.damping / (critical * lag), least), chosen.MOST_DISTANCE)
        ratio = math.sqrt(max(whirl, 1.0 + distance)) + self._nudge
        return min(ratio * critical, final)

    def _ramp(self, goal: float, slope: float) -> bool:
        """Move the command one step towards a speed; return whether it is reached.

        The command leads or lags the spindle by a limited amount only, and stays between 0 and the
        final speed.
        """
        settings = self.settings
        change = slope * settings.period
        lead = chosen.LEAD * settings.final_speed
        wanted = goal
        if not self.state.over and self.state is not State.ABORTING:
            wanted = min(max(goal, self.observer.speed - lead), self.observer.speed + lead)
            wanted = min(max(wanted, 0.0), settings.final_speed)
        self._command += min(max(wanted - self._command, -change), change)
        return self._command == goal

    def _fails_to_follow(self, passed: float) -> bool:
        """Return whether the spindle has not approached the commanded speed for too long."""
        speed, final = self.observer.speed, self.settings.final_speed
        off, moved = self._command - speed, speed - self._distance
        nearer = (moved if off > 0.0 else -moved) > 0.02 * final
        if abs(off) < 0.05 * final or nearer:
            self._standing, self._distance = 0.0, speed
        else:
            self._standing += passed
        return self._standing > chosen.NOT_FOLLOWING * self._unit

    def _abort(self, reason: Reason) -> None:
        """Begin to ramp down for a reason."""
        self._reason = reason
        self._enter(State.ABORTING)

    def _enter(self, state: State) -> None:
        """Change to another state, and record that as a new decision."""
        self.state = state
        self._in_state = 0.0
        self.decision = Decision(self.decision.number + 1, self.words)
