"""Bags without ``vibration/block``: of test rigs, or of a drive by somebody else's recorder."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Callable
from typing import Any

import numpy as np

from ab_msgs_py import Topic, VibrationSample, WhirlSample, topics
from ab_msgs_py.samples import HOUSING, frame_of, nanoseconds_of
from ab_sim.bags.drives import Ignored
from ab_sim.bags.messages import decoded
from ab_sim.bags.reader import Bag
from ab_sim.recording import drawable

_WALL = 10**18
"""ns; a stamp beyond (the year 2001) is of a clock on the wall, and times count from the first."""
_SPINDLE = "spindle"


class _Series:
    """What one topic said, or one sensor on it."""

    def __init__(self, channels: tuple[str, ...]) -> None:
        self.channels = channels
        self.stamps, self.flat = array("q"), array("d")

    def add(self, stamp: int, values: list[float]) -> None:
        if self.stamps and stamp <= self.stamps[-1]:
            raise ValueError(f"its stamp, {stamp} ns, is not later than the one before it")
        self.stamps.append(stamp)
        self.flat.extend(values)

    @property
    def values(self) -> np.ndarray:
        """Shape (messages, channels)."""
        return np.array(self.flat).reshape(-1, len(self.channels))


class ForeignBag(Ignored):
    """Gathers what such a bag has into one table.

    A row for every stamp of the series that has most; of the others, what was last said by then,
    NaN before the first time. A row's command is the one that was in force until its stamp.

    Args:
        bag: the bag.
        namespace: of the drive.
        kinds: what to read, by full names.
    """

    def __init__(self, bag: Bag, namespace: str, kinds: dict[str, Topic]) -> None:
        super().__init__()
        self._namespace = namespace
        self._series: dict[str, _Series] = {}
        self._commands = _Series(("command",))
        self._now = 0
        self._own: dict[str, Any] = {}
        self._read: dict[Topic, Callable[[Any], None]] = {
            topics.COMMAND: self._command,
            topics.JOINT_STATES: self._joints,
            topics.VIBRATION: self._vibration,
            topics.WHIRL: self._whirl,
            topics.DESCRIPTION: self._describe,
        }
        read = {name: kind for name, kind in kinds.items() if kind in self._read}
        for message in bag.messages(read):
            kind = read[message.topic]
            try:
                said = decoded(message.data, kind.type_name)
                # Joints may be any: a rig has others than a drive.
                self._read[kind](said if kind is topics.JOINT_STATES else kind.sample(said))
            except ValueError as error:
                self.ignore(message.topic, error)
        self.channels: tuple[str, ...] = ("step", "time")
        self.samples = np.empty((0, 2))
        self._zero = 0
        if self._series:
            self._join()
        self.description = {
            **self._own,
            "bag": bag.path.name,
            "namespace": namespace,
            "time_zero": self._zero,
            "channels": list(self.channels),
        }
        self.drawn = drawable(self.description, self.channels)

    def _join(self) -> None:
        longest = max(self._series.values(), key=lambda series: len(series.stamps))
        stamps = np.array(longest.stamps)
        self._zero = int(stamps[0]) if stamps[0] >= _WALL else 0
        columns = [np.arange(len(stamps), dtype=np.float64), (stamps - self._zero) / 1e9]
        names = ["step", "time"]
        for series in [*self._series.values(), self._commands]:
            if not series.stamps:
                continue
            # A command that came with a row acts after it.
            until = stamps - 1 if series is self._commands else stamps
            at = np.searchsorted(np.array(series.stamps), until, side="right") - 1
            values = np.where(at[:, None] < 0, np.nan, series.values[at])
            names += series.channels
            columns += list(values.T)
        self.channels, self.samples = tuple(names), np.column_stack(columns)

    def _add(self, key: str, names: tuple[str, ...], stamp: int, values: list[float]) -> None:
        series = self._series.setdefault(key, _Series(names))
        if series.channels != names:
            raise ValueError(f"gives {', '.join(names)} and gave {', '.join(series.channels)}")
        series.add(stamp, values)
        self._now = stamp

    def _command(self, speed: float) -> None:
        # It has no stamp of its own. Of several at once the last one counts.
        self._commands.stamps.append(self._now)
        self._commands.flat.append(speed)

    def _joints(self, message: Any) -> None:
        found: dict[str, float] = {}
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
                if name in found:
                    raise ValueError(f"names {joint} twice")
                # A drive that models no motor says NaN.
                if name != "motor_torque" or not math.isnan(field[at]):
                    found[name] = float(field[at])
        if not found:
            raise ValueError("names no joint that has a value")
        self._add("joints", tuple(found), nanoseconds_of(message.header.stamp), [*found.values()])

    def _vibration(self, sample: VibrationSample) -> None:
        frame = sample.frame
        names: tuple[str, ...] = ("ax", "ay", "az")
        if frame not in ("", frame_of(self._namespace, HOUSING)):
            sensor = re.sub(r"[^a-z0-9_]", "_", frame.rpartition("/")[2].lower())
            names = tuple(f"{sensor}_{axis}" for axis in (1, 2, 3))
        self._add(names[0], names, sample.time, [*sample.linear])

    def _whirl(self, sample: WhirlSample) -> None:
        self._add("whirl", ("x", "y", "z"), sample.time, [*sample.place])

    def _describe(self, description: dict[str, Any]) -> None:
        self._own = description
