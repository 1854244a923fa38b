"""Labels at the right of a panel, each as close to its curve as the other labels allow."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

APART = 1.0
"""Distance between labels [pt]."""


class Label(NamedTuple):
    """Text at the right edge of a panel."""

    value: float
    """Position on the vertical axis."""
    text: str
    color: str = "black"


def label_at_right(axes: Axes, labels: Sequence[Label], away: float = 5.0) -> None:
    """Write labels at the right of a panel, at the labels' values; move apart overlapping ones.

    Labels of values beyond the panel's limits are at the nearest edge. If there is not enough room,
    the last labels are replaced by their number.

    Parameters
    ----------
    axes
        Axes of the panel; limits and size may change until it is drawn.
    labels
        Labels, the most important ones first.
    away
        Distance from the panel [pt].
    """
    if labels:
        _LabelsAtRight(axes, labels, away)


class _LabelsAtRight(Artist):
    """Artist that places labels when the panel is drawn and the layout is known."""

    def __init__(self, axes: Axes, labels: Sequence[Label], away: float) -> None:
        super().__init__()
        self.set_zorder(-1.0)  # drawn before the texts
        # Not clipped, so that the layout queries its size before that of the texts.
        axes.add_artist(self)
        self.set_clip_on(False)
        self._values = [label.value for label in labels]
        left_out = Label(-np.inf, "", "0.45")
        *self._texts, self._left_out = (
            axes.annotate(
                label.text, (1.0, 0.5), xycoords="axes fraction", xytext=(away, 0),
                textcoords="offset points", va="center", fontsize=8, color=label.color,
            )
            for label in (*labels, left_out)
        )  # fmt: skip

    def draw(self, renderer: Any) -> None:
        """Move the texts, which then draw themselves."""
        self._place(renderer)

    def get_tightbbox(self, renderer: Any = None) -> None:
        """Place the texts and return no extent: the layout queries this artist before the texts."""
        self._place(renderer)

    def _place(self, renderer: Any) -> None:
        """Move the texts apart for the panel's present size; hide the last ones without room."""
        assert self.axes is not None
        panel = self.axes.get_window_extent(renderer)
        texts, values = [*self._texts], [*self._values]
        for text in texts:
            text.set_visible(True)
        gap = self.axes.figure.dpi * APART / 72.0
        heights = [text.get_window_extent(renderer).height + gap for text in texts]
        self._left_out.set_text("")
        if sum(heights) > panel.height:
            line = min(heights)
            while heights and sum(heights) + line > panel.height:
                texts.pop().set_visible(False)
                heights.pop()
            self._left_out.set_text(f"and {len(self._texts) - len(texts)} more")
            texts.append(self._left_out)
            values[len(heights) :] = [-np.inf]  # below all others
            heights.append(line)
        low, high = sorted(self.axes.get_ylim())
        within = np.clip(values, low, high)
        wanted = self.axes.transData.transform([(0.0, value) for value in within])[:, 1] - panel.y0
        if texts[-1] is self._left_out:
            wanted[-1] = -np.inf
        order = np.argsort(wanted, kind="stable")
        wanted = np.clip(wanted, 0.0, panel.height)
        places = spread(wanted[order].tolist(), [heights[i] for i in order], panel.height)
        for i, place in zip(order, places, strict=True):
            texts[i].xy = (1.0, place / panel.height)


def spread(wanted: Sequence[float], heights: Sequence[float], top: float) -> list[float]:
    """Return increasing centres, moved as little as possible until the intervals do not overlap.

    Parameters
    ----------
    wanted
        Desired centres, increasing.
    heights
        Heights of the intervals, together at most ``top``.
    top
        Upper limit of the intervals; the lower limit is 0.
    """
    # Overlapping neighbours form a block, which is centred on its members' desired centres and may
    # then overlap the next block ("pool adjacent violators", as in isotonic regression).
    blocks: list[tuple[list[float], list[float]]] = []
    for y, height in zip(wanted, heights, strict=True):
        blocks.append(([y], [height]))
        while len(blocks) > 1:
            (_, below), lowest = blocks[-2], _bottom(blocks[-2], top)
            if _bottom(blocks[-1], top) >= lowest + sum(below):
                break
            upper, lower = blocks.pop(), blocks.pop()
            blocks.append((lower[0] + upper[0], lower[1] + upper[1]))
    result = []
    for block in blocks:
        bottom = _bottom(block, top)
        for height in block[1]:
            result.append(bottom + height / 2)
            bottom += height
    return result


def _bottom(block: tuple[list[float], list[float]], top: float) -> float:
    """Return the lower end of a block of labels (desired centres, heights) at its best place.

    The best place within the limits has the least sum of squared moves.
    """
    wanted, heights = block
    # Desired centre of each, less the part of the block below that centre.
    below = np.cumsum(heights) - 0.5 * np.asarray(heights)
    return float(np.clip(np.mean(np.asarray(wanted) - below), 0.0, max(top - sum(heights), 0.0)))
