"""Path of commands to the spindle: limits, simulated bus, watchdog, emergency stop; no ROS.

A command is a target speed, or a trajectory: speeds over time. It is checked against the present
limits and delayed by the bus; then the drive follows it, unless there is an emergency stop. The
newest command that has left the bus counts, of either kind. If no command leaves the bus for too
long, the watchdog sets the target; a trajectory counts as a command until its last point. Time is
counted in whole integration steps, so that the same commands at the same steps give the same bits,
however the steps are grouped.
"""

import enum
import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ab_msgs_py.set_points import SetPoints
from ab_msgs_py.topics import PAST
from ab_sim.base.errors import CommandError, InputError, exact, short
from ab_sim.base.numbers import finite, whole
from ab_sim.model.spindle import Ramp, SpeedServo
from ab_sim.model.spindle.commands import LATEST, TimedSpeeds, timed_speeds

ROUNDING = 1e-6
"""Fraction by which a trajectory may exceed a limit: times of points are rounded to 1 ns."""


class WatchdogAction(enum.Enum):
    """Action of the watchdog when commands are missing."""

    HOLD = "hold"
    """Hold the present speed."""
    COAST = "coast"
    """Decelerate to standstill like an idle spindle."""
    STOP = "stop"
    """Decelerate to standstill at the scene's largest acceleration."""


class Rules(NamedTuple):
    """Settings of limits, watchdog and bus; they can be changed at any time."""

    max_speed: float = math.inf
    """Largest speed [rad/s]; the scene's limit also applies."""
    max_acceleration: float = math.inf
    """Largest acceleration [rad/s^2]; the scene's limit also applies."""
    age_limit: float = math.inf
    """Age of the last command at which the watchdog acts [s], simulated time."""
    silence: WatchdogAction = WatchdogAction.HOLD
    """Action of the watchdog."""
    coast: float = math.inf
    """Deceleration of an idle spindle [rad/s^2]; the scene's limit also applies."""
    delay: float = 0.0
    """Delay of every command on the bus [s], simulated time."""
    jitter: float = 0.0
    """Largest additional random delay of a command [s]."""


class SpeedOrder(NamedTuple):
    """Target speed of the spindle, and the acceleration of the ramp to it."""

    speed: float
    """Target speed [rad/s]."""
    acceleration: float
    """Acceleration of the ramp [rad/s^2]."""


class TrajectoryOrder(NamedTuple):
    """Trajectory that the spindle follows from now on."""

    speeds: TimedSpeeds
    acceleration: float
    """Largest acceleration on the way to the trajectory's first point [rad/s^2]."""


class CommandOnBus(NamedTuple):
    """Command that is on the bus."""

    due: int
    """Number of the step at which the command leaves the bus."""
    wanted: float | TimedSpeeds
    """Target speed [rad/s], or a trajectory."""
    stamp: int
    """Receive time [ns], by the caller's clock."""


class TrajectoryAnswer(NamedTuple):
    """Answer to a trajectory that was received, or that cannot be followed any longer."""

    start: int
    """Start of the trajectory [ns], as in the message."""
    refusal: str = ""
    """Reason why the trajectory is not followed; empty if it is."""


