"""Adaptive start-up in a run's picture: dwells, and the estimated unbalance."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from ab_sim.analysis.startup import AdaptiveOutcome, net_unbalance
from ab_sim.control import State
from ab_sim.drive.controllers import EstimatesAt
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene
from ab_sim.show.curves import draw_curve
from ab_sim.show.labels import Label, label_at_right
from ab_sim.show.styles import GREEN, ORANGE, PURPLE, RUN, SKY, VERMILION

_SHADES = {
    State.DWELL: SKY,
    State.RETRY: ORANGE,
    State.ABORTING: VERMILION,
}
"""Controller states that are shaded over time, each with the colour."""
ENDS = {State.DONE: GREEN, State.GAVE_UP: PURPLE, State.ABORTED: VERMILION}
"""Final states of the controller, each with the colour of the line that marks its time."""
WIDTH = 0.011
"""Largest width of a letter of the states' labels, relative to the panels' width."""
_TRUE, _ESTIMATED = RUN, "black"


class Stretch(NamedTuple):
    """Period in which the controller stays in one state."""

    state: State
    begin: float
    """Start [s]."""
    end: float
    """End [s]."""


def stretches(history: Sequence[EstimatesAt]) -> Iterator[Stretch]:
    """Yield the time spans of the controller's successive states, from estimates over time."""
    begin = 0
    for k, estimates in enumerate(history):
        last = k + 1 == len(history)
        if last or history[k + 1].state is not estimates.state:
            yield Stretch(estimates.state, history[begin].time, history[k + (not last)].time)
            begin = k + 1


def mark_states(panels: Sequence[Axes], adaptive: AdaptiveOutcome) -> None:
    """Shade dwells, retries and ramps down in all panels, and mark the end of the start-up.

    Names are in the first panel, in several rows if they would overlap.
    """
    counts: Counter[State] = Counter()
    rows: list[float] = []
    low, high = panels[0].get_xlim()
    for stretch in stretches(adaptive.history):
        state, text = stretch.state, stretch.state.text
        color = _SHADES.get(state) or ENDS.get(state)
        if color is None:
            continue
        for axes in panels:
            if state in ENDS:
                axes.axvline(stretch.begin, color=color, lw=1.0)
            else:
                axes.axvspan(stretch.begin, stretch.end, color=color, alpha=0.12, lw=0)
        if state in (State.DWELL, State.RETRY):
            counts[state] += 1
            text += f" {counts[state]}"
        at, width = (stretch.begin - low) / (high - low), WIDTH * len(text)
        at_right = at + width > 1.0
        row = _free_row(rows, at - width if at_right else at, width)
        panels[0].annotate(
            text,
            (stretch.begin, 0),
            xycoords=("data", "axes fraction"),
            xytext=(-2 if at_right else 2, 5 + 10 * row),
            textcoords="offset points",
            ha="right" if at_right else "left",
            fontsize=8,
            color=color,
        )


def _free_row(rows: list[float], begin: float, width: float) -> int:
    """Return the lowest free row of labels; ``rows`` has the end of the last label in each."""
    row = next((row for row, end in enumerate(rows) if end <= begin), len(rows))
    rows[row : row + 1] = [begin + width]
    return row


def draw_unbalance(axes: Axes, path: Trajectory, scene: Scene, adaptive: AdaptiveOutcome) -> None:
    """Draw the true net unbalance, and the estimate with its standard deviation.

    Parameters
    ----------
    axes
        Axes of this panel only.
    path
        Samples of the run.
    scene
        Scene of the run.
    adaptive
        Outcome of the controller.
    """
    length, symbol = scene.whirl_unit
    times = np.array([estimates.time for estimates in adaptive.history])
    values = np.array([estimates.net_unbalance for estimates in adaptive.history]) / length
    spread = np.array([b.net_unbalance_deviation for b in adaptive.history]) / length
    true = net_unbalance(path, scene) / length
    draw_curve(axes, path["time"], true, color=_TRUE, lw=1.3, zorder=3)
    labels = [Label(true[-1], f"{true[-1]:.3g}  true", _TRUE)]
    finite = np.isfinite(values)
    if finite.any():
        axes.plot(times, values, color=_ESTIMATED, lw=1.0, zorder=4)
        low, high = np.maximum(values - spread, 0.0), values + spread
        axes.fill_between(times, low, high, color=_ESTIMATED, alpha=0.15, lw=0, zorder=2)
        last = values[finite][-1]
        labels.append(Label(last, f"{last:.3g}  estimated,\n+- a standard deviation", _ESTIMATED))
    # The first estimates may be far off.
    axes.set_ylim(0.0, 1.3 * max(true.max(), 1e-9))
    axes.set_ylabel(f"net unbalance / {symbol} [1]")
    label_at_right(axes, labels)
