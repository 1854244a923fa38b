"""Basins: final states of runs, over the start angles of two balls."""

from pathlib import Path

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from ab_sim.base.presentation import NOTATION
from ab_sim.design.basin import (
    BALANCED,
    CHANGING,
    CIRCULATING,
    DIVERGED,
    LEFT_OUT,
    NAMES,
    NOT_BALANCED,
    RINGING_DOWN,
    Basin,
)
from ab_sim.show.figures.saved import ResultFigure, save

COLOURS = {
    BALANCED: "#2c9a55",
    RINGING_DOWN: "#9fd3a9",
    NOT_BALANCED: "#d7403a",
    CHANGING: "#f2b447",
    CIRCULATING: "#6a51a3",
    DIVERGED: "#3b3b3b",
    LEFT_OUT: "#e4e4e4",
}


def basin_figure(basin: Basin, path: Path) -> None:
    """Draw final states and residual unbalance of runs, and write both to a file.

    Args:
        basin: final states of the runs.
        path: file to write; its ending sets the format (png, svg, pdf).
    """
    save(drawn_basin(basin), path, 110)


def drawn_basin(basin: Basin) -> ResultFigure:
    """Return the figure of ``basin_figure`` without writing it; arguments as there."""
    figure = ResultFigure(figsize=(13, 6.6), layout="constrained")
    figure.suptitle(
        f"Final states of {basin.scene.name} over the start angles of two balls", fontsize=14
    )
    ends, residuals = figure.subplots(1, 2, sharex=True, sharey=True)
    degrees = np.degrees(basin.angles)
    half = 180.0 / len(degrees)
    edges = -180.0 - half, 180.0 - half
    order = list(COLOURS)
    places = np.vectorize(order.index)(basin.labels)
    palette = ListedColormap([COLOURS[label] for label in order])
    style = {"shading": "nearest", "rasterized": True}
    ends.pcolormesh(
        degrees, degrees, places, cmap=palette, vmin=-0.5, vmax=len(order) - 0.5, **style
    )
    shares = basin.shares
    handles = [
        Patch(color=COLOURS[label], label=f"{NAMES[label]}  {100 * share:.1f} %")
        for label, share in shares.items()
    ]
    handles.append(Patch(color=COLOURS[LEFT_OUT], label=NAMES[LEFT_OUT]))
    figure.legend(
        handles=handles, loc="outside lower center", ncols=3, fontsize=9,
        # A legend below all panels leaves no room for a separate line.
        title=f"balanced: residual unbalance at most {basin.limit:g}. {NOTATION}",
    )  # fmt: skip
    residual = np.array(
        [[np.nan if e.residual_unbalance is None else e.residual_unbalance for e in row]
         for row in basin.ends]
    )  # fmt: skip
    drawn = residuals.pcolormesh(degrees, degrees, residual, cmap="viridis_r", vmin=0.0, **style)
    figure.colorbar(drawn, ax=residuals, label="residual unbalance / (M0 e) [1]")
    for axes in (ends, residuals):
        axes.set_xlabel("first ball starts at [deg] from the unbalance")
        axes.set_aspect("equal")
        axes.set_xticks(np.arange(-180, 181, 60))
        axes.set_yticks(np.arange(-180, 181, 60))
        axes.set_xlim(*edges)
        axes.set_ylim(*edges)
    ends.set_ylabel("second ball starts at [deg]")
    return figure
