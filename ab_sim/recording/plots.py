"""The pictures of a recording that does not say where things are: a plot of each entity."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from ab_sim.errors import RecordingError
from ab_sim.recording.drawing import Drawing
from ab_sim.recording.layout import layout_of

ALWAYS = ("step", "time")
"""Channels that every recording has, first of all."""
_DRAWN = (*ALWAYS, "angle", "x", "y")
_IN_SPACE = ("z", "qw", "qx", "qy", "qz")  # what a deck in space needs besides

_TITLES = {
    "/spindle/angle": "Spindle: angle [rad]",
    "/spindle/speed": "Spindle: speed and command [rad/s]",
    "/spindle/torque": "Motor: torque [N m]",
    "/deck/displacement": "Deck: displacement [m]",
    "/deck/velocity": "Deck: velocity [m/s]",
    "/deck/acceleration": "Deck: vibration [m/s²]",
    "/deck/turn": "Deck: quaternion",
    "/deck/angular_velocity": "Deck: angular velocity [rad/s]",
    "/deck/angular_acceleration": "Deck: angular acceleration [rad/s²]",
    "/balls/angle": "Balls: angle from the unbalance [rad]",
    "/balls/rate": "Balls: rate [rad/s]",
}
_NOT_PLOTTED = ("/clock/time",)


@dataclass(frozen=True)
class Plots:
    """Of the entities that there are, once that is known."""

    entities: Sequence[str] = ()

    def document(self, description: Mapping[str, Any]) -> str:
        """Write the description for people, with its JSON in a fence for the reader."""
        try:
            text = json.dumps(dict(description), indent=2)
        except (TypeError, ValueError) as error:
            raise RecordingError(f"the description of a recording is not JSON: {error}") from error
        return (
            f"**Not drawn: where spindle and deck are is not all known.**\n\n```json\n{text}\n```\n"
        )

    def blueprint(self, scalars: Sequence[str] = ()) -> rrb.Blueprint:
        """Lay out the plots, one of each entity and of each of the scalars."""
        shown = [entity for entity in self.entities if entity not in _NOT_PLOTTED]
        views = [_plot(_TITLES.get(entity, entity), entity) for entity in shown]
        views += [_plot(name.replace("_", " ").capitalize(), f"/run/{name}") for name in scalars]
        right = rrb.Vertical(
            rrb.TextDocumentView(origin="/description", name="This run"),
            rrb.TextLogView(origin="/events", name="Events"),
        )
        columns = [rrb.Vertical(*part) for part in (views[::2], views[1::2]) if part]
        return rrb.Blueprint(
            rrb.Horizontal(*columns, right, column_shares=[4] * len(columns) + [3]),
            rrb.TimePanel(state="collapsed", timeline="sim_time"),
            rrb.BlueprintPanel(state="hidden"),
            rrb.SelectionPanel(state="hidden"),
        )

    def style(self, scalar: str) -> Any:
        """Archetype that says how a scalar is drawn."""
        return rr.SeriesLines(names=scalar)


def drawable(description: Mapping[str, Any], channels: Sequence[str]) -> bool:
    """Whether there can be a drawing of a run that is described so and has these channels."""
    try:
        drawing = Drawing.of(description)
    except RecordingError:
        return False
    balls = len(layout_of(channels).get("/balls/angle", ()))
    return balls == drawing.balls and set(needed_for(drawing)) <= set(channels)


def needed_for(drawing: Drawing | Plots) -> tuple[str, ...]:
    """Channels without which it cannot be."""
    if isinstance(drawing, Plots):
        return ALWAYS
    return _DRAWN + (_IN_SPACE if drawing.space else ())


def _plot(name: str, origin: str) -> rrb.View:
    axis = rrb.TimeAxis(link="LinkToGlobal")  # zooming one zooms all
    return rrb.TimeSeriesView(name=name, origin=origin, axis_x=axis)
