"""Figure 4.23 as a line, and the grid of start speed and duration."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gallery.page import Picture
from gallery.thesis.judged import DURATIONS, LINE, NAMES, PRINTED, SPEEDS, Judged
from gallery.thesis.pictures import written

SHOWN = (0.4, 1.5)
"""Of the settling periods of figure 4.23 [s]."""
AT_REST = 1.39
"""Final W/e that is shown at most: that of balls at rest is less (all but four grid points)."""


def line_picture(folder: Path, lines: dict[float, list[Judged]]) -> Picture:
    """Figure 4.23, with a fine line, and what a drive is judged by."""
    figure = Figure(figsize=(8.0, 9.0), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    values: tuple[tuple[str, Callable[[Judged], float | None]], ...] = (
        ("settling period [s]", lambda one: one.settling),
        ("in band from [s]", lambda one: one.end.in_band),
        ("final W/e", lambda one: one.end.final_whirl),
    )
    for axes, (label, pick) in zip(panels, values, strict=True):
        for acceleration, color in zip(PRINTED, ("tab:blue", "tab:red"), strict=True):
            ours = [np.nan if pick(one) is None else pick(one) for one in lines[acceleration]]
            axes.plot(LINE, ours, ".-", ms=3, color=color, label=NAMES[acceleration])
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    for acceleration, color in zip(PRINTED, ("tab:blue", "tab:red"), strict=True):
        printed = PRINTED[acceleration]
        panels[0].plot(
            list(printed), list(printed.values()), "o", mfc="none", color=color,
            label=f"printed, {NAMES[acceleration]}",
        )  # fmt: skip
    panels[0].set_ylim(*SHOWN)
    panels[0].legend(fontsize=9)
    panels[-1].set_xlabel("duration of the variable-speed period [s]")
    caption = (
        f"Figure 4.23 as a line up to {SHOWN[1]:g} s (gaps: the balls never reach -180 deg), and "
        "below what a drive is judged by; target 200 rad/s"
    )
    return written(figure, folder, "4.23", caption)


def grid_picture(folder: Path, grid: dict[float, list[list[Judged]]]) -> Picture:
    """Start speed and duration of the period, by both measures."""
    figure = Figure(figsize=(11.0, 9.5), layout="constrained")
    panels = figure.subplots(3, 2, sharex=True, sharey=True)
    for column, (acceleration, rows) in zip(panels.T, grid.items(), strict=True):
        _map(figure, column[0], [[one.settling for one in row] for row in rows], "settling [s]")
        _map(
            figure,
            column[1],
            [[one.end.in_band for one in row] for row in rows],
            "in band from [s]",
        )
        _map(
            figure,
            column[2],
            [[one.end.final_whirl for one in row] for row in rows],
            "final W/e",
            AT_REST,
        )
        column[0].set_title(NAMES[acceleration])
        column[-1].set_xlabel("duration [s]")
    for axes in panels[:, 0]:
        axes.set_ylabel("start speed [rad/s]")
    caption = (
        "Start speed and duration of the period: settling as the thesis counts it, when the whirl "
        f"is in its final band, and the final whirl, shown up to {AT_REST:g} (red is more: balls "
        "that have not come to rest); grey: never, darker is better"
    )
    return written(figure, folder, "4.4-grid", caption)


def _map(
    figure: Figure,
    axes: Axes,
    values: list[list[float | None]],
    label: str,
    most: float | None = None,
) -> None:
    axes.set_facecolor("0.8")
    colors = colormaps["viridis"].with_extremes(over="tab:red")
    shown = np.array([[np.nan if v is None else v for v in row] for row in values])
    drawn = axes.pcolormesh(DURATIONS, SPEEDS, shown, shading="nearest", cmap=colors, vmax=most)
    figure.colorbar(drawn, ax=axes, label=label, extend="neither" if most is None else "max")
