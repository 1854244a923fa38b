"""Pictures of shares of balanced drives: of a spread, and of a sizing."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ab_sim.base import palette
from ab_sim.base.palette import hexadecimal
from ab_sim.design.sizing.size import Sizing
from ab_sim.design.spread import Spread, share_text
from ab_sim.design.statistics import ShareBalanced
from ab_sim.show.many_runs import is_wide
from ab_sim.show.saved import ResultFigure

TOTAL, _OTHER, _FIRST_ORDER = (
    hexadecimal(colour) for colour in (palette.MAIN, palette.CHANGING, palette.MAIN_PALE)
)
"""Colours: this scene and total Sobol indices; another scene; first-order Sobol indices."""
BOUND = hexadecimal(palette.BAD)


def drawn_spread(spread: Spread) -> ResultFigure:
    """Return the figure of a spread: distributions of metrics, and Sobol indices."""
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
    figure.suptitle(_spread_title(spread), fontsize=11)
    figure.legend(handles=_spread_legend(spread), loc="outside lower center", ncols=4, fontsize=9)
    return figure


def _draw_distribution(spread: Spread, axes: Axes, metric: str) -> None:
    """Draw the share of runs up to a value, quantiles, and bounds as lines."""
    designs = [(spread.runs, TOTAL)]
    if spread.against is not None:
        designs.insert(0, (spread.against.runs, _OTHER))
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
            axes.axvline(factor * bound.limit, color=BOUND, lw=1.2, ls="--")
    if not everything:
        axes.text(0.5, 0.5, "no values", transform=axes.transAxes, ha="center", fontsize=10)
    else:
        values = np.concatenate(everything)
        if is_wide(values):
            axes.set_xscale("log")
        else:
            axes.locator_params(axis="x", nbins=5)
    count = int(np.isfinite(spread[metric]).sum())
    axes.set_xlabel(spread.runs.titled(metric), fontsize=9)
    axes.set_ylabel(f"share of {count} runs", fontsize=9)
    axes.set_ylim(0.0, 1.0)
    axes.grid(alpha=0.25)


def _draw_indices(spread: Spread, axes: Axes, what: str, named: bool) -> None:
    """Draw two bars for each factor: its first-order index above, its total index below."""
    indices = spread.sobol.indices[what]
    places = np.arange(len(indices))[::-1].astype(float)
    for shift, colour, values, intervals in (
        (0.19, _FIRST_ORDER, [i.first for i in indices], [i.first_interval for i in indices]),
        (-0.19, TOTAL, [i.total for i in indices], [i.total_interval for i in indices]),
    ):
        axes.barh(places + shift, values, height=0.36, color=colour)
        for place, (low, high) in zip(places + shift, intervals, strict=True):
            axes.plot([low, high], [place] * 2, color="black", lw=1.2)
    axes.axvline(0.0, color="black", lw=0.6)
    axes.set_xlim(min(-0.05, *axes.get_xlim()), max(1.0, axes.get_xlim()[1]))
    axes.set_yticks(places, [i.factor for i in indices] if named else [""] * len(indices))
    axes.set_title(f"variance of {what}", fontsize=10)
    axes.grid(alpha=0.25, axis="x")


def _spread_title(spread: Spread) -> str:
    title = f"{spread.scene.name}: {share_text(spread.share)} of {spread.share.runs} drives balance"
    if spread.against is not None:
        title += f"; {spread.against.runs.scene.name}: {share_text(spread.against.share)}"
    return title


def _spread_legend(spread: Spread) -> list[Line2D]:
    handles = [Line2D([], [], color=TOTAL, lw=1.5, label=spread.scene.name)]
    if spread.against is not None:
        other = spread.against.runs.scene.name
        handles.append(Line2D([], [], color=_OTHER, lw=1.5, label=f"against {other}"))
    handles.append(
        Line2D([], [], color="black", marker="o", ms=4, label="quantile, interval of 95 %")
    )
    bounded = {bound.metric for bound in spread.criterion} & set(spread.quantiles)
    if bounded:
        handles.append(Line2D([], [], color=BOUND, ls="--", label="bound"))
    if spread.sobol.indices:
        labels = ((_FIRST_ORDER, "index of the spread alone"), (TOTAL, "with interactions"))
        for colour, label in labels:
            handles.append(Line2D([], [], color=colour, marker="s", ms=9, ls="", label=label))
    return handles


WINDOW, CHOSEN = hexadecimal(palette.WINDOW), hexadecimal(palette.CHOSEN)
CIRCULATES, PREDICTED = BOUND, hexadecimal(palette.PREDICTED)
SIMULATED = hexadecimal(palette.MAIN_DARK)


def drawn_sizing(sizing: Sizing) -> ResultFigure:
    """Return the figure of a sizing: drag windows by number of balls, and shares over the drag."""
    figure = ResultFigure(figsize=(11.0, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    _windows(sizing, left)
    _shares(sizing, right)
    figure.suptitle(
        f"a balancer for up to {sizing.specification.largest_unbalance:.3g} kg m at "
        f"{sizing.specification.speed:.4g} rad/s",
        fontsize=11,
    )
    handles, labels = left.get_legend_handles_labels()
    more, also = right.get_legend_handles_labels()
    figure.legend(handles + more, labels + also, loc="outside lower center", ncols=3, fontsize=9)
    return figure


def _windows(sizing: Sizing, axes: Axes) -> None:
    """Draw the drag window of each number of balls, and drags at which a bunch can circulate."""
    there = [candidate for candidate in sizing.candidates if candidate.balls is not None]
    ends = [candidate.border for candidate in there]
    ends += [
        end
        for candidate in there
        if candidate.window
        for end in (candidate.window.low, candidate.window.high)
    ]
    low, high = (0.3 * min(ends), 3.0 * max(ends)) if ends else (0.1, 10.0)
    named: set[str] = set()

    def label(text: str) -> str:
        new = text not in named
        named.add(text)
        return text if new else "_nolegend_"

    counts = [candidate.count for candidate in sizing.candidates]
    axes.set_xlim(min(counts) - 0.6, max(counts) + 0.6)
    for candidate in sizing.candidates:
        if candidate.balls is None:
            axes.text(candidate.count, math.sqrt(low * high), "none fit", ha="center", fontsize=9)
            continue
        text = label("a bunch of all balls can circulate")
        axes.bar(
            candidate.count,
            candidate.border - low,
            0.7,
            low,
            color=CIRCULATES,
            alpha=0.6,
            label=text,
        )
        if candidate.window is None:
            axes.text(
                candidate.count, 1.2 * candidate.border, "no drag\nserves", ha="center", fontsize=8
            )
            continue
        size, narrow = (
            candidate.window.high - candidate.window.low,
            candidate.reason_unsuitable is not None,
        )
        text = label("drag window, narrower than its tolerance" if narrow else "drag window")
        hatch = "//" if narrow else None
        axes.bar(
            candidate.count, size, 0.7, candidate.window.low, color=WINDOW, hatch=hatch,
            edgecolor="white", label=text,
        )  # fmt: skip
    if sizing.chosen is not None and sizing.chosen.drag is not None:
        axes.plot(
            sizing.chosen.count,
            sizing.chosen.drag,
            "*",
            ms=15,
            color=CHOSEN,
            mec="white",
            ls="",
            label="chosen",
        )
    axes.set_yscale("log")
    axes.set_ylim(low, high)
    axes.set_xticks(list(sizing.specification.counts))
    axes.set_xlabel("balls")
    axes.set_ylabel("drag c_b [N s/m]")
    axes.set_title("drags with which enough drives are balanced in time", fontsize=9)


def _shares(sizing: Sizing, axes: Axes) -> None:
    """Draw the share of balanced drives over the drag, predicted and simulated."""
    axes.set_xlabel("drag c_b [N s/m]")
    axes.set_ylabel("share that is balanced in time")
    axes.set_ylim(-0.03, 1.05)
    chosen = sizing.chosen
    if chosen is None or chosen.window is None or sizing.runs is None:
        axes.text(0.5, 0.5, "nothing could be sized", ha="center", transform=axes.transAxes)
        return
    drags, shares = sizing.predicted()
    axes.axvspan(chosen.window.low, chosen.window.high, color=WINDOW, alpha=0.3)
    axes.axvline(chosen.border, color=CIRCULATES, lw=1.2)
    axes.axhline(sizing.specification.share, color="black", lw=0.8, ls=":", label="wanted")
    axes.plot(drags, shares, color=PREDICTED, lw=1.6, label="predicted from growth rates")
    name = "runs, with intervals of 95 %"
    for at_drag in sizing.at_drags.values():
        _draw_share(axes, at_drag.drag, at_drag.runs.share, name)
        name = "_nolegend_"
    _draw_share(axes, float(chosen.drag or 0.0), sizing.runs.share, name, "*")
    axes.set_xscale("log")
    axes.grid(alpha=0.25)
    axes.set_title(f"{chosen.count} balls; star: drag varied within its tolerance", fontsize=9)


def _draw_share(axes: Axes, drag: float, share: ShareBalanced, name: str, mark: str = "o") -> None:
    """Draw the share of simulated drives that balance at a drag [N s/m], with the interval."""
    reach = np.array([[share.value - share.low], [share.high - share.value]])
    size = 13 if mark == "*" else 5
    axes.errorbar(
        [drag], [share.value], yerr=np.maximum(reach, 0.0), fmt=mark, ms=size, color=SIMULATED,
        capsize=3, label=name,
    )  # fmt: skip
