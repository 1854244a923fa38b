"""Size of the measured vibration in successive windows, by the sensor's own time stamps."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ab_sim.base.numbers import MOST_TIME, finite, whole
from ab_sim.scene.segments import Until

LEAST_SAMPLES = 8
"""Least number of samples in a window, which is extended if there are fewer."""

AXES = 3
"""Number of axes of a vibration vector."""


class _Sensor:
    """The present window of one sensor, and the result of its last complete one."""

    def __init__(self) -> None:
        self.rms: float | None = None
        self.newest: int | None = None
        self._begin(0)

    def _begin(self, stamp: int) -> None:
        self._since, self._count, self._spread = stamp, 0, 0.0
        self._mean = [0.0] * AXES

    def state(self) -> list[Any]:
        return [self.rms, self.newest, self._since, self._count, self._spread, *self._mean]

    def restore(self, state: Sequence[Any]) -> None:
        rms, newest, since, count, spread, *mean = state
        self.rms = None if rms is None else finite(rms, 0.0)
        self.newest = None if newest is None else whole(newest)
        self._since, self._count, self._spread = whole(since), whole(count, 0), finite(spread, 0.0)
        self._mean[:] = map(finite, mean)
        if len(self._mean) != AXES:
            raise ValueError(f"its mean has {len(self._mean)} numbers; must have {AXES}")

    def receive(self, stamp: int, vector: Sequence[float], over: float) -> None:
        if self.newest is None or stamp < self.newest:
            self.rms = None  # the first sample, or the drive was reset
            self._begin(stamp)
        elif (stamp - self._since) * 1e-9 >= over and self._count >= LEAST_SAMPLES:
            self.rms = math.sqrt(self._spread / self._count)
            self._begin(stamp)
        self.newest = stamp
        self._count += 1
        # Welford's algorithm: no large numbers are subtracted
        for axis, value in enumerate(vector):
            off = value - self._mean[axis]
            self._mean[axis] += off / self._count
            self._spread += off * (value - self._mean[axis])


class VibrationCondition:
    """Evaluation of a condition on the measured vibration, from now on.

    Args:
        until: the condition.
        now: the time by the caller's clock [s].
    """

    def __init__(self, until: Until, now: float) -> None:
        self._until = until
        self._sensors: dict[str, _Sensor] = {}
        self._heard: dict[str, float] = {}
        self._began = now

    def receive(self, now: float, sensor: str, stamp: int, vector: Sequence[float]) -> None:
        """Process a sample; one that is not finite, or repeats the last stamp, is ignored.

        Args:
            now: time by the caller's clock [s].
            sensor: frame of the sensor.
            stamp: time by the drive's clock [ns], of which only differences matter.
            vector: acceleration along three axes [m/s^2].
        """
        sensor_ = self._sensors.setdefault(sensor, _Sensor())
        if not all(map(math.isfinite, vector)) or stamp == sensor_.newest:
            return
        sensor_.receive(stamp, vector, self._until.over)
        self._heard[sensor] = now

    @property
    def rms(self) -> float | None:
        """Largest root mean square of the sensors [m/s^2].

        None until each has a complete window.
        """
        values = [sensor.rms for sensor in self._sensors.values()]
        return (
            None if not values or None in values else max(rms for rms in values if rms is not None)
        )

    @property
    def met(self) -> bool:
        """True if the condition holds."""
        below, above, rms = (
            self._until.vibration_rms_below,
            self._until.vibration_rms_above,
            self.rms,
        )
        if rms is None:
            return False
        return rms < below if below is not None else above is not None and rms > above

    def silence(self, now: float) -> float:
        """Return the longest time for which a sensor has been silent [s]."""
        times = [self._heard.get(sensor, self._began) for sensor in self._sensors]
        return now - min(times, default=self._began)

    def state(self) -> dict[str, Any]:
        """Return the complete state as JSON-able values."""
        sensors = {name: sensor.state() for name, sensor in self._sensors.items()}
        return {"sensors": sensors, "heard": self._heard, "began": self._began}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a result of ``state``."""
        self._began = finite(state["began"], 0.0, MOST_TIME)
        self._heard = {
            str(name): finite(heard, 0.0, MOST_TIME) for name, heard in state["heard"].items()
        }
        self._sensors = {str(name): _Sensor() for name in state["sensors"]}
        for name, sensor in self._sensors.items():
            sensor.restore(state["sensors"][name])
