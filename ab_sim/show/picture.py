"""Pictures of reports: runs side by side, and a recording with its simulation."""

import math
import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ab_sim.drive.trajectory import is_ball_angle
from ab_sim.show.compare import ChannelDeviation, RecordingComparison
from ab_sim.show.curves import in_degrees, write_conventions
from ab_sim.show.panels import Grid, Panel
from ab_sim.show.saved import ResultFigure
from ab_sim.show.styles import GREY, MAP, RUN, VERMILION

_MOST_NAMES = 8
"""Largest number of curves with a legend."""
_BAR = (1.02, 0.0, 0.03, 1.0)
"""Left, bottom, width and height of a colour bar, as fractions of the panel next to it."""


def drawn_report(grid: Grid) -> ResultFigure:
    """Return the figure of runs side by side: a column for each run, a row for each kind of panel.

    Parameters
    ----------
    grid
        Panels to show.
    """
    heights = [max(p.height for p in row if p) for row in grid.rows]
    columns = len(grid.names)
    size = 1.5 + 7.5 * columns, 0.8 + 2.9 * sum(heights)
    figure = ResultFigure(figsize=size, layout="constrained")
    axes = figure.subplots(len(heights), columns, squeeze=False, height_ratios=heights)
    for at, name in enumerate(grid.names):
        axes[0][at].annotate(
            name, (0.5, 1.0), xycoords="axes fraction", xytext=(0, 26), fontsize=13,
            textcoords="offset points", ha="center", fontweight="bold", annotation_clip=False,
        )  # fmt: skip
    for row, panels in enumerate(grid.rows):
        for column, panel in enumerate(panels):
            if panel is None:
                axes[row][column].set_axis_off()
            else:
                draw_panel(figure, axes[row][column], panel)
    write_conventions(figure)
    return figure


def draw_panel(figure: Figure, axes: Axes, panel: Panel) -> None:
    """Draw a panel on axes of a figure, with colour bars and a legend next to them."""
    axes.set_title(panel.title, fontsize=10)
    axes.set_xlabel(panel.across)
    axes.set_ylabel(panel.up)
    if panel.note:
        axes.text(0.5, 0.5, panel.note, transform=axes.transAxes, ha="center", color=GREY)
        axes.set_xticks([])
        axes.set_yticks([])
        return
    if panel.heat is not None:
        drawn = axes.pcolormesh(
            panel.heat.x, panel.heat.y, np.ma.masked_invalid(panel.heat.values), cmap=MAP,
            shading="nearest", rasterized=True,
        )  # fmt: skip
        figure.colorbar(drawn, cax=axes.inset_axes(_BAR), label=panel.heat.label)
    if panel.cloud is not None:
        axes.plot(panel.cloud.x, panel.cloud.y, color="0.85", lw=0.4, zorder=1)
        dots = axes.scatter(
            panel.cloud.x, panel.cloud.y, c=panel.cloud.time, s=4, cmap=MAP, lw=0, zorder=2
        )
        figure.colorbar(dots, cax=axes.inset_axes(_BAR), label="time [s]")
    for curve in panel.curves:
        axes.plot(
            curve.x, curve.y, color=curve.colour, lw=curve.width, label=curve.name,
            dashes=curve.dashes,
        )  # fmt: skip
    for at, (value, name) in enumerate(panel.levels):
        axes.axhline(value, color=GREY, lw=1.0, ls=":", label=name if at == 0 else None)
    if panel.log:
        axes.set_yscale("log")
    if panel.equal:
        axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(*panel.limits[0])
    axes.set_ylim(*panel.limits[1])
    axes.grid(alpha=0.3)
    if 1 < len(panel.curves) + bool(panel.levels) <= _MOST_NAMES + 1:
        # Next to the panel, where it covers no curve; a map has its colour bar there.
        outside = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0}
        axes.legend(fontsize=8, **(outside if panel.heat is None else {"loc": "lower right"}))


