"""Pictures of costs: of an accuracy, and of the effects of a scene."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from ab_sim.analysis.accuracy_cost import AccuracyCost, ErrorBound, SettingCost
from ab_sim.analysis.effect_cost import ALL, BASE, EffectCost
from ab_sim.show.saved import ResultFigure
from ab_sim.show.styles import distinct_colours

OURS = ("tab:red", "tab:orange", "tab:purple", "tab:brown", "tab:pink", "tab:olive")
PEERS = ("tab:blue", "tab:cyan", "tab:green", "tab:gray", "black", "navy", "teal")
"""Colours of the first methods; further ones have distinct colours."""
_MARKERS = "osD^vP*X"
_REAL_TIME = 1.0
"""CPU seconds per simulated second at which one core just runs in real time."""


def drawn_accuracy(cost: AccuracyCost) -> ResultFigure:
    """Return the figure of errors of ball angle and whirl over CPU time, on logarithmic axes.

    Filled marks and solid lines stand for this package's steppers, hollow marks and dashed lines
    for other programs.

    Parameters
    ----------
    cost
        Measured costs.
    """
    unit = cost.unit
    panels = [("whirl", f"largest error in whirl [{unit}]", cost.uncertainty.whirl)]
    if cost.balls:
        text = "largest error in ball angle [rad]"
        panels.insert(0, ("angle", text, cost.uncertainty.angle))
    figure = ResultFigure(figsize=(6.2 * len(panels) + 1.8, 6), layout="constrained")
    axes = figure.subplots(1, len(panels), squeeze=False, sharex=True)
    for panel, (key, text, uncertainty) in zip(axes[0], panels, strict=True):
        _accuracy_panel(panel, cost, key, text, uncertainty)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", fontsize=9, frameon=False)
    balls = f"{cost.balls} ball{'' if cost.balls == 1 else 's'}"
    effects = ", ".join(cost.effects) or "no effects"
    figure.suptitle(
        f"{cost.scene}: {balls}, {cost.duration:g} s, {effects}\ndown and left is better",
        fontsize=11,
    )
    return figure


def _accuracy_panel(
    axes: Axes, cost: AccuracyCost, key: str, text: str, uncertainty: float
) -> None:
    """Draw the errors of one quantity over CPU time, a curve for each method.

    Parameters
    ----------
    axes
        Axes of the panel.
    cost
        Measured costs.
    key
        Quantity, ``angle`` or ``whirl``.
    text
        Title of the vertical axis.
    uncertainty
        Uncertainty of the reference, in the unit of the errors.
    """
    methods: dict[str, list[SettingCost]] = {}
    for row in cost.rows:
        if row.errors is not None and row.cpu is not None:
            methods.setdefault(row.method, []).append(row)
    values: list[float] = []
    labels: list[tuple[str, float, float, str]] = []
    front = cost.front()
    ours = iter(distinct_colours(max(len(OURS), len(methods)), OURS, avoid=PEERS))
    peers = iter(distinct_colours(max(len(PEERS), len(methods)), PEERS, avoid=OURS))
    for at, (name, rows) in enumerate(methods.items()):
        rows = sorted(rows, key=lambda row: row.step or row.tolerance or 0.0)
        times = [row.cpu.median for row in rows if row.cpu]
        bounds = [getattr(row.errors, key) for row in rows]
        errors = [_drawable(bound) for bound in bounds]
        values += errors
        peer = rows[0].peer
        colour = next(peers if peer else ours)
        marker = _MARKERS[at % len(_MARKERS)]
        axes.plot(
            times, errors, color=colour, marker=marker, markersize=5 if peer else 7,
            linestyle="--" if peer else "-", linewidth=1.0 if peer else 2.2,
            fillstyle="none" if peer else "full", alpha=0.8 if peer else 1.0,
            label=name if peer else f"{name} (ab_sim)", zorder=2 if peer else 3,
        )  # fmt: skip
        if not peer:
            labels += [
                (row.setting, time, error, colour)
                for row, time, error in zip(rows, times, errors, strict=True)
                if row in front
            ]
    axes.set_xscale("log")
    axes.set_yscale("log")
    if values:
        axes.set_ylim(max(min(values), 1e-18) / 8, max(max(values), uncertainty) * 5)
    low, high = axes.get_xlim()
    axes.set_xlim(low / 2, max(high, 3 * _REAL_TIME))
    axes.axvline(_REAL_TIME, color="black", linewidth=1.2)
    axes.text(
        _REAL_TIME / 1.08, 0.985, "real time on one core", rotation=90, ha="right", va="top",
        fontsize=9, transform=axes.get_xaxis_transform(),
    )  # fmt: skip
    _label_settings(axes, labels)
    bottom = axes.get_ylim()[0]
    if uncertainty > bottom:
        axes.axhspan(bottom, uncertainty, color="0.88", zorder=0)
        axes.text(
            0.98, uncertainty / 1.2, f"uncertainty of the reference: {uncertainty:.0e}",
            transform=axes.get_yaxis_transform(), ha="right", va="top", fontsize=8, color="0.3",
        )  # fmt: skip
    axes.set_xlabel("CPU seconds per simulated second = share of one core in real time")
    axes.set_ylabel(text)
    axes.grid(which="major", alpha=0.3)


def _label_settings(axes: Axes, labels: list[tuple[str, float, float, str]]) -> None:
    """Write a label left of each mark, unless it would cover a mark or another label."""
    within = axes.transData + axes.transAxes.inverted()
    marks = np.vstack([within.transform(line.get_xydata()) for line in axes.lines[:-1]])
    written: list[tuple[float, float]] = []
    for text, time, error, colour in labels:
        at = within.transform((time, error))
        covers = (np.abs(marks - at + [0.06, 0.0]) < [0.045, 0.03]).all(axis=1).any()
        if covers or any(abs(at[0] - x) < 0.09 and abs(at[1] - y) < 0.035 for x, y in written):
            continue
        written.append((at[0], at[1]))
        axes.annotate(
            text, (time, error), xytext=(-7, -2), textcoords="offset points", fontsize=8,
            ha="right", va="center", color=colour, zorder=5,
            path_effects=[withStroke(linewidth=3, foreground="white")],
        )  # fmt: skip


def _drawable(bound: ErrorBound) -> float:
    """Return the error for a logarithmic axis, at least the rounding error of a double."""
    return max(bound.value, 1e-17)


_VARIANT_COLOURS = {BASE: "tab:gray", ALL: "tab:red"}


def drawn_cost(costs: list[EffectCost]) -> ResultFigure:
    """Return the figure of the time per step of every variant, with one panel per scene.

    Parameters
    ----------
    costs
        Measured costs.
    """
    heights = [1.2 + 0.34 * len(cost.rows) for cost in costs]
    figure = ResultFigure(figsize=(9, sum(heights)), layout="constrained")
    panels = figure.subplots(len(costs), 1, squeeze=False, height_ratios=heights)
    for axes, cost in zip(panels[:, 0], costs, strict=True):
        _cost_panel(axes, cost)
    panels[-1, 0].set_xlabel("time per step [µs]: median, and quartiles of interleaved repeats")
    return figure


def _cost_panel(axes: Axes, cost: EffectCost) -> None:
    """Draw a bar per variant of a scene: the median time per step, with quartiles."""
    most = max(row.ns_per_step.upper for row in cost.rows if row.ns_per_step)
    for at, row in enumerate(cost.rows):
        if row.ns_per_step is None or row.ratio is None:
            axes.text(0, at, " cannot run", va="center", fontsize=8)
            continue
        time = row.ns_per_step
        spread = [[1e-3 * (time.median - time.lower)], [1e-3 * (time.upper - time.median)]]
        axes.barh(
            at,
            1e-3 * time.median,
            xerr=spread,
            color=_VARIANT_COLOURS.get(row.name, "tab:blue"),
            alpha=0.8,
            capsize=3,
        )
        axes.text(
            1e-3 * (time.upper + 0.01 * most),
            at,
            f" {1e-3 * time.median:.2f} µs, {row.ratio.median:.2f}x",
            va="center",
            fontsize=8,
        )
    names = [row.name + "".join(f"\n+ {name}" for name in row.added) for row in cost.rows]
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0, 1.2e-3 * most)
    balls = f"{cost.balls} ball{'' if cost.balls == 1 else 's'}"
    axes.set_title(f"{cost.scene}: {balls}, {cost.stepper}, step {cost.step:g} s", fontsize=11)
    axes.grid(axis="x", alpha=0.3)
