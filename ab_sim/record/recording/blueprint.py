"""Layout of Rerun's viewer for a recording (its blueprint)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from ab_sim.base.palette import GREEN, GREY, ORANGE, RUN, SKY, VERMILION
from ab_sim.record.recording.curves import Curves, PlottedCurves, lines, plot
from ab_sim.record.recording.drawing import Drawing
from ab_sim.record.recording.layout import layout_of
from ab_sim.record.recording.vibration import SPAN, SPECTRUM_SPAN, size_curves

_MOST_NAMES = 8
"""Largest number of balls' curves in a plot with a legend."""
_LOWER = rrb.Corner2D.RightBottom
_TITLES = {
    "real_time_factor": "Real-time factor [1]; 1 keeps up",
    "commands_received": "Commands received, speed, command [rad/s]",
}
_RANGES = {"real_time_factor": (0.0, 1.25)}
_STYLES: dict[str, Any] = {
    "real_time_factor": rr.SeriesLines(names="measured", colors=RUN, widths=3.0),
    "commands_received": rr.SeriesPoints(names="received", colors=GREY, marker_sizes=1.5),
}


def style(scalar: str) -> Any:
    """Return Rerun's archetype with the style of a scalar's plot; an unknown name gets a line."""
    return _STYLES.get(scalar, lines([scalar]))


def state_colours() -> rr.StateConfiguration:
    """Return the colours of the states of nodes, of a profile and of faults."""
    colours = {
        "OK": GREEN, "WARN": ORANGE, "ERROR": VERMILION, "STALE": GREY,
        "idle": GREY, "waiting": GREY, "running": SKY, "done": GREEN, "aborting": ORANGE,
        "aborted": VERMILION,
        "none": GREEN,  # no faults; the viewer chooses the colours of other texts
    }  # fmt: skip
    return rr.StateConfiguration(
        values=list(colours), labels=list(colours), colors=list(colours.values())
    )


def blueprint(
    drawing: Drawing,
    channels: Sequence[str] = (),
    scalars: Sequence[str] = (),
    page: int = 0,
    live: bool = False,
) -> rrb.Blueprint:
    """Return the layout of a recording with drawings.

    Parameters
    ----------
    drawing
        Drawings and curves of the recording.
    channels
        Channels of the samples.
    scalars
        Names of the scalars, each of which gets a plot.
    page
        Number of the page that is shown first, from 0.
    live
        Whether the viewer follows a growing recording.
    """
    pages: list[rrb.Container | rrb.View] = [
        _drive(drawing, channels),
        *_forces(drawing, channels),
        _vibration(drawing, channels),
        _health(scalars, _reference_curves(channels)),
        rrb.TextDocumentView(origin="/description", name="Description"),
    ]
    return _pages(pages, page, live)


def _of_channels(channels: Sequence[str], *groups: str) -> list[PlottedCurves]:
    """Return the curves of some groups of channels, in one plot; missing groups are left out."""
    layout = layout_of(channels)
    return [
        PlottedCurves.of_channels(group, lines([channels[column] for column in layout[group]]))
        for group in groups
        if group in layout
    ]


def _reference_curves(channels: Sequence[str]) -> dict[str, list[PlottedCurves]]:
    """Return the curves that are plotted together with a scalar, by name of the scalar.

    Rerun links the time axes of plots only when one of them is zoomed; before, each axis spans the
    data of its plot. So every plot contains a curve that covers the whole run.
    """
    speed = _of_channels(channels, "spindle_speed")
    return {"real_time_factor": [Curves.real_time()], "commands_received": speed}


def _drive(drawing: Drawing, channels: Sequence[str]) -> rrb.Container:
    """Return the page with drawings, speed, whirl, ball angles and an explanation."""
    curves = drawing.curves
    speed = [*_of_channels(channels, "spindle_speed"), curves.speed_level()]
    pictures = rrb.Grid(drawing.space.view(), drawing.top.view())
    plots = [
        plot("Spindle speed [rad/s]", "/plot/speed/period", *speed, corner=_LOWER),
        plot(_whirl(drawing), *curves.whirl()),
    ]
    if drawing.balls:
        name = "Ball angles from the unbalance [deg]"
        plots.append(plot(name, *curves.angles(), legend=drawing.balls <= _MOST_NAMES))
    text = rrb.TextDocumentView(origin="/about", name="Explanation")
    # Rerun shows a grid of three as one row in a wide window, and as one column in a narrow one.
    return rrb.Grid(
        pictures,
        rrb.Vertical(*plots),
        text,
        column_shares=[4, 5, 3],
        row_shares=[3, 8, 1.2],  # so that legends of four entries fit into 390 x 844
        name="Drive",
    )


