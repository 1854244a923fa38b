"""Branch diagram: resting states of the balls over the spindle's speed, stable and unstable."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ab_sim.analysis.equilibria import Equilibria
from ab_sim.analysis.equilibria.over_speed import BranchInterval, OverSpeed
from ab_sim.scene.model import Scene
from ab_sim.show.figures.colours import distinct_colours
from ab_sim.show.figures.curves import say_conventions
from ab_sim.show.figures.saved import ResultFigure, save

COLOURS = ("tab:blue", "tab:red", "tab:green", "tab:purple", "tab:brown", "tab:cyan", "tab:olive")
"""Colours of the first patterns; further ones have distinct colours."""
STYLES = {True: "-", False: (0, (4, 2)), None: ":"}
"""Line styles by the linear test's verdict."""
MOST_LABELLED = 12
"""Largest number of patterns that the legend names; it counts the others."""


def branches_figure(
    scene: Scene, equilibria: Equilibria, over_speed: OverSpeed, path: Path
) -> None:
    """Draw W and ball angles of all branches over speed, and write them to a file.

    Args:
        scene: scene of the branches.
        equilibria: resting states at one speed, which is marked.
        over_speed: branches of resting states over the speed.
        path: file to write; its ending sets the format (png, svg, pdf).
    """
    save(drawn_branches(scene, equilibria, over_speed), path, 110)


def drawn_branches(scene: Scene, equilibria: Equilibria, over_speed: OverSpeed) -> ResultFigure:
    """Return the figure of ``branches_figure`` without writing it; arguments as there."""
    figure = ResultFigure(figsize=(10, 7.5), layout="constrained")
    figure.suptitle(f"Resting states of the balls of {scene.name}", fontsize=14)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 0.9))
    length, symbol = scene.whirl_unit
    names = list(dict.fromkeys(_pattern(interval.label) for interval in over_speed.intervals))
    spread = distinct_colours(len(names), COLOURS, avoid=["k"])
    colours = {
        name: "k" if name == "balanced" else colour
        for name, colour in zip(names, spread, strict=True)
    }
    for interval in over_speed.intervals:
        colour = colours[_pattern(interval.label)]
        _draw(above, interval, colour, lambda state: state.W / length)
        if "worst" not in interval.label and "best" not in interval.label:
            for i in range(len(interval.states[0].theta)):
                _draw(below, interval, colour, lambda s, i=i: math.degrees(s.theta[i]), breaks=True)
    for _, fold in over_speed.folds:
        above.plot(fold.speed, fold.W / length, "D", color="w", mec="k", ms=6, zorder=5)
    for crossing in over_speed.crossings:
        above.plot(crossing.speed, crossing.W / length, "o", color="gold", mec="k", ms=7, zorder=5)
    for low, high in over_speed.without_stable_state:
        for axes in (above, below):
            axes.axvspan(low, high, color="0.9", zorder=0)
    for axes in (above, below):
        axes.axvline(equilibria.speed, color="0.5", lw=0.8, ls="-.")
        axes.grid(alpha=0.3)
    sizes = [
        s.W / length for interval in over_speed.intervals for s in interval.states if s.W > 0.0
    ]
    floor = 0.1 * min(1.0, float(np.percentile(sizes, 10))) if sizes else 0.1
    above.set_yscale("symlog", linthresh=max(floor, 1e-6))
    above.set_ylim(bottom=-0.3 * max(floor, 1e-6))
    above.set_ylabel(f"W/{symbol}")
    below.set_ylabel("theta [deg]")
    below.set_ylim(-335, 35)
    below.set_yticks(range(-300, 1, 60))
    below.set_xlabel("spindle speed [rad/s]")
    below.set_xlim(0.0, over_speed.speeds[1])
    figure.legend(handles=_legend(colours), loc="outside right upper", fontsize=8)
    say_conventions(figure)
    return figure


def _pattern(label: str) -> str:
    """Return a branch's label without the numbers of radius and position."""
    return label.split("/")[0].split(",")[0]


def _draw(
    axes: Axes, interval: BranchInterval, colour: str, value: Callable, breaks: bool = False
) -> None:
    values = np.array([value(state) for state in interval.states])
    verdicts = [state.stable for state in interval.states]
    if breaks:
        values[1:][np.abs(np.diff(values)) > 180.0] = np.nan
    for verdict, style in STYLES.items():
        # Each part is extended to the next point, where another may begin.
        here = np.array([verdict is one for one in verdicts])
        here[1:] |= here[:-1]
        if here.any():
            width = 2.2 if verdict else 1.1
            visible = np.where(here, values, np.nan)
            axes.plot(interval.speeds, visible, color=colour, ls=style, lw=width)


def _legend(colours: dict[str, str]) -> list[Line2D]:
    items = list(colours.items())
    if len(items) > MOST_LABELLED:
        items = [item for item in items if item[0] == "balanced"]
        items.append((f"{len(colours) - len(items)} patterns", COLOURS[0]))
    lines = [Line2D([], [], color=colour, lw=2, label=name) for name, colour in items]
    parts = (
        ("stable", {"color": "k", "ls": "-", "lw": 2.2}),
        ("unstable", {"color": "k", "ls": STYLES[False], "lw": 1.1}),
        ("undecided", {"color": "k", "ls": ":", "lw": 1.1}),
        ("fold", {"color": "w", "marker": "D", "mec": "k", "ls": ""}),
        ("stability changes", {"color": "gold", "marker": "o", "mec": "k", "ls": ""}),
        ("no stable state", {"color": "0.9", "lw": 8}),
        ("speed of the table", {"color": "0.5", "lw": 0.8, "ls": "-."}),
    )
    return lines + [Line2D([], [], label=name, **style) for name, style in parts]
