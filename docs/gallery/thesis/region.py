"""How wide the region of m and c_b is in which the balls end opposite: a map."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from gallery.page import Picture
from gallery.thesis.claims import at_odd
from gallery.thesis.drive import HOLD, THESIS, Tell
from gallery.thesis.many import ends
from gallery.thesis.pictures import written

MAP_MASSES = np.round(np.geomspace(0.3e-3, 4e-3, 28), 7)
MAP_DRAGS = np.round(np.geomspace(0.2, 8.0, 28), 4)


def region(tell: Tell) -> np.ndarray:
    """Ends over m and c_b [deg], shape (without or with the hold, masses, drags)."""
    drives = [THESIS._replace(m=float(m), c_b=float(c_b)) for m in MAP_MASSES for c_b in MAP_DRAGS]
    cases = [(p, None) for p in drives] + [(p, HOLD) for p in drives]
    found = ends("map of m and c_b", cases, tell)
    return np.array([end.angle for end in found]).reshape(2, len(MAP_MASSES), len(MAP_DRAGS))


def map_picture(folder: Path, ends: np.ndarray) -> Picture:
    """End positions over m and c_b, without and with the hold."""
    figure = Figure(figsize=(12.0, 5.0), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, each, title in zip(panels, ends, ("without a period", "hold of 0.5 s"), strict=True):
        _map(figure, axes, each)
        axes.set_title(title)
        axes.set_xlabel("m [g]")
    panels[0].set_ylabel("c_b [N s/m]")
    caption = (
        "End position over m and c_b; outlined: near an odd multiple of -180 deg; "
        "yellow: six times and more; cross: the thesis' own set"
    )
    return written(figure, folder, "5-map", caption)


def _map(figure: Figure, axes: Axes, ends: np.ndarray) -> None:
    x = 1e3 * MAP_MASSES
    drawn = axes.pcolormesh(
        x, MAP_DRAGS, ends.T / -180.0, shading="nearest", cmap="viridis", vmin=0.0, vmax=6.0
    )
    axes.contour(x, MAP_DRAGS, at_odd(ends).T.astype(float), [0.5], colors="white", linewidths=1.2)
    axes.plot(1.0, 1.0, "x", color="tab:red", ms=9, mew=2)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks([0.3, 0.5, 1.0, 2.0, 4.0], ["0.3", "0.5", "1", "2", "4"], minor=False)
    axes.set_yticks([0.2, 0.5, 1.0, 2.0, 5.0], ["0.2", "0.5", "1", "2", "5"], minor=False)
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    figure.colorbar(drawn, ax=axes, label="ball position, times -180 deg")