class CommandPath:
    """Converts commands to orders for one drive.

    Parameters
    ----------
    scene_limits
        Limits of the spindle, which all orders respect.
    step
        Integration step [s].
    rules
        Settings of limits, watchdog and bus.
    seed
        Seed of the bus jitter.
    """

    def __init__(self, scene_limits: SpeedServo, step: float, rules: Rules, seed: int = 0) -> None:
        self._seed = seed
        self.accepted = self.rejected = self.ignored = self.dropped = self.silences = 0
        self.last_rejected = math.nan
        self.rejected_with_report = 0
        """Number of rejected trajectories and joint commands, each of which the caller reports."""
        self.trajectory_news: list[TrajectoryAnswer] = []
        """Answers to trajectories, newest last; the caller clears the list."""
        self.acted: list[int] = []
        """Stamps of commands that have left the bus; the caller clears the list."""
        self.forgotten = 0
        """Number of commands received before the last reset."""
        self._rules = rules
        self.stopped = False
        self.stop_wanted = False
        """True if the next call of ``order`` begins an emergency stop; any thread may set it."""
        self.lead(scene_limits, step)

    @property
    def rules(self) -> Rules:
        """Present settings of limits, watchdog and bus."""
        return self._rules

    @rules.setter
    def rules(self, rules: Rules) -> None:
        before, self._rules = self._rules, rules
        if (rules.age_limit, rules.silence) != (before.age_limit, before.silence):
            # The watchdog starts again; until it acts, the target is left unchanged.
            self.silent = False
        self._limits_changed = True

    @property
    def received(self) -> int:
        """Number of commands received."""
        return self.accepted + self.rejected + self.ignored

    def lead(self, scene_limits: SpeedServo, step: float) -> None:
        """Reset the path for another drive with a step [s]; an emergency stop remains in force."""
        stopped = self.stopped
        self._scene_limits, self._step = scene_limits, step
        self._step_ns = round(step * 1e9)
        self.reset()
        if stopped:
            self.emergency_stop()

    def reset(self) -> None:
        """Drop all commands and end an emergency stop; the counts are kept."""
        self._bus: deque[CommandOnBus] = deque()
        self.forgotten = self.received
        self._draw_from(0)
        self._last: int | None = None
        self._target: float | None = None
        self.trajectory: TimedSpeeds | None = None
        """Leading trajectory, or None; after its last point, its last speed is held."""
        self.silent = self.stopped = self._limits_changed = False
        self._last_order: SpeedOrder | TrajectoryOrder | None = None

    def count_from(self, now: int, then: int) -> None:
        """Shift step numbers and trajectory times, so that step ``now`` becomes step ``then``."""
        by = then - now
        self._bus = deque(
            CommandOnBus(command.due + by, self._moved(command.wanted, by), command.stamp)
            for command in self._bus
        )
        if self._last is not None:
            self._last += by
        if self.trajectory is not None:
            self.trajectory = self._moved(self.trajectory, by)

    def _moved(self, wanted: Any, by: int) -> Any:
        """Return a command; the start of a trajectory that has one is moved by ``by`` steps."""
        if not isinstance(wanted, TimedSpeeds) or wanted.start is None:
            return wanted
        return wanted._replace(start=wanted.start + by * self._step_ns)

    @property
    def limits(self) -> SpeedServo:
        """Largest speed [rad/s] and acceleration [rad/s^2] by the scene and the rules."""
        limits, rules = self._scene_limits, self.rules
        return SpeedServo(
            min(limits.max_speed, rules.max_speed),
            min(limits.max_acceleration, rules.max_acceleration),
        )

    def receive(self, speed: float, now: int, stamp: int = 0) -> None:
        """Accept, reject or ignore a target speed.

        Parameters
        ----------
        speed
            Target speed [rad/s].
        now
            Step at which it was received.
        stamp
            Receive time [ns]; 0: unknown.
        """
        if not self.limits.accepts(speed):
            self.rejected += 1
            self.last_rejected = speed
        elif self.stopped:
            self.ignored += 1
        else:
            self.accepted += 1
            due = self._due(now)
            while self._bus and self._bus[-1].due == due:
                # The earlier command would never act. Removing it keeps the queue short while time
                # is paused.
                self._bus.pop()
            self._bus.append(CommandOnBus(due, float(speed), stamp))

    def receive_trajectory(self, wanted: SetPoints, now: int, stamp: int = 0) -> None:
        """Accept, reject or ignore a trajectory.

        Parameters
        ----------
        wanted
            Trajectory as received.
        now
            Step at which it was received.
        stamp
            Receive time [ns]; 0: unknown.
        """
        try:
            speeds = timed_speeds(wanted, self.limits)
        except CommandError as error:
            self.reject_trajectory(wanted.start, str(error))
            return
        if self.stopped:
            self.ignored += 1
            self.trajectory_news.append(TrajectoryAnswer(wanted.start, "emergency stop"))
            return
        due = self._due(now)
        if speeds.start is not None and speeds.start < due * self._step_ns:
            late = exact(due * self._step_ns / 1e9)
            self.reject_trajectory(
                wanted.start,
                f"{PAST}: header.stamp = {exact(wanted.start / 1e9)} s, but it acts from {late} s "
                "on; send it earlier, or with stamp 0 to begin when it arrives",
            )
            return
        self.accepted += 1
        self.trajectory_news.append(TrajectoryAnswer(wanted.start))
        if self._bus and self._bus[-1].due == due and not isinstance(self._bus[-1].wanted, float):
            self._bus.pop()  # keeps the queue short while time is paused
        self._bus.append(CommandOnBus(due, speeds, stamp))

    def reject_joint_command(self) -> None:
        """Count an invalid joint command; the caller reports it."""
        self.rejected += 1
        self.rejected_with_report += 1

    def renew(self, now: int) -> None:
        """Treat the leading command as repeated at a step, unless the watchdog has acted."""
        if self._last is not None and not self.silent:
            self._last = max(self._last, now)

    def reject_trajectory(self, start: int, refusal: str) -> None:
        """Reject a trajectory.

        Parameters
        ----------
        start
            Start of the trajectory [ns], as in its message.
        refusal
            Reason, for the status.
        """
        self.rejected += 1
        self.rejected_with_report += 1
        self.trajectory_news.append(TrajectoryAnswer(start, refusal))

    def _due(self, now: int) -> int:
        """Return the step at which a command that was received at step ``now`` leaves the bus."""
        rules, before = self.rules, self._bus[-1].due if self._bus else now
        late = rules.delay
        if rules.jitter:
            late += rules.jitter * self._draw()
        # The bus is a queue: commands keep their order.
        return max(now + math.ceil(late / self._step - 1e-9), before)

    def forget_stamps(self) -> None:
        """Clear the stamps of commands on the bus, so that their delays are not measured."""
        self._bus = deque(command._replace(stamp=0) for command in self._bus)

    def age(self, now: int) -> float | None:
        """Return the age of the last command that has left the bus [s]; None before the first.

        A trajectory does not age before its last point.
        """
        last = self._alive_until
        return None if last is None else max(now - last, 0) * self._step

    def follows(self, now: int) -> bool:
        """Return whether at step ``now`` a trajectory leads and has not reached its last point."""
        return self.trajectory is not None and self._end_of(self.trajectory) > now

    @property
    def _alive_until(self) -> int | None:
        """Step of the last command, or of the last point of the leading trajectory."""
        if self._last is None or self.trajectory is None:
            return self._last
        return max(self._last, self._end_of(self.trajectory))

    def _end_of(self, trajectory: TimedSpeeds) -> int:
        """Return the number of the step at which a trajectory reaches its last point."""
        assert trajectory.start is not None
        return math.ceil((trajectory.start / 1e9 + trajectory.lasts) / self._step - 1e-9)

    def emergency_stop(self) -> None:
        """Decelerate to standstill; commands are ignored until ``release``."""
        self.dropped += len(self._bus)
        self._bus.clear()
        self.stopped, self._target, self.trajectory = True, 0.0, None

    def release(self) -> None:
        """End an emergency stop; the target speed is 0 until the next command."""
        self.stopped = self.silent = False
        self._last = None

    def state(self) -> dict[str, Any]:
        """Return the state for a snapshot, as JSON-able values without counts."""
        order = self._last_order
        return {
            "bus": [[command.due, _values(command.wanted)] for command in self._bus],
            "draws": self._draws,
            "last": self._last,
            "target": self._target,
            "trajectory": None if self.trajectory is None else _values(self.trajectory),
            "silent": self.silent,
            "stopped": self.stopped,
            "last_order": order if isinstance(order, SpeedOrder) else None,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a state that ``state`` returned; a present emergency stop remains in force.

        Raises
        ------
        InputError
            The state is invalid; nothing has changed.
        """
        try:
            bus = [CommandOnBus(whole(due), _wanted(wanted), 0) for due, wanted in state["bus"]]
            draws = whole(state["draws"])
            last = None if state["last"] is None else whole(state["last"])
            target = None if state["target"] is None else finite(state["target"])
            trajectory = None if state["trajectory"] is None else _timed(state["trajectory"])
            if trajectory is not None:
                whole(trajectory.start)
            silent, stopped = bool(state["silent"]), bool(state["stopped"])
            order = state["last_order"]
            last_order = None if order is None else SpeedOrder(*map(finite, order))
        except (LookupError, TypeError, ValueError) as error:
            raise InputError(f"not a state of a command path: {short(error)}") from error
        stays = self.stopped
        self.reset()
        self._bus.extend(bus)
        self._draw_from(draws)
        self._last, self._target, self._last_order = last, target, last_order
        self.trajectory = trajectory
        self.silent, self.stopped = silent, stopped
        if stays:
            self.emergency_stop()

    def order(self, now: int, speed: Callable[[], float]) -> SpeedOrder | TrajectoryOrder | None:
        """Return the next order for a step; None if there is no other one.

        Parameters
        ----------
        now
            Present step.
        speed
            Function that returns the spindle's present speed [rad/s].
        """
        if self.stop_wanted:
            self.stop_wanted = False
            self.emergency_stop()
        while self._bus and self._bus[0].due <= now:
            command = self._bus.popleft()
            self.acted.append(command.stamp)
            if isinstance(command.wanted, TimedSpeeds):
                return self._lead(command.wanted, command.due)
            self._last, self.silent = command.due, False
            if not self._held_already(command.wanted, now):
                self._target, self.trajectory = command.wanted, None
            if (changed := self._changed()) is not None:
                return changed
        if self._limits_changed:
            self._limits_changed = False
            self._leave_beyond_limits(now, speed)
        watchdog_step = self._watchdog_step()
        if watchdog_step is not None and watchdog_step <= now:
            self.silent = True
            self.silences += 1
            self._target = speed() if self.rules.silence is WatchdogAction.HOLD else 0.0
            self.trajectory = None
        return self._changed()

    def _lead(self, wanted: TimedSpeeds, due: int) -> TrajectoryOrder:
        """Make a trajectory that left the bus at step ``due`` the leading command."""
        start = due * self._step_ns if wanted.start is None else wanted.start
        self._last, self.silent, self._target = due, False, None
        self.trajectory = wanted._replace(start=start)
        order = TrajectoryOrder(self.trajectory, self.limits.max_acceleration)
        self._last_order = order
        return order

    def _held_already(self, speed: float, now: int) -> bool:
        """Return whether a trajectory that has reached its last point holds this speed [rad/s].

        A command of that speed does not replace the trajectory, and its exact time has no effect.
        """
        trajectory = self.trajectory
        if trajectory is None or trajectory.final_speed != speed:
            return False
        return not self.follows(now) and abs(speed) <= self.limits.max_speed

    def _leave_beyond_limits(self, now: int, speed: Callable[[], float]) -> None:
        """Hold the present speed if the rest of the trajectory exceeds the changed limits."""
        trajectory = self.trajectory
        if trajectory is None:
            return
        assert trajectory.start is not None
        passed, limits = now * self._step - trajectory.start / 1e9, self.limits
        for most, limit, unit in (
            (trajectory.top_speed(passed), limits.max_speed, "rad/s"),
            (trajectory.steepest(passed), limits.max_acceleration, "rad/s^2"),
        ):
            if most > limit * (1.0 + ROUNDING):
                self._target, self.trajectory = speed(), None
                refusal = (
                    f"abandoned at {exact(now * self._step)} s: it reaches {exact(most)} {unit}, "
                    f"and the limit is now {exact(limit)} {unit}; the speed is held"
                )
                self.trajectory_news.append(TrajectoryAnswer(trajectory.start, refusal))
                return

    def _changed(self) -> SpeedOrder | None:
        """Return the present order for the spindle if it differs from the last order, else None."""
        order = None if self.trajectory is not None else self._present_order()
        if order is None or order == self._last_order:
            return None
        self._last_order = order
        return order

    def next(self, now: int) -> float:
        """Return the next step at which ``order`` may change without a further command."""
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
        """Set the random generator of the bus's jitter to the state after ``draws`` draws."""
        self._draws = draws
        self._random = np.random.Generator(np.random.PCG64(self._seed).advance(draws))

    def _watchdog_step(self) -> int | None:
        """Return the step at which the watchdog acts without a further command; None: never."""
        last = self._alive_until
        if last is None or self.silent or self.stopped or math.isinf(self.rules.age_limit):
            return None
        return last + max(1, math.ceil(self.rules.age_limit / self._step - 1e-9))

    def _present_order(self) -> SpeedOrder | None:
        """Return the order for the present target, limits and state; None without a target."""
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


def _values(wanted: float | TimedSpeeds) -> Any:
    """Return a command as JSON-able values."""
    if not isinstance(wanted, TimedSpeeds):
        return wanted
    ramps = [[duration, *ramp] for duration, ramp in wanted.ramps]
    return [wanted.start, ramps, wanted.final_speed, wanted.first]


def _wanted(values: Any) -> float | TimedSpeeds:
    return _timed(values) if isinstance(values, list) else finite(values)


def _timed(values: Any) -> TimedSpeeds:
    """Return the trajectory of ``_values``; raise a ValueError for an invalid one."""
    start, ramps, final_speed, (ahead, first) = values
    commands = [
        (finite(duration), Ramp(finite(begin), finite(slope))) for duration, begin, slope in ramps
    ]
    start = None if start is None else whole(start)
    timed = TimedSpeeds.of(start, commands, finite(final_speed), (finite(ahead), finite(first)))
    if min(ahead, *(duration for duration, _ in commands), 0.0) < 0.0 or timed.lasts > LATEST / 1e9:
        raise ValueError("its trajectory is too long, or has a part of negative duration")
    return timed
