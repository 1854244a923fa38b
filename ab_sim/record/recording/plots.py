"""Style of plots over time, and the sources of their curves."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping

from ab_sim.base.palette import GREY, Colour, ball_colour, series_colours
from ab_sim.record.recording.layout import CHANNELS, DERIVED, SAMPLES

_BALL = re.compile(r"ball[_ ](\d+)")


class PlottedCurves(NamedTuple):
    """Curves of a plot: a component, which may have several series, and their style."""

    entity: str
    component: str
    look: rr.SeriesLines

    @classmethod
    def of_channels(cls, group: str, look: rr.SeriesLines) -> PlottedCurves:
        """Return the curves of a group of channels."""
        return cls(SAMPLES, f"{CHANNELS}:{group}", look)

    @classmethod
    def derived(cls, entity: str, name: str, look: rr.SeriesLines) -> PlottedCurves:
        """Return the computed curves with a name, of an entity."""
        return cls(entity, f"{DERIVED}:{name}", look)


def plot(
    name: str,
    *curves: PlottedCurves | str,
    corner: rrb.Corner2D = rrb.Corner2D.RightTop,
    legend: bool = True,
    span: tuple[float, float] | None = None,
) -> rrb.View:
    """Return a plot over time.

    Args:
        name: title of the plot.
        curves: curves, or entities whose scalars are plotted with their own style.
        corner: corner of the legend.
        legend: whether there is a legend.
        span: range of the vertical axis; None: automatic.
    """
    drawn: dict[Any, Any] = {}
    for curve in curves:
        if isinstance(curve, PlottedCurves):
            source = VisualizerComponentMapping(
                "Scalars:scalars",
                ComponentSourceKind.SourceComponent,
                source_component=curve.component,
            )
            drawn.setdefault(curve.entity, []).append(curve.look.visualizer(mappings=[source]))
    entities = [curve.entity if isinstance(curve, PlottedCurves) else curve for curve in curves]
    return rrb.TimeSeriesView(
        name=name,
        contents=list(dict.fromkeys(entities)),
        overrides=drawn,
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),  # zooming one plot zooms all
        axis_y=rrb.ScalarAxis(range=span) if span else None,
        # On the right, where the legend covers the end: the beginning of a run matters most.
        plot_legend=rrb.PlotLegend(corner, visible=legend),
    )


def lines(
    names: Sequence[str],
    widths: Sequence[float] | None = None,
    swings: bool = False,
    colors: Sequence[Colour] | None = None,
) -> rr.SeriesLines:
    """Return the style of the series of a component.

    Args:
        names: names of the series.
        widths: widths of the lines; None: default.
        swings: whether the signals oscillate about 0. If there are more samples than pixels, Rerun
            then shows their range instead of their mean, which is about 0.
        colors: colours of the lines; None: default.
    """
    if colors is None:
        colors = _colours(names)
    if widths is None:
        widths = [3.0 if name == "speed" else 1.5 for name in names]  # the command covers the speed
    policy = rr.components.AggregationPolicy.MinMax if swings else None
    return rr.SeriesLines(
        names=list(names), colors=list(colors), widths=list(widths), aggregation_policy=policy
    )


def _colours(names: Sequence[str]) -> list[Colour]:
    balls = [_BALL.match(name) for name in names]
    return [
        ball_colour(int(ball[1])) if ball else GREY if name == "command" else other
        for name, ball, other in zip(names, balls, series_colours(len(names)), strict=True)
    ]
