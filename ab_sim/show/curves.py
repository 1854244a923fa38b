"""Parts of pictures: curves that stay readable with fast swings, and a note on symbols."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from ab_sim.base.presentation import NOTATION, in_one_turn

WINDOW = 0.01
"""Width of the window in which swings are counted, as a fraction of the time axis."""
_SWINGS = 3.3
"""Number of turning points in a window from which on the range of swings is drawn."""
_VISIBLE = 1e-4
"""Smallest visible swing, relative to the largest value."""


def draw_curve(axes: Axes, time: np.ndarray, values: np.ndarray, **style: Any) -> None:
    """Draw a curve; for swings too fast to be seen, draw their range and mean.

    Parameters
    ----------
    axes
        Axes to draw on.
    time
        Times of the samples [s], shape (samples,).
    values
        Values of the curve, shape (samples,).
    style
        Keywords of ``Axes.plot``, including color.
    """
    width = max(3, round(WINDOW * len(time)))
    # Counted over several windows, so that the result does not alternate between windows.
    fast = uniform_filter1d(_turns(values), 5 * width, mode="reflect") * width >= _SWINGS
    if fast.any():
        # The range extends half a window beyond the fast part, so that it meets the curve.
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
    """Return 1 at each extremum between swings large enough to see, else 0; shape (samples,)."""
    points = 1 + np.flatnonzero(np.diff(np.sign(np.diff(values))))
    swings = np.abs(np.diff(values[points])) > _VISIBLE * np.max(np.abs(values))
    turns = np.zeros(len(values))
    turns[points[1:-1]] = swings[1:] & swings[:-1]
    return turns


def in_degrees(angles: np.ndarray) -> np.ndarray:
    """Return ball angles in degrees, reduced to the drawn turn.

    NaN interrupts the curve where a ball leaves the turn and enters it at the other end.

    Parameters
    ----------
    angles
        Unwrapped ball angles [rad], shape (samples,) or (samples, balls).
    """
    degrees = np.degrees(in_one_turn(angles))
    degrees[1:][np.abs(np.diff(degrees, axis=0)) > 180.0] = np.nan
    return degrees


def write_conventions(figure: Figure, text: str = "") -> None:
    """Write a text below all panels, with a reference to the page on symbols and signs."""
    figure.supxlabel("\n".join(filter(None, (text, NOTATION))), fontsize=8, color="0.4")
