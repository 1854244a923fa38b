"""Picture of a sizing: drag windows over numbers of balls, predicted and simulated shares."""

import math

import numpy as np
from matplotlib.axes import Axes

from ab_sim.design.intervals import ShareBalanced
from ab_sim.design.sizing.size import Sizing
from ab_sim.show.figures.saved import ResultFigure

WINDOW, CIRCULATES, CHOSEN, PREDICTED, SEEN = "#7fbf7b", "#d95f5f", "#1b6e2e", "#888888", "#1f4e8c"


def drawn_sizing(sizing: Sizing) -> ResultFigure:
    """Return the figure of a sizing without writing it."""
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
        size, narrow = candidate.window.high - candidate.window.low, candidate.why_not is not None
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
        _seen(axes, at_drag.drag, at_drag.runs.share, name)
        name = "_nolegend_"
    _seen(axes, float(chosen.drag or 0.0), sizing.runs.share, name, "*")
    axes.set_xscale("log")
    axes.grid(alpha=0.25)
    axes.set_title(f"{chosen.count} balls; star: drag varied within its tolerance", fontsize=9)


def _seen(axes: Axes, drag: float, share: ShareBalanced, name: str, mark: str = "o") -> None:
    reach = np.array([[share.value - share.low], [share.high - share.value]])
    size = 13 if mark == "*" else 5
    axes.errorbar(
        [drag], [share.value], yerr=np.maximum(reach, 0.0), fmt=mark, ms=size, color=SEEN,
        capsize=3, label=name,
    )  # fmt: skip
