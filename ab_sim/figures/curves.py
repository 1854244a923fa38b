"""Parts of pictures: curves that stay readable where they swing fast, and labels beside them."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from ab_sim.conventions import NOTATION

WINDOW = 0.01
"""Share of the time axis in which swings are counted."""
SWINGS = 3.3
"""With so many turning points in a window, swings run into each other: their range is shown."""
VISIBLE = 1e-4
"""Smaller swings than this share of the largest value are none."""
LINE = 0.15
"""Height of a line of a label [in]."""


def draw_curve(axes: Axes, time: np.ndarray, values: np.ndarray, **style: Any) -> None:
    """Draw a curve; where it swings too fast to be seen, the range of its swings and their mean.

    Args:
        axes: where.
        time: shape (samples,).
        values: shape (samples,).
        style: as of ``Axes.plot``, with a color.
    """
    width = max(3, round(WINDOW * len(time)))
    # Counted over some windows, so that it does not change from one to the next.
    fast = uniform_filter1d(_turns(values), 5 * width, mode="reflect") * width >= SWINGS
    if fast.any():
        # Both ways over by a window, so that range and curve meet.
        blurred = maximum_filter1d(fast, width)
        low = minimum_filter1d(values, width, mode="nearest")
        high = maximum_filter1d(values, width, mode="nearest")
        mean = uniform_filter1d(uniform_filter1d(values, width, mode="nearest"), width)
        axes.fill_between(
            time, low, high, where=blurred, color=style["color"], alpha=0.25, lw=0,
            zorder=style.get("zorder", 2),
        )  # fmt: skip
        values = np.where(fast, mean, values)
    axes.plot(time, values, **style)


def _turns(values: np.ndarray) -> np.ndarray:
    """1 at each turning point of swings that can be seen, else 0; shape (samples,)."""
    points = 1 + np.flatnonzero(np.diff(np.sign(np.diff(values))))
    swings = np.abs(np.diff(values[points])) > VISIBLE * np.max(np.abs(values))
    turns = np.zeros(len(values))
    turns[points[1:-1]] = swings[1:] & swings[:-1]
    return turns


def say_conventions(figure: Figure) -> None:
    """Name the page that explains symbols and signs, below all panels."""
    figure.supxlabel(NOTATION, fontsize=8, color="0.4")


class Label(NamedTuple):
    """A text at the right edge of a panel."""

    value: float
    """Where, on the vertical axis."""
    text: str
    color: str = "black"


def label_at_right(axes: Axes, labels: Sequence[Label], away: float = 5.0) -> None:
    """Write texts beside a panel, at their values, moved apart where they would overlap.

    Args:
        axes: with its limits and scale as they stay.
        labels: those beyond the limits are written at the nearest edge.
        away: how far from the panel [pt].
    """
    axes.get_ylim()  # limits that follow the curves are worked out only when asked for
    to_axes = axes.transData + axes.transAxes.inverted()
    wanted = [float(to_axes.transform((0.0, label.value))[1]) for label in labels]
    figure, spec = axes.figure, axes.get_subplotspec()
    assert isinstance(figure, Figure) and spec is not None
    line = LINE / (spec.get_position(figure).height * figure.get_figheight())
    order = np.argsort(wanted)
    heights = [line * (1 + labels[i].text.count("\n")) for i in order]
    spread = _spread([min(max(wanted[i], 0.0), 1.0) for i in order], heights)
    for i, y in zip(order, spread, strict=True):
        axes.annotate(
            labels[i].text, (1.0, y), xycoords="axes fraction", xytext=(away, 0),
            textcoords="offset points", va="center", fontsize=8, color=labels[i].color,
        )  # fmt: skip


def _spread(wanted: Sequence[float], heights: Sequence[float]) -> list[float]:
    """Wanted centres, rising, moved as little as need be until intervals so high are apart."""
    # Neighbours that overlap form a block, which is centred where its members would like to be.
    blocks: list[tuple[list[float], list[float]]] = []
    for y, height in zip(wanted, heights, strict=True):
        blocks.append(([y], [height]))
        while len(blocks) > 1 and _bottom(blocks[-1]) < _bottom(blocks[-2]) + sum(blocks[-2][1]):
            upper, lower = blocks.pop(), blocks.pop()
            blocks.append((lower[0] + upper[0], lower[1] + upper[1]))
    result = []
    for block in blocks:
        bottom = _bottom(block)
        for height in block[1]:
            result.append(bottom + height / 2)
            bottom += height
    return result


def _bottom(block: tuple[list[float], list[float]]) -> float:
    wanted, heights = block
    return sum(wanted) / len(wanted) - sum(heights) / 2
