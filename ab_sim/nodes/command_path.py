"""What becomes of a command on its way to the spindle; no ROS, and no clock but counted steps.

A command is judged by the limits in force, travels along a bus that may be slow, and leads the
spindle, unless an emergency stop does. When no command has come out of the bus for too long, the
watchdog does. All of that happens at whole integration steps, so that the same commands at the same
steps lead to the same bits, however the steps are grouped.
"""

import enum
import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ab_sim.errors import InputError
from ab_sim.quoting import short
from ab_sim.spindle import SpeedServo


class Silence(enum.Enum):
    """What the watchdog does."""

    HOLD = "hold"
    """The speed that the spindle has then."""
    COAST = "coast"
    """To standstill, with the deceleration of an idle spindle."""
    STOP = "stop"
    """To standstill, as fast as the scene's spindle can."""


class Rules(NamedTuple):
    """What may be changed while commands come."""

    max_speed: float = math.inf
    """rad/s; the scene's own limit holds as well."""
    max_acceleration: float = math.inf
    """rad/s^2; the scene's own limit holds as well."""
    age_limit: float = math.inf
    """How old the last command may become before the watchdog acts [s], of simulated time."""
    silence: Silence = Silence.HOLD
    coast: float = math.inf
    """Deceleration of an idle spindle [rad/s^2]; the scene's own limit holds as well."""
    delay: float = 0.0
    """Of every command on the bus [s], of simulated time."""
    jitter: float = 0.0
    """What a command may take longer by [s], at random."""


class Order(NamedTuple):
    """What the spindle is told."""

    speed: float
    """rad/s."""
    acceleration: float
    """rad/s^2, with which it goes there."""


class OnBus(NamedTuple):
    """A command on its way."""

    due: int
    """Step at which it comes out."""
    speed: float
    """rad/s."""
    stamp: int
    """When it was received [ns], whatever clock says so."""


