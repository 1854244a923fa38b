"""Texts of a figure that cover other texts or marks."""

from collections.abc import Iterable, Iterator
from itertools import combinations

from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

SLACK = 1.0
"""Overlap of text boxes that is allowed [px], because boxes are wider than their ink."""


def written(figure: Figure) -> list[tuple[str, Bbox]]:
    """Return each visible text with its box as drawn [px]."""
    figure.draw_without_rendering()
    unseen = set(_beyond(figure))
    found = []
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if text.get_visible() and text.get_text().strip() and id(text) not in unseen:
            # Of a note its text alone, not the arrow to what it notes.
            found.append((text.get_text(), Text.get_window_extent(text)))
    return found


def overlaps(boxes: Iterable[tuple[str, Bbox]]) -> Iterator[tuple[str, str]]:
    """Yield pairs of texts that cover each other."""
    for (name, one), (other_name, other) in combinations(boxes, 2):
        across = min(one.x1, other.x1) - max(one.x0, other.x0)
        up = min(one.y1, other.y1) - max(one.y0, other.y0)
        if across > SLACK and up > SLACK:
            yield name, other_name


def _beyond(figure: Figure) -> Iterator[int]:
    """Yield the ids of tick labels beyond the limits of an axis, which are not drawn."""
    for axis in figure.findobj(Axis):
        assert isinstance(axis, Axis)
        low, high = sorted(axis.get_view_interval())
        room = 1e-6 * (high - low)
        for tick in (*axis.majorTicks, *axis.minorTicks):
            if not low - room <= tick.get_loc() <= high + room:
                yield from (id(tick.label1), id(tick.label2))
