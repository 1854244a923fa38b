"""Picture of a recording, a simulation and the difference."""

import math
import textwrap
from pathlib import Path

from matplotlib.axes import Axes

from ab_sim.drive.trajectory import is_ball_angle
from ab_sim.show.figures.colours import GREY, RUN, VERMILION
from ab_sim.show.figures.curves import in_degrees, say_conventions
from ab_sim.show.figures.saved import ResultFigure, save
from ab_sim.show.reports.compare import ChannelDeviation, RecordingComparison

MOST = 6
"""Largest number of drawn channels, the most important ones first."""
FIRST = ("speed", "x", "y", "ball_0_angle", "ball_1_angle", "motor_torque", "ax", "ay")


def compare_picture(comparison: RecordingComparison, recording: str, path: Path) -> None:
    """Draw recorded and simulated channels, each with the difference.

    Args:
        comparison: comparison to draw.
        recording: name of the recording, for the title.
        path: file to write; its ending sets the format (png, svg, pdf).
    """
    save(_drawn(comparison, recording), path, 110)


def drawn_comparison(comparison: RecordingComparison) -> ResultFigure:
    """Return the figure of a comparison without writing it, for ``plot()``."""
    return _drawn(comparison, "the recording")


def _drawn(comparison: RecordingComparison, recording: str) -> ResultFigure:
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
        _draw(left, right, comparison, deviation)
    panels[0][0].set_title("recorded and simulated", fontsize=10)
    panels[0][1].set_title("simulated - recorded", fontsize=10)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    figure.legend(*panels[0][0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    figure.align_ylabels(panels[:, 0])
    say_conventions(figure, left_out)
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
    return FIRST.index(deviation.channel) if deviation.channel in FIRST else len(FIRST)


def _draw(
    left: Axes, right: Axes, comparison: RecordingComparison, deviation: ChannelDeviation
) -> None:
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
        beside = "" if share is None else f" ({100 * share:.2g} % of the range)"
        text = f"largest {factor * deviation.largest:.3g}{unit}{beside} at {deviation.at:.4g} s"
        # Leave room above the curve for the text.
        low, high = right.get_ylim()
        right.set_ylim(low, high + 0.25 * (high - low))
    right.text(0.01, 0.97, text, transform=right.transAxes, va="top", fontsize=8)
    for axes in (left, right):
        axes.grid(alpha=0.3)
