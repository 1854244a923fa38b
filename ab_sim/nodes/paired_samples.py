"""Samples of a sensor, each with the spindle's angle and speed at its time; no ROS."""

import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ab_sim.base.numbers import finite, whole

GAP = 50_000_000
"""Time between two spindle samples beyond which the angle in between is unknown [ns]."""
MOST_WAITING = 4096
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
        """Return angle [rad] and speed [rad/s] at a time between this and a later sample [ns].

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
    """Combines each reading with the spindle's motion at its time, and passes them on in order.

    Samples that are not finite are ignored. If time decreases, the drive was reset, and waiting
    readings are dropped.

    Args:
        hand_on: function that is called with time [s], angle [rad], speed [rad/s], and the two
            values of the reading.
    """

    def __init__(self, hand_on: Callable[[float, float, float, float, float], None]) -> None:
        self._hand_on = hand_on
        self._waiting: deque[Reading] = deque(maxlen=MOST_WAITING)
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
        self._hand_on(time * 1e-9, *at, reading.first, reading.second)
