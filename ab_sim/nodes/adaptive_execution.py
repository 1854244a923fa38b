"""Adaptive start-up of ``ab_sim.control``, fed with samples from topics; needs no ROS."""

import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ab_msgs_py import topics
from ab_sim.base.numbers import finite, whole
from ab_sim.control import Estimates, StartUp, StartUpSettings, State
from ab_sim.control.observer import TEXTS, Reason

GAP = 50_000_000
"""Time between two spindle samples beyond which the angle in between is unknown [ns]."""
_MOST_WAITING = 4096
"""Largest number of readings that wait for the spindle; the oldest are dropped."""


class SpindleSample(NamedTuple):
    """Sample of the spindle's motion."""

    time: int
    """Time by the drive's clock [ns]."""
    angle: float
    """Angle [rad]."""
    speed: float
    """Speed [rad/s]."""

    def until(self, later: "SpindleSample", time: int) -> tuple[float, float]:
        """Return angle [rad] and speed [rad/s] at a time [ns] between this sample and a later one.

        The angle is the cubic through both angles and speeds, which is exact for constant
        acceleration. Angles reported within one turn may lack whole turns, which are added.
        """
        h = (later.time - self.time) * 1e-9
        s = (time - self.time) * 1e-9 / h
        turns = (self.angle + 0.5 * h * (self.speed + later.speed) - later.angle) / math.tau
        end = later.angle + math.tau * round(turns)
        angle = (
            (1.0 + 2.0 * s) * (1.0 - s) ** 2 * self.angle
            + s * (1.0 - s) ** 2 * h * self.speed
            + s * s * (3.0 - 2.0 * s) * end
            - s * s * (1.0 - s) * h * later.speed
        )
        return angle, self.speed + s * (later.speed - self.speed)


class Reading(NamedTuple):
    """Reading of a vibration sensor."""

    time: int
    """Time by the drive's clock [ns]."""
    first: float
    """Value along the first axis, in the sensor's unit."""
    second: float
    """Value along the second axis, in the sensor's unit."""


