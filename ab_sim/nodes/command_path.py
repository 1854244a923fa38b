"""The path of commands to the spindle: limits, simulated bus, watchdog, emergency stop; no ROS.

A command is checked against the limits in force and delayed by the bus; then it sets the target
speed, unless an emergency stop is in force. If no command leaves the bus for too long, the watchdog
sets the target. Time is counted in whole integration steps, so that the same commands at the same
steps give the same bits, however the steps are grouped.
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


class WatchdogAction(enum.Enum):
    """Action of the watchdog when commands are missing."""

    HOLD = "hold"
    """Hold the present speed."""
    COAST = "coast"
    """Decelerate to standstill like an idle spindle."""
    STOP = "stop"
    """Decelerate to standstill at the scene's largest acceleration."""


class Rules(NamedTuple):
    """Limits, watchdog and bus; they can be changed at any time."""

    max_speed: float = math.inf
    """rad/s; the scene's own limit holds as well."""
    max_acceleration: float = math.inf
    """rad/s^2; the scene's own limit holds as well."""
    age_limit: float = math.inf
    """Age of the last command at which the watchdog acts [s], simulated time."""
    silence: WatchdogAction = WatchdogAction.HOLD
    coast: float = math.inf
    """Deceleration of an idle spindle [rad/s^2]; the scene's own limit holds as well."""
    delay: float = 0.0
    """Of every command on the bus [s], of simulated time."""
    jitter: float = 0.0
    """Largest additional random delay of a command [s]."""


class SpeedOrder(NamedTuple):
    """Target speed of the spindle, and the acceleration of the ramp to it."""

    speed: float
    """rad/s."""
    acceleration: float
    """rad/s^2."""


class CommandOnBus(NamedTuple):
    """A command on the bus."""

    due: int
    """Step at which it leaves the bus."""
    speed: float
    """rad/s."""
    stamp: int
    """Receive time [ns], by the caller's clock."""


