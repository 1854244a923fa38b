"""Pictures of maps: stability over two parameters, and basins over start angles."""

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.ndimage import gaussian_filter

from ab_sim.analysis.maps.family import Family
from ab_sim.analysis.maps.plane import SPEED, Plane
from ab_sim.analysis.maps.stability import StabilityMap
from ab_sim.analysis.maps.verdicts import (
    BALANCED,
    CIRCULATES,
    CIRCULATION_NAMES,
    EVERYWHERE,
    NO_STATE,
    NOT_KNOWN,
    NOTHING,
    SOMEWHERE,
    UNDECIDED,
    name_of,
)
from ab_sim.base import palette
from ab_sim.base.palette import hexadecimal
from ab_sim.base.presentation import NOTATION
from ab_sim.design import basin as basins
from ab_sim.design.basin import Basin
from ab_sim.show.saved import ResultFigure
from ab_sim.show.styles import distinct_colours

COLOURS = {
    EVERYWHERE: hexadecimal(palette.GOOD),
    SOMEWHERE: hexadecimal(palette.GOOD_IN_PART),
    NOTHING: hexadecimal(palette.BAD),
    NO_STATE: hexadecimal(palette.NO_STATE),
    UNDECIDED: hexadecimal(palette.UNDECIDED),
}
"""Colours of some labels; for other labels see ``colours_of``."""
_ONLY_UNBALANCED = tuple(map(hexadecimal, palette.UNBALANCED_STATES))
"""Colours of labels whose stable states are all unbalanced."""
_BALANCED_TOO = tuple(map(hexadecimal, palette.BALANCED_TOO))
"""Colours of labels with stable balance and other stable states; the start decides between them."""
_WARM, _COOL = (50.0, 105.0), (185.0, 290.0)
"""Hue ranges [deg] of further labels, without and with stable balance: ``ab_sim.base.palette``."""
_LIGHTNESS = (0.35, 0.9)
_HATCHES = {
    CIRCULATES: ("///", hexadecimal(palette.DARK)),
    NOT_KNOWN: ("..", hexadecimal(palette.MEDIUM)),
}
"""Pattern and colour of areas in which balls can circulate, or in which that is unknown."""
_BLUR, NEAR = 2.0, 0.02
"""Standard deviation of the smoothing of borders [points], and least distance of a value from 0.5.

See ``smoothed``.
"""


def drawn_map(stability_map: StabilityMap, other: StabilityMap | None = None) -> ResultFigure:
    """Return the figure of a map's labels, which name the stable states, over the plane.

    Parameters
    ----------
    stability_map
        Map to draw.
    other
        Another map on the same axes, drawn to the right.
    """
    maps = [stability_map] if other is None else [stability_map, other]
    figure = ResultFigure(figsize=(1.5 + 6.5 * len(maps), 6.4), layout="constrained")
    panels = figure.subplots(1, len(maps), sharex=True, sharey=True, squeeze=False)[0]
    labels = sorted({label for map_ in maps for label in map_.shares})
    colours = colours_of(labels)
    for axes, map_ in zip(panels, maps, strict=True):
        _draw_labels(axes, map_.plane, map_.labels, colours)
        hatched = _draw_circulation(axes, map_)
        balls = map_.plane.scene.balls
        count = f"{balls.count} ball{'s' if balls.count != 1 else ''}"
        axes.set_title(f"{map_.plane.scene.name}, {count}", fontsize=12)
        axes.legend(
            handles=[
                Patch(color=colours[label], label=f"{name_of(label)}  {100 * share:.1f} %")
                for label, share in map_.shares.items()
            ]
            + hatched,
            title="stable (share of the map)",
            loc="upper center",
            bbox_to_anchor=(0.5, -0.13),
            ncols=2,
            fontsize=9,
        )
    panels[0].set_ylabel(stability_map.plane.titles[1])
    return figure


def _draw_labels(axes: Axes, plane: Plane, labels: np.ndarray, colours: dict[int, str]) -> None:
    """Draw the labels of a plane as coloured areas, with a title for each axis.

    Parameters
    ----------
    axes
        Axes to draw on.
    plane
        Plane of the map.
    labels
        Label of each point, shape (values up, values across).
    colours
        Colour of each label.
    """
    order = sorted(colours)
    places = np.searchsorted(order, labels)
    across, up = plane.across.values, plane.up.values
    palette = ListedColormap([colours[label] for label in order])
    axes.pcolormesh(
        across, up, places, cmap=palette, vmin=-0.5, vmax=len(order) - 0.5, shading="nearest",
        rasterized=True,
    )  # fmt: skip
    axes.set_xlabel(plane.titles[0])
    held = "" if SPEED in (plane.across.key, plane.up.key) else f"{plane.speed:g} rad/s"
    if held:
        axes.text(0.99, 0.98, held, transform=axes.transAxes, ha="right", va="top", fontsize=9)


