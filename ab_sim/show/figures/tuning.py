"""Picture of a tuning: points that the search evaluated, in a panel for each key."""

import math
import re
import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ab_sim.analysis.metrics.verdict import Verdict
from ab_sim.design.judged import OUTCOME, metric_columns
from ab_sim.design.tune import AS_IT_IS, NO_PERIOD, Tuning
from ab_sim.scene.keys import scene_keys
from ab_sim.show.figures.saved import ResultFigure
from ab_sim.show.figures.sweep import BEST, LINE, WIDE

OUTSIDE, BEFORE, LEFT_OUT = "#c9c9c9", "#e88b2d", "#7a4fa3"
NO_VALUE: dict[str, Any] = {"ls": "", "marker": "x", "color": LEFT_OUT}
NOT_BALANCED: dict[str, Any] = {"ls": "", "marker": "o", "color": "white"}
DASHES = {AS_IT_IS: "--", NO_PERIOD: ":"}


def drawn_tuning(tuning: Tuning) -> ResultFigure:
    """Return the figure of a tuning without writing it."""
    keys, aim = tuning.keys, tuning.task.standard.aim.metric
    columns = min(3, len(keys))
    rows = math.ceil(len(keys) / columns)
    figure = ResultFigure(figsize=(1.2 + 4.2 * columns, 1.4 + 3.2 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    values = tuning.scores.aims * tuning.runs.factor(aim)
    ends = _left_out(tuning)
    for place, (axes, key) in enumerate(zip(panels, keys, strict=False)):
        _panel(tuning, axes, place, values, ends)
        axes.set_xlabel(_label(tuning, key, scene_keys(key)[0].meaning), fontsize=9)
        if place % columns == 0:
            axes.set_ylabel(_label(tuning, aim, _meaning_of(aim)), fontsize=9)
    there = np.concatenate([values, ends])
    there = there[np.isfinite(there)]
    if len(there) and there.min() > 0 and there.max() > WIDE * there.min():
        panels[0].set_yscale("log")
    for axes in panels[len(keys) :]:
        axes.set_axis_off()
    standard = tuning.task.standard
    bounds = "".join(f", {bound}" for bound in standard.bounds)
    of = f", of {100 * standard.share:g} % of drives" if tuning.task.spreading.draws > 1 else ""
    figure.suptitle(f"{tuning.runs.scene.name}: {standard.aim}{bounds}{of}", fontsize=11)
    figure.legend(
        handles=_legend(tuning), loc="outside lower center", ncols=min(2, columns), fontsize=9
    )
    return figure


def _meaning_of(aim: str) -> str:
    (metric,) = metric_columns([aim])
    return metric.meaning if metric.row is None else metric.row.label.replace("{W}", "W/e")


def _label(tuning: Tuning, name: str, meaning: str) -> str:
    """Return the meaning of a key or metric, and below it its name with the unit."""
    return f"{textwrap.fill(re.split('[;:]', meaning)[0], 50)}\n{tuning.runs.titled(name)}"


def _left_out(tuning: Tuning) -> np.ndarray:
    """Return the objective at the end of the run for unsettled candidates; NaN for all others."""
    ends = np.full(len(tuning.candidates), np.nan)
    if tuning.left_out:
        aim = tuning.task.standard.aim.metric
        chosen = np.isin(tuning.runs[OUTCOME].astype(str), list(tuning.left_out))
        ends[chosen] = tuning.runs.shown(aim)[chosen]
    return ends


def _not_balanced(tuning: Tuning) -> np.ndarray:
    """Return a mask of settled candidates that do not balance, all False for random drives."""
    if tuning.task.spreading.draws > 1:
        return np.zeros(len(tuning.candidates), bool)
    return np.asarray(tuning.runs[OUTCOME].astype(str) == Verdict.NOT_BALANCED.value)


def _panel(tuning: Tuning, axes: Axes, place: int, values: np.ndarray, ends: np.ndarray) -> None:
    range_, aim = tuning.task.ranges[place], tuning.task.standard.aim.metric
    wide, tall = tuning.runs.factor(range_.key), tuning.runs.factor(aim)
    across, within = tuning.candidates[:, place] * wide, tuning.scores.within
    size = min(4.0, max(1.2, 60.0 / math.sqrt(len(values))))
    for chosen, colour in ((~within, OUTSIDE), (within, LINE)):
        axes.plot(across[chosen], values[chosen], ls="", marker="o", ms=size, color=colour)
    hollow = _not_balanced(tuning)
    axes.plot(across[hollow], values[hollow], **NOT_BALANCED, ms=0.5 * size)
    axes.plot(across, ends, ls="", marker="o", ms=size, mfc="none", mec=LEFT_OUT, mew=0.6)
    nothing = across[~np.isfinite(values) & ~np.isfinite(ends)]
    if len(nothing):
        edge = axes.get_xaxis_transform()
        axes.plot(nothing, np.full(len(nothing), 0.98), transform=edge, **NO_VALUE, ms=size)
    for name, before, settled in tuning.before:
        if before is not None and settled:
            axes.axhline(before * tall, color=BEFORE, lw=1.2, ls=DASHES[name])
    for name, value, metric, inside in tuning.beside:
        if name == range_.key and inside and metric is not None:
            axes.plot(value * wide, metric * tall, marker="|", ms=12, mew=1.6, color=BEST, ls="")
    if tuning.candidate is not None:
        best = across[tuning.candidate], values[tuning.candidate]
        axes.plot(*best, marker="*", ms=15, mfc=BEST, mec="white", ls="")
    if range_.log:
        axes.set_xscale("log")
    else:
        axes.locator_params(axis="x", nbins=5)
    axes.grid(alpha=0.25)


def _legend(tuning: Tuning) -> list[Line2D]:
    within, valued = tuning.scores.within, np.isfinite(tuning.scores.aims)
    ends = np.isfinite(_left_out(tuning))
    kinds = (
        ("within all bounds", "o", LINE, LINE, within),
        ("outside a bound", "o", OUTSIDE, OUTSIDE, valued & ~within),
        ("left out: not settled, at their end", "o", "none", LEFT_OUT, ends),
    )
    handles = [
        Line2D([], [], marker=mark, mfc=face, mec=edge, ls="", label=f"{name}: {count}")
        for name, mark, face, edge, chosen in kinds
        if (count := int(np.count_nonzero(chosen)))
    ]
    if hollow := int(np.count_nonzero(_not_balanced(tuning) & valued)):
        text = f"white inside: not balanced: {hollow}"
        handles.append(
            Line2D([], [], marker="o", ls="", mfc="white", mec=LINE, mew=1.4, ms=5, label=text)
        )
    if nothing := int(np.count_nonzero(~valued & ~ends)):
        text = f"without a value, e.g. not balanced; at the upper edge: {nothing}"
        handles.append(Line2D([], [], **NO_VALUE, ms=4, label=text))
    if tuning.candidate is not None:
        handles.append(Line2D([], [], marker="*", ms=12, color=BEST, ls="", label="best"))
        handles.append(
            Line2D([], [], marker="|", ms=11, mew=1.6, color=BEST, ls="", label="5 % beside it")
        )
    for name, _, settled in tuning.before:
        if settled:
            handles.append(Line2D([], [], color=BEFORE, ls=DASHES[name], label=f"the scene {name}"))
    return handles