class PairedSamples:
    """Combines each reading with the spindle's motion at the same time, and passes on the pairs.

    Samples that are not finite are ignored. If time decreases, the drive was reset, and waiting
    readings are dropped.

    Parameters
    ----------
    forward
        Function that is called with time [s], angle [rad], speed [rad/s], and the two values of the
        reading.
    """

    def __init__(self, forward: Callable[[float, float, float, float, float], None]) -> None:
        self._forward = forward
        self._waiting: deque[Reading] = deque(maxlen=_MOST_WAITING)
        self._before: SpindleSample | None = None
        self._last: SpindleSample | None = None
        self.unpaired = 0
        """Number of dropped readings, at whose times the spindle's motion was unknown."""

    def spindle(self, sample: SpindleSample) -> None:
        """Process a sample of the spindle."""
        if not (math.isfinite(sample.angle) and math.isfinite(sample.speed)):
            return
        if self._last is not None and sample.time < self._last.time:
            self._waiting.clear()
            self._last = None
        if self._last is None or sample.time > self._last.time:
            self._before, self._last = self._last, sample
        while self._waiting and self._waiting[0].time <= sample.time:
            self._pair(self._waiting.popleft())

    def reading(self, reading: Reading) -> None:
        """Process a sample of the sensor."""
        if not (math.isfinite(reading.first) and math.isfinite(reading.second)):
            return
        if self._last is not None and reading.time <= self._last.time:
            self._pair(reading)
        else:
            self._waiting.append(reading)

    @property
    def spindle_is_silent(self) -> bool:
        """True if readings arrive without samples of the spindle."""
        if not self._waiting:
            return False
        return self._last is None or self._waiting[-1].time > self._last.time + GAP

    def state(self) -> dict[str, Any]:
        """Return the complete state as JSON-able values."""
        return {
            "waiting": [*self._waiting],
            "spindle": [self._before, self._last],
            "unpaired": self.unpaired,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a state that ``state`` returned."""
        before, last = (
            None
            if sample is None
            else SpindleSample(whole(sample[0]), finite(sample[1]), finite(sample[2]))
            for sample in state["spindle"]
        )
        self._waiting.clear()
        for time, first, second in state["waiting"]:
            self._waiting.append(Reading(whole(time), finite(first), finite(second)))
        self._before, self._last = before, last
        self.unpaired = whole(state["unpaired"], 0)

    def _pair(self, reading: Reading) -> None:
        """Pass on a reading with the spindle's motion at the same time, or count it as unpaired."""
        before, last, time = self._before, self._last, reading.time
        if last is not None and time == last.time:
            at = last.angle, last.speed
        elif (
            last is not None and before is not None
            and before.time <= time < last.time <= before.time + GAP
        ):  # fmt: skip
            at = before.until(last, time)
        else:
            self.unpaired += 1
            return
        self._forward(time * 1e-9, *at, reading.first, reading.second)


_NAMED_TWICE = State.DONE, State.ABORTING, State.ABORTED
"""States whose name the profile controller's status already begins with."""

SPINDLE_SILENT = f"{topics.JOINT_STATES.name} is silent, the vibration sensor is not"


class AdaptiveExecution:
    """Adaptive start-up in progress; its public methods are those of ``ProfileExecution``.

    Parameters
    ----------
    settings
        Settings of the start-up's controller.
    first
        Initial speed of the spindle [rad/s].
    """

    def __init__(self, settings: StartUpSettings, first: float) -> None:
        self.first = first
        self.segment = 0, 0
        self._start_up = StartUp(settings)
        self._samples = PairedSamples(self._start_up.sample)
        self._reported, self._text = 0, self._start_up.words

    @property
    def words(self) -> str:
        """Present action, as text; see ``ProfileExecution``."""
        state, text = self._start_up.state, self._text
        return text.removeprefix(f"{state.text}: ") if state in _NAMED_TWICE else text

    @property
    def ended(self) -> bool:
        """True if the final speed is held, balanced or not; see ``ProfileExecution``."""
        return self._start_up.state in (State.DONE, State.GAVE_UP)

    @property
    def reached(self) -> bool:
        """True if the start-up ended at the running speed; see ``ProfileExecution``."""
        return self._start_up.state is State.DONE

    @property
    def failure(self) -> str:
        """Reason for an abort; see ``ProfileExecution``."""
        if self._start_up.state not in (State.ABORTING, State.ABORTED):
            return ""
        # Without spindle samples, readings are not passed on: the controller sees a silent sensor.
        silent = self._start_up.reason == TEXTS[Reason.SILENT] and self._samples.spindle_is_silent
        return f"{self.words}; {SPINDLE_SILENT}" if silent else self.words

    @property
    def why(self) -> str:
        """Problem that does not abort the start-up; see ``ProfileExecution``."""
        return self.words if self._start_up.state is State.GAVE_UP else ""

    @property
    def values(self) -> Mapping[str, str]:
        """Values for the diagnostics, by name; see ``ProfileExecution``."""
        estimates = self.estimates
        numbers = {
            "critical speed [rad/s]": estimates.critical_speed,
            "critical speed, deviation [rad/s]": estimates.critical_speed_deviation,
            "net unbalance [m]": abs(estimates.net_unbalance),
            "net unbalance, deviation [m]": estimates.net_unbalance_deviation,
            "net unbalance before the balls moved [m]": estimates.without_balls,
        }
        return {
            **{key: _text(number) for key, number in numbers.items()},
            "dwells": str(estimates.dwells),
            "retries": str(estimates.retries),
            "samples without the spindle's angle": str(self._samples.unpaired),
        }

    @property
    def estimates(self) -> Estimates:
        """Estimates of the drive's properties."""
        return self._start_up.estimates

    def begin(self, now: float) -> None:
        """Do nothing: time is that of the samples; see ``ProfileExecution``."""

    def spindle(self, sample: SpindleSample) -> None:
        """Process a sample of the spindle."""
        self._samples.spindle(sample)

    def reading(self, reading: Reading) -> None:
        """Process a sample of the sensor."""
        self._samples.reading(reading)

    def command(self, now: float) -> float | None:
        """Return the speed to command at a time [s] by the caller's clock [rad/s]; None at first.

        Before the first sample there is no speed to command.
        """
        speed = self._start_up.command(now)
        # The text of a decision is kept: its estimates change later, and would be reported again.
        if self._start_up.decision.number != self._reported:
            self._reported, self._text = self._start_up.decision
        return None if self._start_up.state is State.WAITING else speed

    def state(self) -> dict[str, Any]:
        """Return the state of the execution; see ``ProfileExecution``."""
        return {
            "numbers": self._start_up.state_numbers(),
            "samples": self._samples.state(),
            "text": self._text,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a state; see ``ProfileExecution``."""
        self._start_up.restore(tuple(float(number) for number in state["numbers"]))
        self._samples.restore(state["samples"])
        self._reported, self._text = self._start_up.decision.number, str(state["text"])


def _text(number: float) -> str:
    return "not known yet" if math.isnan(number) else f"{number:.6g}"
