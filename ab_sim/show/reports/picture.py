"""Picture of a report: a column for each run, a row for each kind of panel."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ab_sim.show.figures.colours import GREY, MAP
from ab_sim.show.figures.curves import say_conventions
from ab_sim.show.figures.saved import save
from ab_sim.show.reports.grid import Grid, Limits, grid_title
from ab_sim.show.reports.panels import Panel

MOST_NAMES = 8
"""Largest number of curves with a legend."""
BAR = (1.02, 0.0, 0.03, 1.0)
"""Position and size of a colour bar, as fractions of its panel."""


def report_picture(grid: Grid, path: Path) -> None:
    """Draw runs side by side, and write them to a file.

    Args:
        grid: panels to show.
        path: file to write, with the ending .png.
    """
    heights = [max(p.height for p in row if p) for row in grid.rows]
    columns = len(grid.names)
    figure = Figure(figsize=(1.5 + 7.5 * columns, 0.8 + 2.9 * sum(heights)), layout="constrained")
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
                title = grid_title(panel, grid.own[row])
                _draw(figure, axes[row][column], panel, title, grid.limits[row][column])
    say_conventions(figure)
    save(figure, path, 100)


def _draw(figure: Figure, axes: Axes, panel: Panel, title: str, limits: Limits) -> None:
    axes.set_title(title, fontsize=10)
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
        figure.colorbar(drawn, cax=axes.inset_axes(BAR), label=panel.heat.label)
    if panel.cloud is not None:
        axes.plot(panel.cloud.x, panel.cloud.y, color="0.85", lw=0.4, zorder=1)
        dots = axes.scatter(
            panel.cloud.x, panel.cloud.y, c=panel.cloud.time, s=4, cmap=MAP, lw=0, zorder=2
        )
        figure.colorbar(dots, cax=axes.inset_axes(BAR), label="time [s]")
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
    axes.set_xlim(*limits[0])
    axes.set_ylim(*limits[1])
    axes.grid(alpha=0.3)
    if 1 < len(panel.curves) + bool(panel.levels) <= MOST_NAMES + 1:
        # Next to the panel, where it covers no curve; a map has its colour bar there.
        beside = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0}
        axes.legend(fontsize=8, **(beside if panel.heat is None else {"loc": "lower right"}))