class CommandPath:
    """From commands to orders for one drive.

    Args:
        scene_limits: of the spindle; orders keep to them.
        step: integration step [s].
        rules: can be replaced at any time.
        seed: of the bus' jitter.
    """

    def __init__(self, scene_limits: SpeedServo, step: float, rules: Rules, seed: int = 0) -> None:
        self._seed = seed
        self.accepted = self.rejected = self.ignored = self.dropped = self.silences = 0
        self.last_rejected = math.nan
        self.acted: list[int] = []
        """Stamps of the commands that have come out of the bus; for whoever takes them away."""
        self.forgotten = 0
        """How many commands had come when they were last forgotten."""
        self._rules = rules
        self.stopped = False
        self.lead(scene_limits, step)

    @property
    def rules(self) -> Rules:
        """Those in force."""
        return self._rules

    @rules.setter
    def rules(self, rules: Rules) -> None:
        before, self._rules = self._rules, rules
        if (rules.age_limit, rules.silence) != (before.age_limit, before.silence):
            # It judges anew. Where it then has no reason to act, the spindle stays as it is left.
            self.silent = False

    @property
    def received(self) -> int:
        """How many commands have come."""
        return self.accepted + self.rejected + self.ignored

    def lead(self, scene_limits: SpeedServo, step: float) -> None:
        """Lead another drive from now on; see ``reset``, but an emergency stop remains."""
        stopped = self.stopped
        self._scene_limits, self._step = scene_limits, step
        self.reset()
        if stopped:
            self.emergency_stop()

    def reset(self) -> None:
        """Forget all commands, and why not to follow them; what has been counted remains."""
        self._bus: deque[OnBus] = deque()
        self.forgotten = self.received
        self._draw_from(0)
        self._last: int | None = None
        self._target: float | None = None
        self.silent = self.stopped = False
        self._told: Order | None = None

    def count_from(self, now: int, then: int) -> None:
        """What was step ``now`` is step ``then``."""
        by = then - now
        self._bus = deque(command._replace(due=command.due + by) for command in self._bus)
        if self._last is not None:
            self._last += by

    @property
    def limits(self) -> SpeedServo:
        """What a command may ask for, and how fast it is followed."""
        own, rules = self._scene_limits, self.rules
        return SpeedServo(
            min(own.max_speed, rules.max_speed), min(own.max_acceleration, rules.max_acceleration)
        )

    def hear(self, speed: float, now: int, stamp: int = 0) -> None:
        """Judge a command [rad/s] that has come at a step; rejecting costs no more."""
        if not self.limits.accepts(speed):
            self.rejected += 1
            self.last_rejected = speed
        elif self.stopped:
            self.ignored += 1
        else:
            self.accepted += 1
            rules, before = self.rules, self._bus[-1].due if self._bus else now
            late = rules.delay
            if rules.jitter:
                late += rules.jitter * self._draw()
            # A bus is a queue: nobody overtakes.
            due = max(now + math.ceil(late / self._step - 1e-9), before)
            if self._bus and before == due:
                # It would never act. So the bus stays short however long time stands still.
                self._bus.pop()
            self._bus.append(OnBus(due, float(speed), stamp))

    def forget_stamps(self) -> None:
        """Of what is on the bus: how long it takes from now on says nothing."""
        self._bus = deque(command._replace(stamp=0) for command in self._bus)

    def age(self, now: int) -> float | None:
        """Of the last command that has come out of the bus [s]; None before the first."""
        return None if self._last is None else (now - self._last) * self._step

    def emergency_stop(self) -> None:
        """To standstill as fast as the spindle can; commands are ignored until it is released."""
        self.dropped += len(self._bus)
        self._bus.clear()
        self.stopped, self._target = True, 0.0

    def release(self) -> None:
        """End an emergency stop: the spindle stays at standstill until the next command."""
        self.stopped = self.silent = False
        self._last = None

    def state(self) -> dict[str, Any]:
        """What to keep for going back to this instant, as JSON-able values; no counts."""
        return {
            "bus": [[command.due, command.speed] for command in self._bus],
            "draws": self._draws,
            "last": self._last,
            "target": self._target,
            "silent": self.silent,
            "stopped": self.stopped,
            "told": self._told,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go back to what was kept; but an emergency stop remains.

        Raises:
            InputError: nothing like that was kept; nothing has changed.
        """
        try:
            bus = [OnBus(_whole(due), _finite(speed), 0) for due, speed in state["bus"]]
            draws = _whole(state["draws"])
            last = None if state["last"] is None else _whole(state["last"])
            target = None if state["target"] is None else _finite(state["target"])
            silent, stopped = bool(state["silent"]), bool(state["stopped"])
            told = None if state["told"] is None else Order(*map(_finite, state["told"]))
        except (LookupError, TypeError, ValueError) as error:
            raise InputError(f"no state of a path of commands: {short(error)}") from error
        stays = self.stopped
        self.reset()
        self._bus.extend(bus)
        self._draw_from(draws)
        self._last, self._target, self._told = last, target, told
        self.silent, self.stopped = silent, stopped
        if stays:
            self.emergency_stop()

    def order(self, now: int, speed: Callable[[], float]) -> Order | None:
        """What is new for the spindle at a step.

        Args:
            now: the step.
            speed: says what speed the spindle has then [rad/s].
        """
        while self._bus and self._bus[0].due <= now:
            command = self._bus.popleft()
            self._last, self._target, self.silent = command.due, command.speed, False
            self.acted.append(command.stamp)
        trip = self._trip()
        if trip is not None and trip <= now:
            self.silent = True
            self.silences += 1
            self._target = speed() if self.rules.silence is Silence.HOLD else 0.0
        wish = self._wish()
        if wish == self._told:
            return None
        self._told = wish
        return wish

    def next(self, now: int) -> float:
        """The step after ``now`` at which there may be something new, if nobody commands."""
        trip = self._trip()
        return max(
            min(
                self._bus[0].due if self._bus else math.inf,
                math.inf if trip is None else trip,
            ),
            now + 1,
        )

    def _draw(self) -> float:
        self._draws += 1
        return self._random.random()

    def _draw_from(self, draws: int) -> None:
        """Go on with the jitter's random numbers after so many of them, which takes no time."""
        self._draws = draws
        self._random = np.random.Generator(np.random.PCG64(self._seed).advance(draws))

    def _trip(self) -> int | None:
        """Step at which the watchdog will act, if it is not done."""
        if self._last is None or self.silent or self.stopped or math.isinf(self.rules.age_limit):
            return None
        return self._last + max(1, math.ceil(self.rules.age_limit / self._step - 1e-9))

    def _wish(self) -> Order | None:
        if self._target is None:
            return None
        most, limits = self._scene_limits.max_acceleration, self.limits
        if self.stopped or (self.silent and self.rules.silence is Silence.STOP):
            slope = most
        elif self.silent and self.rules.silence is Silence.COAST:
            slope = min(most, self.rules.coast)
        else:
            slope = limits.max_acceleration
        return Order(max(-limits.max_speed, min(self._target, limits.max_speed)), slope)


def _whole(value: Any) -> int:
    """A count or a step, of what a file says.

    Raises:
        ValueError: it is none.
    """
    if not isinstance(value, int) or abs(value) >= 2**63:
        raise ValueError(f"{short(value)} is no number of steps or draws")
    return value


def _finite(value: Any) -> float:
    if not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{short(value)} is no finite number")
    return float(value)