MOST = 6
"""Largest number of drawn channels, the most important ones first."""
FIRST = ("speed", "x", "y", "ball_0_angle", "ball_1_angle", "motor_torque", "ax", "ay")
"""Channels to draw first, in this order; all others follow."""


def drawn_comparison(
    comparison: RecordingComparison, recording: str = "the recording"
) -> ResultFigure:
    """Return the figure of recorded and simulated channels, each with the difference.

    Parameters
    ----------
    comparison
        Comparison to draw.
    recording
        Name of the recording, for the title.
    """
    deviations = sorted(comparison.deviations, key=_place)[:MOST]
    left_out = _left_out(comparison, deviations)
    lines = 1 + left_out.count("\n")
    figure = ResultFigure(
        figsize=(13, 1.2 + 0.17 * lines + 2.1 * len(deviations)), layout="constrained"
    )
    panels = figure.subplots(len(deviations), 2, sharex=True, squeeze=False)
    verdict = "the same to the bit" if comparison.same else f"driven by {comparison.driven_by}"
    figure.suptitle(f"{recording} and {comparison.scene.name}: {verdict}", fontsize=13)
    for (left, right), deviation in zip(panels, deviations, strict=True):
        _draw_channel(left, right, comparison, deviation)
    panels[0][0].set_title("recorded and simulated", fontsize=10)
    panels[0][1].set_title("simulated - recorded", fontsize=10)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    figure.legend(*panels[0][0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    figure.align_ylabels(panels[:, 0])
    write_conventions(figure, left_out)
    return figure


def _left_out(comparison: RecordingComparison, deviations: list[ChannelDeviation]) -> str:
    """Return lines of text on channels that the picture does not show, with reasons."""
    names = ", ".join(
        deviation.channel for deviation in comparison.deviations if deviation not in deviations
    )
    lines = [f"Compared, not drawn: {names}."] if names else []
    lines += [
        f"Not compared, {reason}: {', '.join(channels)}."
        for reason, channels in comparison.not_compared.items()
    ]
    return "\n".join(textwrap.fill(text, 170) for text in lines)


def _place(deviation: ChannelDeviation) -> int:
    """Return the rank of a channel in the order of ``FIRST``."""
    return FIRST.index(deviation.channel) if deviation.channel in FIRST else len(FIRST)


def _draw_channel(
    left: Axes, right: Axes, comparison: RecordingComparison, deviation: ChannelDeviation
) -> None:
    """Draw a channel, recorded and simulated, on the left axes, and the deviation on the right."""
    name, turned = deviation.channel, is_ball_angle(deviation.channel)
    # As in other pictures, angles are in degrees, within one turn.
    unit = " [deg]" if turned else "" if deviation.unit is None else f" [{deviation.unit}]"
    factor = math.degrees(1.0) if turned else 1.0
    for envelope, color, width, label in (
        (comparison.recorded, GREY, 3.0, "recorded"),
        (comparison.simulated, RUN, 0.9, "simulated"),
    ):
        time, values = envelope.curve(name)
        converted = in_degrees(values) if turned else values
        left.plot(time, converted, color=color, lw=width, label=label)
    left.set_ylabel(f"{name}{unit}")
    time, values = comparison.differences.curve(name)
    right.plot(time, factor * values, color=VERMILION, lw=1.0)
    if deviation.same:
        right.set_ylim(-1.0, 1.0)
        right.set_yticks([0.0])
        text = "0, to the bit"
    elif deviation.compared == 0:
        text = "nothing to compare: not finite"
    else:
        share = deviation.relative(deviation.largest)
        of_range = "" if share is None else f" ({100 * share:.2g} % of the range)"
        text = f"largest {factor * deviation.largest:.3g}{unit}{of_range} at {deviation.at:.4g} s"
        # Leave room above the curve for the text.
        low, high = right.get_ylim()
        right.set_ylim(low, high + 0.25 * (high - low))
    right.text(0.01, 0.97, text, transform=right.transAxes, va="top", fontsize=8)
    for axes in (left, right):
        axes.grid(alpha=0.3)