class CommandPath:
    """Converts commands to orders for one drive.

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
        """Stamps of commands that have left the bus; the caller clears the list."""
        self.forgotten = 0
        """Number of commands received before the last reset."""
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
            # The watchdog starts again; until it acts, the target is left unchanged.
            self.silent = False

    @property
    def received(self) -> int:
        """Number of commands received."""
        return self.accepted + self.rejected + self.ignored

    def lead(self, scene_limits: SpeedServo, step: float) -> None:
        """Serve another drive; as ``reset``, but an emergency stop stays in force."""
        stopped = self.stopped
        self._scene_limits, self._step = scene_limits, step
        self.reset()
        if stopped:
            self.emergency_stop()

    def reset(self) -> None:
        """Drop all commands, end an emergency stop; counts are kept."""
        self._bus: deque[CommandOnBus] = deque()
        self.forgotten = self.received
        self._draw_from(0)
        self._last: int | None = None
        self._target: float | None = None
        self.silent = self.stopped = False
        self._last_order: SpeedOrder | None = None

    def count_from(self, now: int, then: int) -> None:
        """Renumber the steps: ``now`` becomes ``then``."""
        by = then - now
        self._bus = deque(command._replace(due=command.due + by) for command in self._bus)
        if self._last is not None:
            self._last += by

    @property
    def limits(self) -> SpeedServo:
        """Largest speed and acceleration in force."""
        own, rules = self._scene_limits, self.rules
        return SpeedServo(
            min(own.max_speed, rules.max_speed), min(own.max_acceleration, rules.max_acceleration)
        )

    def receive(self, speed: float, now: int, stamp: int = 0) -> None:
        """Accept, reject or ignore a command [rad/s] received at a step."""
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
            # The bus is a queue: commands keep their order.
            due = max(now + math.ceil(late / self._step - 1e-9), before)
            if self._bus and before == due:
                # The earlier one would never act. So the queue stays short while time stands still.
                self._bus.pop()
            self._bus.append(CommandOnBus(due, float(speed), stamp))

    def forget_stamps(self) -> None:
        """Clear the stamps of commands on the bus: their delays are not measured any more."""
        self._bus = deque(command._replace(stamp=0) for command in self._bus)

    def age(self, now: int) -> float | None:
        """Age of the last command that has left the bus [s]; None before the first."""
        return None if self._last is None else (now - self._last) * self._step

    def emergency_stop(self) -> None:
        """Decelerate to standstill; commands are ignored until ``release``."""
        self.dropped += len(self._bus)
        self._bus.clear()
        self.stopped, self._target = True, 0.0

    def release(self) -> None:
        """End an emergency stop; the target speed is 0 until the next command."""
        self.stopped = self.silent = False
        self._last = None

    def state(self) -> dict[str, Any]:
        """The state for a snapshot, as JSON-able values; without counts."""
        return {
            "bus": [[command.due, command.speed] for command in self._bus],
            "draws": self._draws,
            "last": self._last,
            "target": self._target,
            "silent": self.silent,
            "stopped": self.stopped,
            "told": self._last_order,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a state of ``state``; an emergency stop stays in force.

        Raises:
            InputError: the state is not valid; nothing has changed.
        """
        try:
            bus = [CommandOnBus(_whole(due), _finite(speed), 0) for due, speed in state["bus"]]
            draws = _whole(state["draws"])
            last = None if state["last"] is None else _whole(state["last"])
            target = None if state["target"] is None else _finite(state["target"])
            silent, stopped = bool(state["silent"]), bool(state["stopped"])
            last_order = None if state["told"] is None else SpeedOrder(*map(_finite, state["told"]))
        except (LookupError, TypeError, ValueError) as error:
            raise InputError(f"no state of a path of commands: {short(error)}") from error
        stays = self.stopped
        self.reset()
        self._bus.extend(bus)
        self._draw_from(draws)
        self._last, self._target, self._last_order = last, target, last_order
        self.silent, self.stopped = silent, stopped
        if stays:
            self.emergency_stop()

    def order(self, now: int, speed: Callable[[], float]) -> SpeedOrder | None:
        """The order for a step, if it differs from the last one; else None.

        Args:
            now: the step.
            speed: returns the spindle's present speed [rad/s].
        """
        while self._bus and self._bus[0].due <= now:
            command = self._bus.popleft()
            self._last, self._target, self.silent = command.due, command.speed, False
            self.acted.append(command.stamp)
        watchdog_step = self._watchdog_step()
        if watchdog_step is not None and watchdog_step <= now:
            self.silent = True
            self.silences += 1
            self._target = speed() if self.rules.silence is WatchdogAction.HOLD else 0.0
        order = self._present_order()
        if order == self._last_order:
            return None
        self._last_order = order
        return order

    def next(self, now: int) -> float:
        """The next step at which ``order`` may change without a further command."""
        watchdog_step = self._watchdog_step()
        return max(
            min(
                self._bus[0].due if self._bus else math.inf,
                math.inf if watchdog_step is None else watchdog_step,
            ),
            now + 1,
        )

    def _draw(self) -> float:
        self._draws += 1
        return self._random.random()

    def _draw_from(self, draws: int) -> None:
        """Set the jitter's random generator to the state after this number of draws."""
        self._draws = draws
        self._random = np.random.Generator(np.random.PCG64(self._seed).advance(draws))

    def _watchdog_step(self) -> int | None:
        """Step at which the watchdog acts without a further command; None: never."""
        if self._last is None or self.silent or self.stopped or math.isinf(self.rules.age_limit):
            return None
        return self._last + max(1, math.ceil(self.rules.age_limit / self._step - 1e-9))

    def _present_order(self) -> SpeedOrder | None:
        if self._target is None:
            return None
        most, limits = self._scene_limits.max_acceleration, self.limits
        if self.stopped or (self.silent and self.rules.silence is WatchdogAction.STOP):
            slope = most
        elif self.silent and self.rules.silence is WatchdogAction.COAST:
            slope = min(most, self.rules.coast)
        else:
            slope = limits.max_acceleration
        return SpeedOrder(max(-limits.max_speed, min(self._target, limits.max_speed)), slope)


def _whole(value: Any) -> int:
    """A count or a step, read from a file.

    Raises:
        ValueError: it is no whole number.
    """
    if not isinstance(value, int) or abs(value) >= 2**63:
        raise ValueError(f"{short(value)} is no number of steps or draws")
    return value


def _finite(value: Any) -> float:
    if not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{short(value)} is no finite number")
    return float(value)
