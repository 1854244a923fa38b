"""Import of bags without ``vibration/block``, of a test rig or another program."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Callable
from typing import Any

import numpy as np

from ab_msgs_py import ImuSample, Topic, VibrationSample, WhirlSample, topics
from ab_msgs_py.samples import HOUSING, frame_of, nanoseconds_of
from ab_sim.record.bags.contract import IgnoredMessages, decoded
from ab_sim.record.bags.reader import Bag
from ab_sim.record.recording import drawable

_WALL = 10**18
"""Stamp [ns] above which (after the year 2001) stamps are wall-clock times; such times count from
the first stamp."""
_SPINDLE = "spindle"
_JOINTS = "joints"
_EVERY = "every "
"""Prefix of the key of a series that has every sample of a sensor."""
ACCELERATION, DISPLACEMENT = "acceleration", "displacement"
"""Quantities that sensors measure."""


class _Series:
    """Samples of one topic, or of one sensor on a topic, each with a stamp [ns]."""

    def __init__(self, channels: tuple[str, ...]) -> None:
        self.channels = channels
        self.stamps, self.flat = array("q"), array("d")

    def add(self, stamp: int, values: list[float]) -> None:
        """Add a sample; refuse one that is not later than the last."""
        if self.stamps and stamp <= self.stamps[-1]:
            raise ValueError(f"its stamp, {stamp} ns, is not later than that of the message before")
        self.stamps.append(stamp)
        self.flat.extend(values)

    @property
    def values(self) -> np.ndarray:
        """All values, of shape (messages, channels)."""
        return np.array(self.flat).reshape(-1, len(self.channels))


def _interpolated(stamps: np.ndarray, series: _Series) -> np.ndarray:
    """Return a series, linearly interpolated at other stamps [ns], of shape (stamps, channels).

    Values are extrapolated by at most one interval after the last stamp. Beyond, and before the
    first stamp, they are NaN.
    """
    stamps_here = np.array(series.stamps)
    if len(stamps_here) < 2:
        return np.where(stamps[:, None] == stamps_here, series.values[0], np.nan)
    before = np.clip(
        np.searchsorted(stamps_here, stamps, side="right") - 1, 0, len(stamps_here) - 2
    )
    share = ((stamps - stamps_here[before]) / (stamps_here[before + 1] - stamps_here[before]))[
        :, None
    ]
    first, second = series.values[before], series.values[before + 1]
    # Without rounding, so that a value at a stamp of the series is exactly the received one.
    values = np.where(share == 1.0, second, first + share * (second - first))
    late = stamps_here[-1] + np.median(np.diff(stamps_here))
    values[(stamps < stamps_here[0]) | (stamps > late)] = np.nan
    return values


class ForeignBag(IgnoredMessages):
    """Joins the topics of a bag without blocks to one table.

    The table has a row for each stamp of the sensor with the most samples; without sensors, for
    each stamp of the joints. Angles and rates of joints are interpolated between their stamps, and
    extrapolated by at most one interval; if they were held, they would be late by half an interval
    on average. Other channels have the last value up to the stamp of the row. Before its first
    value, a channel is NaN. The command of a row is the last one before its stamp.

    Parameters
    ----------
    bag
        Open bag.
    namespace
        Namespace of the drive.
    kinds
        Topics to read, by full name.
    rows_of
        Channel of the sensor whose stamps give the rows instead, if it exists.
    """

    def __init__(
        self, bag: Bag, namespace: str, kinds: dict[str, Topic], rows_of: str | None = None
    ) -> None:
        super().__init__()
        self._namespace = namespace
        self._series: dict[str, _Series] = {}
        self._pickups: dict[str, str] = {}
        self.notes: list[str] = []
        """Notes on sensors whose last value is held until the next stamp."""
        self._commands = _Series(("command",))
        self._now = 0
        self._published: dict[str, Any] = {}
        self._read: dict[Topic, Callable[[Any], None]] = {
            topics.COMMAND: self._command,
            topics.JOINT_STATES: self._joints,
            topics.VIBRATION: self._vibration,
            topics.WHIRL: self._whirl,
            topics.IMU: self._imu,
            topics.PROBE: self._probe,
            topics.DESCRIPTION: self._describe,
        }
        read = {name: kind for name, kind in kinds.items() if kind in self._read}
        for message in bag.messages(read):
            kind = read[message.topic]
            try:
                message_read = decoded(message.data, kind.type_name)
                # Joints are read from the message itself: a rig may have others than a drive.
                raw = kind is topics.JOINT_STATES
                self._read[kind](message_read if raw else kind.sample(message_read))
            except ValueError as error:
                self.ignore(message.topic, error)
        self.channels: tuple[str, ...] = ("step", "time")
        self.samples = np.empty((0, 2))
        self._zero = 0
        if self._series:
            self._join(rows_of)
        self.description = {
            **self._published,
            "pickups": self._pickups,
            "bag": bag.path.name,
            "namespace": namespace,
            "time_zero": self._zero,
            "channels": list(self.channels),
        }
        self.drawn = drawable(self.description, self.channels)

    def _join(self, rows_of: str | None) -> None:
        """Join all series to one table with the stamps of the chosen one, see the class."""
        # `vibration` and `whirl` repeat samples of a sensor that has a topic for every sample.
        for key in [key for key in self._series if f"{_EVERY}{key}" in self._series]:
            del self._series[key]
        sensors = [series for key, series in self._series.items() if key != _JOINTS]
        chosen = [series for series in sensors if rows_of in series.channels]
        rows = max(
            chosen or sensors or self._series.values(), key=lambda series: len(series.stamps)
        )
        stamps = np.array(rows.stamps)
        self._zero = int(stamps[0]) if stamps[0] >= _WALL else 0
        columns = [np.arange(len(stamps), dtype=np.float64), (stamps - self._zero) / 1e9]
        names = ["step", "time"]
        for series in [*self._series.values(), self._commands]:
            if not series.stamps:
                continue
            # A command with the stamp of a row acts after the row.
            until = stamps - 1 if series is self._commands else stamps
            at = np.searchsorted(np.array(series.stamps), until, side="right") - 1
            values = np.where(at[:, None] < 0, np.nan, series.values[at])
            if series is self._series.get(_JOINTS) and series is not rows:
                values = _interpolated(stamps, series)
            elif series is not self._commands and len(series.stamps) < len(stamps):
                self.notes.append(
                    f"{series.channels[0]} has {len(series.stamps)} samples for {len(stamps)} rows:"
                    " each is held until the next one"
                )
            names += series.channels
            columns += list(values.T)
        self.channels, self.samples = tuple(names), np.column_stack(columns)

    def _add(self, key: str, names: tuple[str, ...], stamp: int, values: list[float]) -> None:
        """Add a sample to the series with a key; refuse one with other channels than before."""
        series = self._series.setdefault(key, _Series(names))
        if series.channels != names:
            raise ValueError(
                f"has {', '.join(names)}, and earlier messages have {', '.join(series.channels)}"
            )
        series.add(stamp, values)
        self._now = stamp

    def _command(self, speed: float) -> None:
        # Commands have no stamp, and get that of the last message. Of several, the last one counts.
        self._commands.stamps.append(self._now)
        self._commands.flat.append(speed)

    def _joints(self, message: Any) -> None:
        """Add angle, rate and torque of the spindle, and of each other joint, as far as present."""
        angles: dict[str, float] = {}
        for at, joint in enumerate(message.name):
            ball = re.fullmatch(r"ball_\d+", joint)
            names = (f"{joint}_angle", f"{joint}_rate", None if ball else f"{joint}_effort")
            if joint == _SPINDLE:
                names = ("angle", "speed", "motor_torque")
            fields = (message.position, message.velocity, message.effort)
            for name, field in zip(names, fields, strict=True):
                if name is None or len(field) == 0:
                    continue
                if len(field) != len(message.name):
                    raise ValueError(f"has {len(message.name)} names and {len(field)} values")
                if name in angles:
                    raise ValueError(f"names {joint} twice")
                # Without a motor the effort is NaN.
                if name != "motor_torque" or not math.isnan(field[at]):
                    angles[name] = float(field[at])
        if not angles:
            raise ValueError("names no joint that has a value")
        self._add(_JOINTS, tuple(angles), nanoseconds_of(message.header.stamp), [*angles.values()])

    def _vibration(self, sample: VibrationSample) -> None:
        names = self._channels(sample.frame, ACCELERATION) or ("ax", "ay", "az")
        self._add(names[0], names, sample.time, [*sample.linear])

    def _imu(self, sample: ImuSample) -> None:
        names = self._channels(sample.frame, ACCELERATION) or ("ax", "ay", "az")
        self._add(_EVERY + names[0], names, sample.time, [*sample.force])

    def _probe(self, sample: WhirlSample) -> None:
        names = self._channels(sample.frame, DISPLACEMENT) or ("x", "y", "z")
        self._add(_EVERY + names[0], names, sample.time, [*sample.place])

    def _channels(self, frame: str, kind: str) -> tuple[str, ...]:
        """Return the channel names of the sensor with a frame; empty for the housing's frame."""
        if frame in ("", frame_of(self._namespace, HOUSING)):
            return ()
        sensor = re.sub(r"[^a-z0-9_]", "_", frame.rpartition("/")[2].lower())
        self._pickups[sensor] = kind
        return tuple(f"{sensor}_{axis}" for axis in (1, 2, 3))

    def _whirl(self, sample: WhirlSample) -> None:
        self._add("x", ("x", "y", "z"), sample.time, [*sample.place])

    def _describe(self, description: dict[str, Any]) -> None:
        self._published = description