def _forces(drawing: Drawing, channels: Sequence[str]) -> Iterator[rrb.Container]:
    """Yield the page with forces and, in space, the deck's tilt and height; none if it is empty."""
    curves, plots = drawing.curves, []
    if drawing.explanation.driven is not None:
        name = "Driving force on the balls, forward positive [N]"
        plots.append(plot(name, curves.driving(), legend=drawing.balls <= _MOST_NAMES))
    if drawing.motor:
        torque = _of_channels(channels, "spindle_torque")
        plots.append(plot("Motor torque [N m]", *torque, legend=False))
    if drawing.tilts:
        plots.append(plot("Tilt about x, y, shaft [mrad]", curves.tilt()))
        plots.append(plot("Height of the shaft [um]", curves.height(), legend=False))
    if plots:
        yield rrb.Grid(*plots, name="Forces")


def _vibration(drawing: Drawing, channels: Sequence[str]) -> rrb.Container:
    """Return the page of the vibration that a sensor would measure."""
    what = "deck and sensors" if drawing.sensors else "deck"
    return rrb.Grid(
        plot(f"Vibration |a|, {what} [m/s²]", *drawing.curves.vector_lengths(channels)),
        plot(f"R.m.s. of the last {SPAN:g} s [m/s²]", *size_curves()),
        rrb.BarChartView(
            name=f"Spectrum of {SPECTRUM_SPAN:g} s [m/s²] over [Hz]",
            origin="/plot/spectrum",
            plot_legend=rrb.PlotLegend(visible=False),
        ),
        plot(
            "Phase of the whirl from the unbalance [deg]",
            drawing.curves.phase(),
            legend=False,
            span=(-330.0, 30.0),
        ),
        name="Vibration",
    )


def _health(
    scalars: Sequence[str], reference_curves: Mapping[str, list[PlottedCurves]]
) -> rrb.Container:
    """Return the page on the progress of the run: states, scalars and events."""
    plots: list[rrb.View] = []
    for scalar in scalars:
        title = _TITLES.get(scalar, scalar.replace("_", " ").capitalize())
        references, span = reference_curves.get(scalar, []), _RANGES.get(scalar)
        plots.append(plot(title, f"/run/{scalar}", *references, legend=bool(references), span=span))
    states = rrb.StateTimelineView(
        origin="/",
        contents=["/state/**", "/health/**"],
        name="Phase of the run (v: variable speed), nodes",
        time_view=rrb.TimeAxis(link="LinkToGlobal"),
    )
    return rrb.Grid(states, *plots, _events(), name="Health")


def _events() -> rrb.View:
    """Return the view of the log of events."""
    columns = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body", "EntityPath"])
    return rrb.TextLogView(origin="/events", name="Events", columns=columns)


def _whirl(drawing: Drawing) -> str:
    """Return the title of the plot of the whirl's logarithm: Rerun 0.41 has no logarithmic axis."""
    return f"Whirl, log10 of {'W/e' if drawing.eccentricity else 'W in mm'}: -1 is 0.1, 0 is 1"


_PLOTTED = {
    "spindle_angle": "Spindle: angle [rad]",
    "spindle_speed": "Spindle: speed and command [rad/s]",
    "spindle_torque": "Motor: torque [N m]",
    "deck_displacement": "Deck: displacement [m]",
    "deck_velocity": "Deck: velocity [m/s]",
    "deck_acceleration": "Deck: vibration [m/s²]",
    "deck_turn": "Deck: quaternion",
    "deck_angular_velocity": "Deck: angular velocity [rad/s]",
    "deck_angular_acceleration": "Deck: angular acceleration [rad/s²]",
    "balls_angle": "Balls: angle from the unbalance [rad]",
    "balls_rate": "Balls: rate [rad/s]",
}


def plain_blueprint(
    channels: Sequence[str], scalars: Sequence[str] = (), live: bool = False
) -> rrb.Blueprint:
    """Return the layout of a recording without drawings: a plot of each group of channels.

    Parameters
    ----------
    channels
        Channels of the samples.
    scalars
        Names of the scalars, each of which gets a plot.
    live
        Whether the viewer follows a growing recording.
    """
    plots = [
        plot(_PLOTTED.get(group, group.partition("_")[2]), *_of_channels(channels, group))
        for group in layout_of(channels)
        if group != "time"
    ]
    log_view = rrb.Vertical(
        rrb.TextDocumentView(
            origin="/description", name="This run: plots only, because positions are unknown"
        ),
        _events(),
    )
    columns = [rrb.Vertical(*part) for part in (plots[::2], plots[1::2]) if part]
    page = rrb.Horizontal(*columns, log_view, column_shares=[4] * len(columns) + [3], name="Plots")
    return _pages((page, _health(scalars, {})), 0, live)


def _pages(pages: Sequence[rrb.Container | rrb.View], page: int, live: bool) -> rrb.Blueprint:
    """Return the layout of pages as tabs, of which the one with number ``page`` is open."""
    return rrb.Blueprint(
        rrb.Tabs(*pages, active_tab=page),
        rrb.TimePanel(
            state="collapsed",
            timeline="sim_time",
            play_state="following" if live else "paused",
        ),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
    )
