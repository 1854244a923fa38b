"""Entities and components of the channels in a file, and their columns for Rerun."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CLOSED = "/closed"
"""Entity with the number of rows, written last."""
THINNED = "/thinned"
"""Entity with the rule by which steps were thinned."""
LEFT_OUT = "left_out"
"""Component with the number of rows left out by thinning before each row."""

SAMPLES = "/samples"
"""The entity of all samples. Whatever is sent to an entity costs 32 bytes of index in each row, and
some 1.2 kB besides: all channels in one take a third of the room of an entity for each group."""
CHANNELS, DERIVED = "channels", "plot"
"""Prefixes of its components: of channels, and of derived curves."""

_GROUPS = {
    "time": ("time",),
    "spindle_angle": ("angle",),
    "spindle_speed": ("speed", "command"),
    "spindle_torque": ("motor_torque",),
    "deck_displacement": ("x", "y", "z"),
    "deck_velocity": ("vx", "vy", "vz"),
    "deck_acceleration": ("ax", "ay", "az"),
    "deck_turn": ("qw", "qx", "qy", "qz"),
    "deck_angular_velocity": ("wx", "wy", "wz"),
    "deck_angular_acceleration": ("wx_rate", "wy_rate", "wz_rate"),
}
_GROUP = {name: group for group, names in _GROUPS.items() for name in names}
_BALL_CHANNEL = re.compile(r"ball_\d+_(angle|rate)")
_READING = re.compile(r"([a-z][a-z0-9_]*)_[123]")


def named_columns(kind: str, values: Mapping[str, Array]) -> list[Any]:
    """Columns of components ``KIND:NAME`` for values of shape (rows, series)."""
    columns: list[Any] = []
    for name, each in values.items():
        rows, series = each.shape
        column = rr.DynamicArchetype.columns(archetype=kind, components={name: each.ravel()})
        columns += column.partition(np.full(rows, series))
    return columns


def plotted_columns(values: Mapping[str, Array]) -> list[Any]:
    """The same for plots, in single precision."""
    return named_columns(DERIVED, {name: each.astype(np.float32) for name, each in values.items()})


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
    """Columns of every group of channels, in order. ``step`` is a timeline and not among them."""
    layout: dict[str, list[int]] = {}
    for column, name in enumerate(channels):
        if name != "step":
            layout.setdefault(_group_of(name), []).append(column)
    return layout


def _group_of(channel: str) -> str:
    if channel in _GROUP:
        return _GROUP[channel]
    if ball := _BALL_CHANNEL.fullmatch(channel):
        return f"balls_{ball[1]}"
    if reading := _READING.fullmatch(channel):
        return f"sensor_{reading[1]}"
    return f"other_{channel}"


def vector_columns(channels: Sequence[str]) -> dict[str, list[int]]:
    """Columns of the vectors whose lengths are plotted: the deck's acceleration and readings.

    One curve each, never a solid block, on an axis that begins at 0.
    """
    layout = layout_of(channels)
    wanted = [name for name in layout if name == "deck_acceleration" or name.startswith("sensor_")]
    return {name: layout[name] for name in wanted}