def _draw_circulation(axes: Axes, stability_map: StabilityMap) -> list[Patch]:
    """Hatch the areas in which all balls can circulate in a bunch, or in which that is unknown.

    Parameters
    ----------
    axes
        Axes to draw on.
    stability_map
        Map with the areas.

    Returns
    -------
    list[Patch]
        Entries for the legend.
    """
    across, up = stability_map.plane.across.values, stability_map.plane.up.values
    handles = []
    for label, (hatch, colour) in _HATCHES.items():
        inside = stability_map.circulating == label
        if not inside.any():
            continue
        drawn = axes.contourf(
            across, up, smoothed(inside), levels=[0.5, 2.0], colors="none", hatches=[hatch]
        )
        drawn.set_edgecolor(colour)
        drawn.set_linewidth(0.0)
        text = f"{CIRCULATION_NAMES[label]}  {100 * inside.mean():.1f} %"
        handles.append(Patch(facecolor="none", edgecolor=colour, hatch=hatch, label=text))
    return handles


def drawn_family(family: Family) -> ResultFigure:
    """Return the figure of the border of stable balance for each value of a third key.

    Parameters
    ----------
    family
        Maps on the same axes, one for each value.
    """
    plane = family.maps[0].plane
    figure = ResultFigure(figsize=(9, 6.4), layout="constrained")
    axes = figure.subplots()
    handles = []
    shades = colormaps["viridis"](np.linspace(0.0, 0.9, len(family.values)))
    for value, map_, shade in zip(family.values, family.maps, shades, strict=True):
        for inside, style in ((map_.balanced, "-"), (map_.balanced_everywhere, ":")):
            if inside.any() and not inside.all():
                axes.contour(
                    plane.across.values, plane.up.values, smoothed(inside), levels=[0.5],
                    colors=[shade], linestyles=[style], linewidths=1.8,
                )  # fmt: skip
        share = 100.0 * map_.balanced.mean()
        handles.append(Line2D([], [], color=shade, lw=1.8, label=f"{value:g}  ({share:.1f} %)"))
    axes.set_title(f"Borders of stable balance of {plane.scene.name}", fontsize=13)
    axes.set_xlabel(plane.titles[0])
    axes.set_ylabel(plane.titles[1])
    axes.grid(alpha=0.3)
    title = f"{family.key}\n(share of the map)\ndotted: at every position"
    axes.legend(
        handles=handles, title=title, fontsize=9, title_fontsize=9, loc="center left",
        bbox_to_anchor=(1.01, 0.5),
    )  # fmt: skip
    return figure


def smoothed(inside: np.ndarray) -> np.ndarray:
    """Return values whose contour at 0.5 is a smooth border between points inside and outside.

    The contour of the mask itself would have steps. The values are above 0.5 at exactly the points
    inside, so that no point changes sides.

    Parameters
    ----------
    inside
        Mask of points, shape (values up, values across).
    """
    blurred = gaussian_filter(inside.astype(float), _BLUR, mode="nearest")
    return np.where(inside, np.maximum(blurred, 0.5 + NEAR), np.minimum(blurred, 0.5 - NEAR))


def colours_of(labels: Sequence[int]) -> dict[int, str]:
    """Return a colour for each label: green if only balance is stable, red if nothing is."""
    fixed = {label: COLOURS[label] for label in labels if label in COLOURS}
    others = [label for label in labels if label not in COLOURS]
    too = [label for label in others if label > 0 and label & BALANCED]
    only = [label for label in others if label not in too]
    for some, first, hues in ((only, _ONLY_UNBALANCED, _WARM), (too, _BALANCED_TOO, _COOL)):
        spread = distinct_colours(
            len(some), first, avoid=[*COLOURS.values()], lightness=_LIGHTNESS, hues=hues
        )
        fixed |= zip(some, spread, strict=True)
    return fixed


_END_COLOURS = {
    basins.BALANCED: hexadecimal(palette.GOOD),
    basins.RINGING_DOWN: hexadecimal(palette.RINGING),
    basins.NOT_BALANCED: hexadecimal(palette.BAD),
    basins.CHANGING: hexadecimal(palette.STILL_CHANGING),
    basins.CIRCULATING: hexadecimal(palette.CIRCULATING),
    basins.DIVERGED: hexadecimal(palette.NO_STATE),
    basins.LEFT_OUT: hexadecimal(palette.LEFT_OUT),
}


def drawn_basin(basin: Basin) -> ResultFigure:
    """Return the figure of final states and residual unbalance of runs.

    Parameters
    ----------
    basin
        Final states of the runs.
    """
    figure = ResultFigure(figsize=(13, 6.6), layout="constrained")
    figure.suptitle(
        f"Final states of {basin.scene.name} over the start angles of two balls", fontsize=14
    )
    ends, residuals = figure.subplots(1, 2, sharex=True, sharey=True)
    degrees = np.degrees(basin.angles)
    half = 180.0 / len(degrees)
    edges = -180.0 - half, 180.0 - half
    order = list(_END_COLOURS)
    places = np.vectorize(order.index)(basin.labels)
    palette = ListedColormap([_END_COLOURS[label] for label in order])
    style = {"shading": "nearest", "rasterized": True}
    ends.pcolormesh(
        degrees, degrees, places, cmap=palette, vmin=-0.5, vmax=len(order) - 0.5, **style
    )
    shares = basin.shares
    handles = [
        Patch(color=_END_COLOURS[label], label=f"{basins.NAMES[label]}  {100 * share:.1f} %")
        for label, share in shares.items()
    ]
    handles.append(Patch(color=_END_COLOURS[basins.LEFT_OUT], label=basins.NAMES[basins.LEFT_OUT]))
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
