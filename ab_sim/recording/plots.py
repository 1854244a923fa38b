"""How plots over time look."""

from __future__ import annotations

from collections.abc import Sequence

import rerun as rr
import rerun.blueprint as rrb

from ab_sim.recording.colours import GREY, Colour, hue


def plot(
    name: str,
    origin: str,
    *beside: str,
    legend: bool = True,
    top: bool = False,
    span: tuple[float, float] | None = None,
) -> rrb.View:
    """A plot of all that is at ``origin``, and of other entities."""
    return rrb.TimeSeriesView(
        name=name,
        origin=origin,
        contents=["$origin/**", *beside] if beside else "$origin/**",
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),  # zooming one zooms all
        axis_y=rrb.ScalarAxis(range=span) if span else None,
        # On the right, where it covers the end: a run begins with what matters.
        plot_legend=rrb.PlotLegend(
            rrb.Corner2D.RightTop if top else rrb.Corner2D.RightBottom, visible=legend
        ),
    )


def lines(
    names: Sequence[str],
    widths: Sequence[float] | None = None,
    swings: bool = False,
    colors: Sequence[Colour] | None = None,
) -> rr.SeriesLines:
    """Name and colour the series of an entity.

    Of what swings about 0, Rerun is to show the range where it cannot show every sample: it would
    show the mean, which is nothing.
    """
    if colors is None:
        colors = [GREY if name == "command" else hue(i) for i, name in enumerate(names)]
    if widths is None:
        widths = [3.0 if name == "speed" else 1.5 for name in names]  # command lies on top of speed
    policy = rr.components.AggregationPolicy.MinMax if swings else None
    return rr.SeriesLines(
        names=list(names), colors=list(colors), widths=list(widths), aggregation_policy=policy
    )
