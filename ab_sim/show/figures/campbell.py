"""Campbell diagram: natural frequencies and damping over the spindle's speed."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ab_sim.analysis.modes import AVERAGE, Mode, NaturalVibration, moving
from ab_sim.show.figures.labels import Label, label_at_right
from ab_sim.show.figures.saved import ResultFigure, save

STYLES: dict[str | None, dict[str, Any]] = {
    "forward": {"color": "tab:red", "ls": "-", "lw": 1.6, "zorder": 2.1},
    "backward": {"color": "tab:blue", "ls": (0, (4, 3)), "lw": 1.6, "zorder": 2.2},
    None: {"color": "0.4", "ls": "-", "lw": 1.6, "zorder": 2.0},
}
"""Styles by the sense of whirl; one is dashed, so that both are visible where they coincide."""
ONCE: dict[str, Any] = {"color": "tab:green", "ls": ":", "lw": 1.2}
RPM = 30.0 / math.pi


def campbell_figure(vibration: NaturalVibration, path: Path) -> None:
    """Draw frequencies and damping ratios over speed, and write them to a file.

    Args:
        vibration: natural vibration of a scene over the speed.
        path: file to write; its ending sets the format (png, svg, pdf).
    """
    save(drawn_campbell(vibration), path, 110)


def drawn_campbell(vibration: NaturalVibration) -> ResultFigure:
    """Return the figure of ``campbell_figure`` without writing it; arguments as there."""
    figure = ResultFigure(figsize=(9, 6.5), layout="constrained")
    figure.suptitle(f"Natural frequencies of {vibration.scene}", fontsize=14)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 0.4))
    speeds, branches = vibration.over_speed.speeds, vibration.over_speed.branches
    for branch in branches:
        _draw(above, speeds, branch, [mode.frequency for mode in branch])
        ratios = [mode.damping_ratio for mode in branch]
        _draw(below, speeds, branch, [math.nan if ratio is None else ratio for ratio in ratios])
    above.plot(speeds, speeds, **ONCE)
    for speed, mode in vibration.over_speed.critical:
        above.plot(speed, speed, "o", color=STYLES[mode.sense]["color"], mec="k", ms=5, zorder=4)
    most = max(mode.frequency for branch in branches for mode in branch)
    above.set_ylim(0, 1.1 * most if most > 0 else speeds[-1])
    above.set_xlim(0, speeds[-1])
    above.set_ylabel("frequency [rad/s]")
    below.set_ylabel("damping ratio [1]")
    below.set_xlabel("spindle speed [rad/s]")
    below.set_ylim(min(0.0, below.get_ylim()[0]), 1.1 * below.get_ylim()[1])
    above.secondary_xaxis("top", functions=(_times(RPM), _times(1.0 / RPM))).set_xlabel(
        "spindle speed [1/min]"
    )
    turn = 2.0 * math.pi
    above.secondary_yaxis("right", functions=(_times(1 / turn), _times(turn))).set_ylabel("[Hz]")
    for axes in (above, below):
        axes.grid(alpha=0.3)
    last = [branch[-1] for branch in branches]
    label_at_right(above, [_label(vibration, mode) for mode in last], away=50.0)
    above.legend(handles=_legend(vibration), loc="lower right", fontsize=8)
    figure.supxlabel(AVERAGE, fontsize=8, color="0.4")
    return figure


def _draw(axes: Axes, speeds: np.ndarray, branch: tuple[Mode, ...], values: list[float]) -> None:
    """Draw a curve whose style shows the deck's direction of whirl."""
    senses = [mode.sense for mode in branch]
    for sense, style in STYLES.items():
        # Each section is extended to the next point, where another may begin.
        here = np.array([sense == one for one in senses])
        here[1:] |= here[:-1]
        axes.plot(speeds, np.where(here, values, np.nan), **style)


def _label(vibration: NaturalVibration, mode: Mode) -> Label:
    what = ", ".join(moving(vibration.linearised, mode)[:2])
    return Label(mode.frequency, f"{mode.frequency:.4g}  {what}", STYLES[mode.sense]["color"])


def _legend(vibration: NaturalVibration) -> list[Line2D]:
    senses = {mode.sense for branch in vibration.over_speed.branches for mode in branch}
    names = {"forward": "forward whirl", "backward": "backward whirl", None: "back and forth"}
    lines = [
        Line2D([], [], label=name, **STYLES[sense])
        for sense, name in names.items()
        if sense in senses
    ]
    once = Line2D([], [], label="once per revolution; critical speeds", marker="o", mec="k", **ONCE)
    return [*lines, once]


def _times(factor: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: factor * values
