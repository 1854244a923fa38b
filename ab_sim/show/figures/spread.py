"""Picture of a spread: distributions of metrics of built drives, influence of each tolerance."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ab_sim.design.spread import Spread, share_text
from ab_sim.show.figures.saved import ResultFigure

OWN, OTHER, ALONE = "#2b6ca3", "#e88b2d", "#b9cfe3"
WIDE = 30.0
"""Ratio of largest to least value of a positive metric from which its axis is logarithmic."""


def drawn_spread(spread: Spread) -> ResultFigure:
    """Return the figure of a spread without writing it."""
    metrics, indices = list(spread.quantiles), list(spread.sobol.indices)
    columns = min((4, 3), key=lambda n: -len(metrics) % n + -len(indices) % n)
    above, below = (math.ceil(len(names) / columns) for names in (metrics, indices))
    tall = 0.9 + 0.32 * len(spread.sobol.indices[indices[0]]) if indices else 0.0
    heights = [2.6] * above + [max(tall, 1.6)] * below
    figure = ResultFigure(figsize=(4.0 * columns, 1.5 + sum(heights)), layout="constrained")
    panels = figure.subplots(
        max(1, above + below), columns, squeeze=False, height_ratios=heights or [1.0]
    )
    upper, lower = panels[:above].ravel(), panels[above:].ravel()
    for axes in (*upper[len(metrics) :], *lower[len(indices) :]):
        axes.set_axis_off()
    for axes, metric in zip(upper, metrics, strict=False):
        _draw_distribution(spread, axes, metric)
    for place, (axes, what) in enumerate(zip(lower, indices, strict=False)):
        _draw_indices(spread, axes, what, place % columns == 0)
    figure.suptitle(_title(spread), fontsize=11)
    figure.legend(handles=_legend(spread), loc="outside lower center", ncols=4, fontsize=9)
    return figure


def _draw_distribution(spread: Spread, axes: Axes, metric: str) -> None:
    """Draw the share of runs up to a value, quantiles, and bounds as lines."""
    designs = [(spread.runs, OWN)]
    if spread.against is not None:
        designs.insert(0, (spread.against.runs, OTHER))
    everything = []
    for runs, colour in designs:
        values = np.sort(runs.shown(metric)[np.isfinite(runs[metric])])
        if len(values):
            axes.ecdf(values, color=colour, lw=1.5)
            everything.append(values)
    factor = spread.runs.factor(metric)
    for quantile in spread.quantiles[metric]:
        ends = [
            factor * (quantile.value if end is None else end)
            for end in (quantile.low, quantile.high)
        ]
        axes.plot(ends, [quantile.p] * 2, color="black", lw=2.0, solid_capstyle="butt")
        axes.plot(factor * quantile.value, quantile.p, marker="o", ms=4, color="black")
    for bound in spread.criterion:
        if bound.metric == metric:
            axes.axvline(factor * bound.limit, color="#d7403a", lw=1.2, ls="--")
    if not everything:
        axes.text(0.5, 0.5, "no values", transform=axes.transAxes, ha="center", fontsize=10)
    else:
        values = np.concatenate(everything)
        if values.min() > 0.0 and values.max() > WIDE * values.min():
            axes.set_xscale("log")
        else:
            axes.locator_params(axis="x", nbins=5)
    count = int(np.isfinite(spread[metric]).sum())
    axes.set_xlabel(spread.runs.titled(metric), fontsize=9)
    axes.set_ylabel(f"share of {count} runs", fontsize=9)
    axes.set_ylim(0.0, 1.0)
    axes.grid(alpha=0.25)


def _draw_indices(spread: Spread, axes: Axes, what: str, named: bool) -> None:
    """Draw two bars for each factor: its index alone above, with interactions below."""
    indices = spread.sobol.indices[what]
    places = np.arange(len(indices))[::-1].astype(float)
    for shift, colour, values, intervals in (
        (0.19, ALONE, [i.first for i in indices], [i.first_interval for i in indices]),
        (-0.19, OWN, [i.total for i in indices], [i.total_interval for i in indices]),
    ):
        axes.barh(places + shift, values, height=0.36, color=colour)
        for place, (low, high) in zip(places + shift, intervals, strict=True):
            axes.plot([low, high], [place] * 2, color="black", lw=1.2)
    axes.axvline(0.0, color="black", lw=0.6)
    axes.set_xlim(min(-0.05, *axes.get_xlim()), max(1.0, axes.get_xlim()[1]))
    axes.set_yticks(places, [i.factor for i in indices] if named else [""] * len(indices))
    axes.set_title(f"variance of {what}", fontsize=10)
    axes.grid(alpha=0.25, axis="x")


def _title(spread: Spread) -> str:
    title = f"{spread.scene.name}: {share_text(spread.share)} of {spread.share.runs} drives balance"
    if spread.against is not None:
        title += f"; {spread.against.runs.scene.name}: {share_text(spread.against.share)}"
    return title


def _legend(spread: Spread) -> list[Line2D]:
    handles = [Line2D([], [], color=OWN, lw=1.5, label=spread.scene.name)]
    if spread.against is not None:
        other = spread.against.runs.scene.name
        handles.append(Line2D([], [], color=OTHER, lw=1.5, label=f"against {other}"))
    handles.append(
        Line2D([], [], color="black", marker="o", ms=4, label="quantile, interval of 95 %")
    )
    bounded = {bound.metric for bound in spread.criterion} & set(spread.quantiles)
    if bounded:
        handles.append(Line2D([], [], color="#d7403a", ls="--", label="bound"))
    if spread.sobol.indices:
        for colour, label in ((ALONE, "index of the spread alone"), (OWN, "with interactions")):
            handles.append(Line2D([], [], color=colour, marker="s", ms=9, ls="", label=label))
    return handles
