"""Entities and components of channels in a recording, and columns in Rerun's form."""

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
DECIMATED = "/decimated"
"""Entity with the rule by which steps were decimated."""
LEFT_OUT = "left_out"
"""Component with the number of rows that decimation omitted up to each row."""

SAMPLES = "/samples"
"""Entity of all samples. Each entity takes 32 bytes of index per row, and some 1.2 kB per message,
so that one entity for all channels takes a third of the space of an entity for each group."""
CHANNELS, DERIVED = "channels", "plot"
"""Prefixes of the names of components: channels, and computed curves."""

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
    """Return Rerun's columns of the components ``KIND:NAME``.

    Parameters
    ----------
    kind
        Prefix of the components' names.
    values
        Values by name, shape (rows, series).
    """
    columns: list[Any] = []
    for name, value in values.items():
        rows, series = value.shape
        column = rr.DynamicArchetype.columns(archetype=kind, components={name: value.ravel()})
        columns += column.partition(np.full(rows, series))
    return columns


def plotted_columns(values: Mapping[str, Array]) -> list[Any]:
    """Return Rerun's columns of computed curves, in single precision; see ``named_columns``."""
    return named_columns(
        DERIVED, {name: value.astype(np.float32) for name, value in values.items()}
    )


def scalar_columns(values: Array) -> Any:
    """Return Rerun's columns of ``Scalars``, from values of shape (rows, series)."""
    rows, series = values.shape
    return rr.Scalars.columns(scalars=values.ravel()).partition(np.full(rows, series))


def index_columns(time: ArrayLike, step: Array | None = None) -> list[rr.TimeColumn]:
    """Return Rerun's timelines of rows: ``sim_time`` from times [s], and ``step`` if given."""
    # Rounded here, because Rerun truncates: 0.003 s would become 2,999,999 ns.
    nanoseconds = np.rint(np.asarray(time, dtype=np.float64) * 1e9).astype("timedelta64[ns]")
    index = [rr.TimeColumn("sim_time", duration=nanoseconds)]
    if step is not None:
        index.append(rr.TimeColumn("step", sequence=step.astype(np.int64)))
    return index


def entity_path(*parts: str) -> str:
    """Return the path of an entity from its parts, which may have any characters."""
    return str(rr.new_entity_path(list(parts)))  # escapes reserved characters


def layout_of(channels: Sequence[str]) -> dict[str, list[int]]:
    """Return the indices of the channels in each group, by name of the group.

    ``step`` is in no group, because it is a timeline.
    """
    layout: dict[str, list[int]] = {}
    for column, name in enumerate(channels):
        if name != "step":
            layout.setdefault(_group_of(name), []).append(column)
    return layout


def _group_of(channel: str) -> str:
    """Return the group of a channel, as in the table of `ab_sim.record.recording`."""
    if channel in _GROUP:
        return _GROUP[channel]
    if ball := _BALL_CHANNEL.fullmatch(channel):
        return f"balls_{ball[1]}"
    if reading := _READING.fullmatch(channel):
        return f"sensor_{reading[1]}"
    return f"other_{channel}"


def vector_columns(channels: Sequence[str]) -> dict[str, list[int]]:
    """Return the channels' indices of each vector with a plotted length, by group.

    These are the deck's acceleration and the sensors' readings. The components of a fast vibration
    would fill the plot as solid blocks; the length does not.
    """
    layout = layout_of(channels)
    wanted = [name for name in layout if name == "deck_acceleration" or name.startswith("sensor_")]
    return {name: layout[name] for name in wanted}
