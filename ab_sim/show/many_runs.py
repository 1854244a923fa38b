"""Pictures of sweeps, tunings and sensitivities: metrics over values of keys."""

import itertools
import math
import re
import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.lines import Line2D

from ab_sim.analysis.metrics.metric import Better, metrics_named
from ab_sim.analysis.metrics.verdict import Verdict
from ab_sim.base import palette
from ab_sim.base.palette import hexadecimal
from ab_sim.design.derivatives import MetricSensitivities
from ab_sim.design.judged import ABORTED, FAILED, OUTCOME, metric_columns
from ab_sim.design.sweep import Sweep
from ab_sim.design.tune import AS_IT_IS, NO_PERIOD, Tuning
from ab_sim.scene.keys import scene_keys
from ab_sim.show.saved import ResultFigure

CHANGING, LEFT_OUT = hexadecimal(palette.CHANGING), hexadecimal(palette.STOPPED)
_MARKS = {
    Verdict.CHANGING.value: ("o", CHANGING),
    Verdict.UNSETTLED.value: ("o", CHANGING),
    Verdict.CIRCULATES.value: ("^", hexadecimal(palette.BAD)),
    ABORTED: ("v", LEFT_OUT),
    FAILED: ("x", hexadecimal(palette.DARK)),
}
"""Markers and colours of runs that did not settle, by outcome."""
_BALANCES = {Verdict.BALANCED.value: "white", Verdict.RINGING_DOWN.value: hexadecimal(palette.DOT)}
"""Fill colours of the dots that mark balanced runs on maps, by outcome."""
_NO_VALUE = hexadecimal(palette.NO_VALUE)
LINE, BEST = hexadecimal(palette.MAIN), hexadecimal(palette.BEST)
WIDE = 30.0
"""Ratio of largest to least value of a positive metric above which axes are logarithmic."""
_MOST_KEYS = 6
"""Largest number of keys in panels of pairs; the title names the others."""


def drawn_sweep(sweep: Sweep) -> ResultFigure:
    """Return the figure of a sweep: curves over one key, maps over two, or pairs of several."""
    if len(sweep.keys) == 1:
        return _lines(sweep)
    return _maps(sweep) if len(sweep.keys) == 2 else _pairs(sweep)


def _lines(sweep: Sweep) -> ResultFigure:
    """Draw a panel for each metric; several runs at one value give a median and a band."""
    key, metrics = sweep.keys[0], sweep.metrics
    figure = ResultFigure(figsize=(8.0, 1.2 + 2.2 * len(metrics)), layout="constrained")
    panels = figure.subplots(len(metrics), 1, sharex=True, squeeze=False)[:, 0]
    places, names = _places(sweep, key)
    for axes, metric in zip(panels, metrics, strict=True):
        values = sweep.shown(metric).astype(float)
        there = np.isfinite(values)
        across = np.unique(places[there])
        groups = [values[there & (places == x)] for x in across]
        if groups:
            axes.fill_between(
                across, [g.min() for g in groups], [g.max() for g in groups], color=LINE,
                alpha=0.2, lw=0,
            )  # fmt: skip
            # NaN interrupts the line at values without results.
            middle = np.full(len(every := np.unique(places)), np.nan)
            middle[np.isin(every, across)] = [np.median(g) for g in groups]
            axes.plot(every, middle, color=LINE, marker=".", ms=5, lw=1.4)
            if is_wide(values[there]):
                axes.set_yscale("log")
        _mark_others(sweep, axes, places, values)
        _mark_best(sweep, metric, axes, places, values)
        axes.set_ylabel(sweep.titled(metric), fontsize=9)
        axes.grid(alpha=0.25)
    _scale_axis(sweep, key, panels[-1], names, "x")
    panels[0].set_title(_title(sweep), fontsize=11)
    figure.legend(handles=_legend(sweep), loc="outside lower center", ncols=4, fontsize=9)
    return figure


