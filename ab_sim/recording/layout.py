"""Where each channel lives in the file, and the columns Rerun takes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CLOSED = "/closed"
"""Where a recording says, last of all, how many rows it has."""
THINNED = "/thinned"
"""Where it says that it does not keep every step, and by which rule."""
LEFT_OUT = "/thinned/left_out"
"""Where each row then says how many were left out by intent up to it."""

_GROUPS = {
    "/clock/time": ("time",),
    "/spindle/angle": ("angle",),
    "/spindle/speed": ("speed", "command"),
    "/spindle/torque": ("motor_torque",),
    "/deck/displacement": ("x", "y", "z"),
    "/deck/velocity": ("vx", "vy", "vz"),
    "/deck/acceleration": ("ax", "ay", "az"),
    "/deck/turn": ("qw", "qx", "qy", "qz"),
    "/deck/angular_velocity": ("wx", "wy", "wz"),
    "/deck/angular_acceleration": ("wx_rate", "wy_rate", "wz_rate"),
}
_ENTITY = {name: entity for entity, names in _GROUPS.items() for name in names}
_BALL_CHANNEL = re.compile(r"ball_\d+_(angle|rate)")
_READING = re.compile(r"([a-z][a-z0-9_]*)_[123]")


def scalar_columns(values: Array) -> Any:
    """Columns of Scalars for values (rows, series)."""
    rows, series = values.shape
    return rr.Scalars.columns(scalars=values.ravel()).partition(np.full(rows, series))


def index_columns(time: ArrayLike, step: Array | None = None) -> list[rr.TimeColumn]:
    """Return the timelines for rows at these times [s] and steps."""
    # Rounded here, because Rerun truncates: 0.003 s would come out as 2,999,999 ns.
    nanoseconds = np.rint(np.asarray(time, dtype=np.float64) * 1e9).astype("timedelta64[ns]")
    index = [rr.TimeColumn("sim_time", duration=nanoseconds)]
    if step is not None:
        index.append(rr.TimeColumn("step", sequence=step.astype(np.int64)))
    return index


def entity_path(*parts: str) -> str:
    """Join parts, of any characters, to the path of an entity."""
    return str(rr.new_entity_path(list(parts)))  # escapes what Rerun reserves


def layout_of(channels: Sequence[str]) -> dict[str, list[int]]:
    """Columns of every entity, in order. ``step`` is a timeline and not among them."""
    layout: dict[str, list[int]] = {}
    for column, name in enumerate(channels):
        if name != "step":
            layout.setdefault(_entity_of(name), []).append(column)
    return layout


def _entity_of(channel: str) -> str:
    if channel in _ENTITY:
        return _ENTITY[channel]
    if ball := _BALL_CHANNEL.fullmatch(channel):
        return f"/balls/{ball[1]}"
    if reading := _READING.fullmatch(channel):
        return sensor_entity(reading[1])
    return entity_path("other", channel)


def sensor_entity(name: str) -> str:
    """Where the readings of a sensor are."""
    return f"/sensors/{name}"


def size_entity(entity: str) -> str | None:
    """Where the lengths of an entity's vectors are, if they are drawn.

    One curve, never a solid block, on an axis that begins at 0.
    """
    if entity == "/deck/acceleration":
        return "/plot/vibration/deck"
    return f"/plot/vibration{entity}" if entity.startswith("/sensors/") else None