def _maps(sweep: Sweep) -> ResultFigure:
    """Draw a map for each metric."""
    (across, up), metrics = sweep.keys, sweep.metrics
    columns = min(2, len(metrics))
    rows = math.ceil(len(metrics) / columns)
    figure = ResultFigure(figsize=(1.0 + 5.6 * columns, 1.2 + 4.4 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    (x, names_x), (y, names_y) = _places(sweep, across), _places(sweep, up)
    for axes, metric in zip(panels, metrics, strict=False):
        values = sweep.shown(metric).astype(float)
        colours = _draw_map(sweep, axes, (x, y), values)
        _mark_balanced(sweep, axes, x, y)
        _mark_others(sweep, axes, x, y)
        _mark_best(sweep, metric, axes, x, y)
        axes.set_title(sweep.titled(metric), fontsize=10)
        if colours is not None:
            figure.colorbar(colours, ax=axes, pad=0.02)
    for axes in panels[len(metrics) :]:
        axes.set_axis_off()
    for place, axes in enumerate(panels[: len(metrics)]):
        _scale_axis(sweep, across, axes, names_x, "x", place + columns >= len(metrics))
        _scale_axis(sweep, up, axes, names_y, "y", place % columns == 0)
    figure.suptitle(_title(sweep), fontsize=11)
    gaps = any(not np.isfinite(sweep.shown(metric).astype(float)).all() for metric in metrics)
    handles = [*_legend(sweep, dots=True), *([_no_value()] if gaps else [])]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=9)
    return figure


def _draw_map(
    sweep: Sweep, axes: Axes, places: tuple[np.ndarray, np.ndarray], values: np.ndarray
) -> ScalarMappable | None:
    """Draw the values of a grid as areas, or of a design as points; return None without values."""
    (x, y), there = places, np.isfinite(values)
    if not there.any():
        axes.text(0.5, 0.5, "no values", transform=axes.transAxes, ha="center", fontsize=10)
        return None
    norm = _norm(values[there])
    if sweep.shape is None:
        return axes.scatter(x[there], y[there], c=values[there], s=14, norm=norm, cmap="viridis")
    grid = values.reshape(sweep.shape).T
    across, up = x.reshape(sweep.shape)[:, 0], y.reshape(sweep.shape)[0]
    order_x, order_y = np.argsort(across), np.argsort(up)
    across, up, grid = across[order_x], up[order_y], grid[np.ix_(order_y, order_x)]
    areas = axes.pcolormesh(
        across, up, grid, norm=norm, cmap="viridis", shading="nearest", rasterized=True
    )
    axes.set_facecolor(_NO_VALUE)
    return areas


def _pairs(sweep: Sweep) -> ResultFigure:
    """Draw runs over each pair of keys, coloured by the first metric, with good runs on top."""
    keys, metric = sweep.keys[:_MOST_KEYS], sweep.metrics[0]
    count = len(keys) - 1
    side = max(2.2, 7.5 / count)
    figure = ResultFigure(figsize=(1.5 + side * count, 1.2 + side * count), layout="constrained")
    panels = figure.subplots(count, count, squeeze=False, sharex="col", sharey="row")
    values = sweep.shown(metric).astype(float)
    there = np.flatnonzero(np.isfinite(values))
    order = there[np.argsort(values[there])]
    if metrics_named([metric])[0].better is not Better.LARGER:
        order = order[::-1]
    norm = _norm(values[there]) if len(there) else Normalize()
    for row, column in itertools.product(range(count), range(count)):
        axes = panels[row, column]
        if column > row:
            axes.set_axis_off()
            continue
        (x, names_x), (y, names_y) = (_places(sweep, k) for k in (keys[column], keys[row + 1]))
        axes.scatter(x[order], y[order], c=values[order], s=10, norm=norm, cmap="viridis")
        _mark_balanced(sweep, axes, x, y)
        _mark_others(sweep, axes, x, y)
        _mark_best(sweep, metric, axes, x, y)
        _scale_axis(sweep, keys[column], axes, names_x, "x", row == count - 1)
        _scale_axis(sweep, keys[row + 1], axes, names_y, "y", column == 0)
    bar = ScalarMappable(norm, "viridis")
    figure.colorbar(bar, ax=panels, label=sweep.titled(metric), shrink=0.6, pad=0.02)
    left_out = (
        f"; {', '.join(sweep.keys[_MOST_KEYS:])} not drawn" if len(sweep.keys) > len(keys) else ""
    )
    figure.suptitle(_title(sweep) + left_out, fontsize=11)
    figure.legend(
        handles=_legend(sweep, dots=True), loc="outside lower center", ncols=4, fontsize=9
    )
    return figure


def _places(sweep: Sweep, key: str) -> tuple[np.ndarray, list[str] | None]:
    """Return the position of each run on a key's axis, and the labels of positions 0, 1 and so on.

    Labels are None for a key with numbers.
    """
    values = sweep.shown(key)
    if values.dtype.kind in "fiu":
        return values.astype(float), None
    names = list(dict.fromkeys(str(value) for value in values))
    return np.array([names.index(str(value)) for value in values], float), names


def _scale_axis(
    sweep: Sweep, key: str, axes: Axes, names: list[str] | None, which: str, titled: bool = True
) -> None:
    """Set ticks and title of a key's axis, and a logarithmic scale if the values suggest one."""
    axis = axes.xaxis if which == "x" else axes.yaxis
    if names is not None:
        axis.set_ticks(range(len(names)), [name[:24] for name in names])
    elif _is_log(sweep[key].astype(float)):
        (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    if titled:
        axis.set_label_text(sweep.titled(key), fontsize=9)


def _is_log(values: np.ndarray) -> bool:
    """Return whether positive values are more evenly spaced on a logarithmic axis."""
    across = np.unique(values)
    if len(across) < 3 or across[0] <= 0 or across[-1] < 3.0 * across[0]:
        return False
    evenness = [
        np.std(np.diff(values)) / np.mean(np.diff(values)) for values in (across, np.log(across))
    ]
    return bool(evenness[1] < evenness[0])


def _mark_balanced(sweep: Sweep, axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    """Mark balanced runs with dots, at the positions of all runs in axis coordinates."""
    for outcome in _BALANCES:
        chosen = sweep[OUTCOME] == outcome
        axes.plot(x[chosen], y[chosen], ms=_size(y), mew=0.6, **_style(outcome))


def _mark_others(sweep: Sweep, axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    """Mark runs that did not settle: by dots, or without a value by lines across the panel."""
    for outcome, (_, colour) in _MARKS.items():
        chosen = sweep[OUTCOME] == outcome
        valued = chosen & np.isfinite(y)
        axes.plot(x[valued], y[valued], ms=_size(y), zorder=3, **_style(outcome))
        for place in x[chosen & ~np.isfinite(y)]:
            axes.axvline(place, color=colour, lw=1.0, alpha=0.35, zorder=0)


def _size(places: np.ndarray) -> float:
    """Return the size of a run's marker [pt], which falls with the number of runs."""
    return min(4.0, max(1.0, 80.0 / math.sqrt(len(places))))


def _style(outcome: str) -> dict[str, Any]:
    """Return the style of the marker of an outcome in ``_MARKS`` or ``_BALANCES``."""
    if outcome in _BALANCES:
        return {"ls": "", "marker": "o", "mfc": _BALANCES[outcome], "mec": "black"}
    marker, colour = _MARKS[outcome]
    return {"ls": "", "marker": marker, "mfc": "none" if marker == "o" else colour, "mec": colour}


def _mark_best(sweep: Sweep, metric: str, axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    """Mark the best run by a metric with a star; not if neither end of the metric is better."""
    if metrics_named([metric])[0].better is Better.NEITHER:
        return
    run = sweep.best(metric)
    if run is not None:
        axes.plot(
            x[run], y[run], marker="*", ms=15, mfc=BEST, mec="white", mew=0.8, ls="", zorder=4
        )


def _legend(sweep: Sweep, dots: bool = False) -> list[Line2D]:
    """Return legend entries for the outcomes of runs that occur, with counts.

    Parameters
    ----------
    sweep
        The sweep.
    dots
        Whether runs that balance have dots, as on maps.
    """
    handles = [Line2D([], [], marker="*", ms=12, color=BEST, ls="", label="best that settled")]
    for outcome, count in sweep.outcomes.items():
        label = f"{outcome}: {count}"
        if outcome in _MARKS or (dots and outcome in _BALANCES):
            handles.append(Line2D([], [], label=label, **_style(outcome)))
        elif dots:
            handles.append(Line2D([], [], ls="", label=f"no mark: {label}"))
        else:
            handles.append(Line2D([], [], ls="", marker="s", color=LINE, label=label))
    return handles


def _no_value() -> Line2D:
    return Line2D([], [], ls="", marker="s", ms=9, mfc=_NO_VALUE, mec="black", label="no value")


def _norm(values: np.ndarray) -> Normalize:
    """Return a colour scale over the range of values, logarithmic if ``is_wide``."""
    if is_wide(values):
        return LogNorm(values.min(), values.max())
    return Normalize(values.min(), values.max())


def is_wide(values: np.ndarray) -> bool:
    """Return whether all values are positive, with a ratio above ``WIDE``: a logarithmic axis."""
    return bool(values.min() > 0 and values.max() > WIDE * values.min())


def _title(sweep: Sweep) -> str:
    return f"{sweep.scene.name}, {len(sweep.table)} runs"


OUTSIDE, _BEFORE = hexadecimal(palette.OUTSIDE), CHANGING
_WITHOUT_VALUE: dict[str, Any] = {"ls": "", "marker": "x", "color": LEFT_OUT}
NOT_BALANCED: dict[str, Any] = {"ls": "", "marker": "o", "color": "white"}
_BEFORE_DASHES = {AS_IT_IS: "--", NO_PERIOD: ":"}


def drawn_tuning(tuning: Tuning) -> ResultFigure:
    """Return the figure of a tuning: the objective of all candidates over each key."""
    keys, aim = tuning.keys, tuning.task.aim.metric
    columns = min(3, len(keys))
    rows = math.ceil(len(keys) / columns)
    figure = ResultFigure(figsize=(1.2 + 4.2 * columns, 1.4 + 3.2 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    values = tuning.scores.aims * tuning.runs.factor(aim)
    ends = _left_out(tuning)
    for place, (axes, key) in enumerate(zip(panels, keys, strict=False)):
        _tuning_panel(tuning, axes, place, values, ends)
        axes.set_xlabel(_tuning_label(tuning, key, scene_keys(key)[0].meaning), fontsize=9)
        if place % columns == 0:
            axes.set_ylabel(_tuning_label(tuning, aim, _meaning_of(aim)), fontsize=9)
    there = np.concatenate([values, ends])
    there = there[np.isfinite(there)]
    if len(there) and is_wide(there):
        panels[0].set_yscale("log")
    for axes in panels[len(keys) :]:
        axes.set_axis_off()
    task = tuning.task
    bounds = "".join(f", {bound}" for bound in task.bounds)
    of = f", of {100 * task.share:g} % of drives" if task.draws > 1 else ""
    figure.suptitle(f"{tuning.runs.scene.name}: {task.aim}{bounds}{of}", fontsize=11)
    figure.legend(
        handles=_tuning_legend(tuning),
        loc="outside lower center",
        ncols=min(2, columns),
        fontsize=9,
    )
    return figure


def _meaning_of(aim: str) -> str:
    """Return the meaning of a metric, for the title of an axis."""
    (metric,) = metric_columns([aim])
    return metric.meaning if metric.row is None else metric.row.label.replace("{W}", "W/e")


def _tuning_label(tuning: Tuning, name: str, meaning: str) -> str:
    """Return an axis label: the meaning of a key or metric, and below, the name with the unit."""
    return f"{textwrap.fill(re.split('[;:]', meaning)[0], 50)}\n{tuning.runs.titled(name)}"


def _left_out(tuning: Tuning) -> np.ndarray:
    """Return the objective at the end of the run for unsettled candidates; NaN for all others."""
    ends = np.full(len(tuning.candidates), np.nan)
    if tuning.left_out:
        aim = tuning.task.aim.metric
        chosen = np.isin(tuning.runs[OUTCOME].astype(str), list(tuning.left_out))
        ends[chosen] = tuning.runs.shown(aim)[chosen]
    return ends


def _not_balanced(tuning: Tuning) -> np.ndarray:
    """Return a mask of settled candidates that do not balance, all False for random drives."""
    if tuning.task.draws > 1:
        return np.zeros(len(tuning.candidates), bool)
    return np.asarray(tuning.runs[OUTCOME].astype(str) == Verdict.NOT_BALANCED.value)


def _tuning_panel(
    tuning: Tuning, axes: Axes, place: int, values: np.ndarray, ends: np.ndarray
) -> None:
    """Draw the objective of all candidates over one key.

    Parameters
    ----------
    tuning
        The tuning.
    axes
        Axes of the panel.
    place
        Index of the key.
    values
        Objective of each candidate, NaN without a value.
    ends
        Objective at the end of the run for unsettled candidates, see ``_left_out``.
    """
    range_, aim = tuning.task.ranges[place], tuning.task.aim.metric
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
        axes.plot(nothing, np.full(len(nothing), 0.98), transform=edge, **_WITHOUT_VALUE, ms=size)
    for name, before, settled in tuning.before:
        if before is not None and settled:
            axes.axhline(before * tall, color=_BEFORE, lw=1.2, ls=_BEFORE_DASHES[name])
    for name, value, metric, inside in tuning.nearby:
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


def _tuning_legend(tuning: Tuning) -> list[Line2D]:
    """Return legend entries for the kinds of candidates that occur, with counts."""
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
        handles.append(Line2D([], [], **_WITHOUT_VALUE, ms=4, label=text))
    if tuning.candidate is not None:
        handles.append(Line2D([], [], marker="*", ms=12, color=BEST, ls="", label="best"))
        handles.append(
            Line2D([], [], marker="|", ms=11, mew=1.6, color=BEST, ls="", label="5 % next to it")
        )
    for name, _, settled in tuning.before:
        if settled:
            handles.append(
                Line2D([], [], color=_BEFORE, ls=_BEFORE_DASHES[name], label=f"the scene {name}")
            )
    return handles


_MORE, _LESS = hexadecimal(palette.MAIN_DARK), hexadecimal(palette.OPPOSITE)
MOST = 25
"""Largest number of bars in a panel; the keys with the most influence get one."""
SMALL = 1e-6
"""Sensitivity [percent per percent] below which a bar is not drawn."""


def drawn_sensitivities(sensitivities: MetricSensitivities) -> ResultFigure:
    """Return the figure of relative sensitivities, with a panel of bars for each metric."""
    count = len(sensitivities.metrics)
    chosen = [_shown(sensitivities.elasticities[i]) for i in range(count)]
    rows = max([len(keys) for keys in chosen] + [2])
    figure = ResultFigure(figsize=(1.5 + 5.0 * count, 1.4 + 0.26 * rows), layout="constrained")
    for i, axes in enumerate(figure.subplots(1, count, squeeze=False)[0]):
        _bars(sensitivities, i, chosen[i], axes)
    figure.suptitle(f"{sensitivities.scene.name}: percent per percent", fontsize=11)
    return figure


def _shown(elasticities: np.ndarray) -> list[int]:
    """Return the indices of the keys with the most influence, the largest last."""
    sizes = np.nan_to_num(np.abs(elasticities))
    order = [int(k) for k in np.argsort(-sizes, kind="stable") if sizes[k] > SMALL]
    return order[:MOST][::-1]


def _bars(sensitivities: MetricSensitivities, metric: int, keys: list[int], axes: Axes) -> None:
    """Draw a bar per key for a metric; ``metric`` and ``keys`` are indices."""
    values = sensitivities.elasticities[metric, keys]
    colours = [_MORE if value > 0 else _LESS for value in values]
    errors = sensitivities.elasticity_uncertainties[metric, keys]
    axes.barh(range(len(keys)), values, xerr=errors, color=colours, capsize=3)
    axes.set_yticks(range(len(keys)), [sensitivities.keys[k] for k in keys], fontsize=8)
    unit = sensitivities.metric_units[metric]
    named = f"{sensitivities.metric_values[metric]:.4g}" + ("" if unit == "1" else f" {unit}")
    axes.set_title(f"{sensitivities.metrics[metric]} = {named}", fontsize=9)
    axes.axvline(0.0, color="black", lw=0.8)
    axes.grid(axis="x", alpha=0.25)
    if not keys:
        axes.text(0.5, 0.5, "no influence", ha="center", transform=axes.transAxes)
