"""Figures 4, 7 and 9: stable regions over speed and damping, and three balls against two."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ab_sim import equilibria
from ab_sim.analysis.maps.family import BallCountComparison
from ab_sim.analysis.maps.plane import SPEED, Plane, axis
from ab_sim.analysis.maps.stability import StabilityMap, stability_map
from ab_sim.analysis.maps.verdicts import CLUSTERED
from gallery.page import Cell, PageSection, Picture, Table
from gallery.three_ball.drive import DAMPING, MASS, drive
from gallery.three_ball.growth import BEST, WORST, threshold
from gallery.three_ball.written import Tell, written

COUNT, COARSE = 101, 4
DRAGS = {0.1: "tab:blue", 0.3: "tab:orange"}
"""zeta_B that the text names, and their colours; others of the figures it does not."""
BELLS = {0.1: "tab:blue", 0.2: "tab:green", 0.3: "tab:orange"}
TOTALS = ((7, 1.2), (9, 2.4))
"""Figures and total unbalance of the balls, of the disc's."""
DAMPINGS = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5)
"""zeta, of the table of thresholds."""


class Region(NamedTuple):
    """What a curve encloses."""

    inside: np.ndarray
    colour: str
    style: str
    label: str


class Window(NamedTuple):
    """Ranges of a figure."""

    Omega: tuple[float, float]
    zeta: tuple[float, float]


BELL = Window((0.9, 2.0), (0.001, 0.1))
WIDE = Window((0.5, 3.0), (0.005, 0.5))


def region_map(
    eta: float, balls: int, zeta_b: float, window: Window, tell: Tell | None = None
) -> StabilityMap:
    """Verdicts over Omega (across) and the suspension's damping (up)."""
    low, high = (2.0 * MASS * zeta for zeta in window.zeta)
    across, up = axis(SPEED, *window.Omega, COUNT), axis(DAMPING, low, high, COUNT)
    plane = Plane(drive(eta, balls, zeta_b=zeta_b), 0.0, across, up)
    return stability_map(plane, COARSE, tell=tell)


def bell_section(folder: Path, tell: Tell) -> PageSection:
    """Figure 4: where three balls that are too light are stable all together."""
    figure = Figure(figsize=(7.5, 5), layout="constrained")
    axes = figure.subplots()
    rows: list[tuple[Cell, ...]] = []
    regions = []
    for zeta_b, colour in BELLS.items():
        found = region_map(0.2, 3, zeta_b, BELL, tell)
        unstable = (found.labels & CLUSTERED) == 0
        regions.append(Region(unstable, colour, "-", f"ζ_B = {zeta_b:g}"))
        row = int(np.flatnonzero(unstable.any(axis=1))[-1])
        over = np.array(found.plane.across.values)[unstable[row]].mean()
        zeta = found.plane.up.values[row] / (2.0 * MASS)
        rows.append((zeta_b, float(unstable.mean()), zeta, float(over)))
    _contours(axes, found.plane, regions)
    axes.set_title("r11 at η = 0.2: unstable within", fontsize=11)
    table = Table(
        "Where r11 is unstable, eta = 0.2",
        ("zeta_B", "share of the map", "up to zeta", "there, at Omega"),
        tuple(rows),
        4,
    )
    labels = {s.label for w in (0.7, 1.3, 2.5) for s in equilibria(drive(0.2), w).stable}
    text = (
        "As published, each unstable region is bell-shaped and shrinks with more drag; point "
        "A, stable at zeta_B = 0.3 but not at 0.1, lies between two curves. Near the "
        "horizontal axis, however, more drag widens the region slightly. The curve for 0.2 is "
        "ours.",
        f"The only stable states at Ω = 0.7, 1.3 and 2.5: {', '.join(sorted(labels))} (r11).",
    )
    caption = "borders of the region where r11 is unstable, eta = 0.2"
    picture = written(figure, folder, 4, caption)
    return PageSection("Balls that are too light: figure 4", text, (table,), (picture,))


def against_section(folder: Path, tell: Tell) -> PageSection:
    """Figures 7 and 9: three balls against two at equal total unbalance."""
    pictures, rows = [], []
    for number, total in TOTALS:
        picture, more = _against(folder, number, total, tell)
        pictures.append(picture)
        rows += more
    shares = Table(
        "Where balance is stable, shares of the map",
        (
            "total",
            "zeta_B",
            "three balls at",
            "both",
            "only three",
            "only two",
            "three less two",
        ),
        tuple(rows),
        4,
    )
    tell("thresholds", 0, 1)
    thresholds = Table(
        "Omega above which balance is stable, zeta_B = 0.1",
        ("total", "zeta", "two balls", "three, best position", "three, worst position"),
        tuple(
            (
                total,
                zeta,
                threshold(drive(total / 2, 2, zeta)),
                *(threshold(drive(total / 3, 3, zeta), label) for label in (BEST, WORST)),
            )
            for _, total in TOTALS
            for zeta in DAMPINGS
        ),
        5,
        on_page=False,
    )
    text = (
        f"Grid of {COUNT} by {COUNT} points, {WIDE.Omega[0]:g} ≤ Ω ≤ {WIDE.Omega[1]:g} and "
        f"{WIDE.zeta[0]:g} ≤ ζ ≤ {WIDE.zeta[1]:g} (ours), refined along borders from every "
        f"{COARSE}th point. zeta_B is equal for two and three balls.",
        "The paper takes the *union* of the stable regions of many positions. A drive whose "
        "start is not chosen can rely only on the region where *every* position is stable. The "
        "figures show both.",
        "At a total of 1.2 the advantage of three balls is small, about one hundredth of the "
        "map for zeta_B = 0.1, and holds for every position from zeta = 0.1. At zeta = 0.02 "
        "and 0.05 two balls are stable from a slightly lower speed. At 2.4 the union is much "
        'larger for three balls, the region of every position much smaller. "Three balls are '
        'more robust than two" is thus true as the paper defines it, and false at 2.4 if the '
        "position cannot be chosen.",
    )
    return PageSection(
        "Three balls against two: figures 7 and 9", text, (shares, thresholds), tuple(pictures)
    )


def _against(
    folder: Path, number: int, total: float, tell: Tell
) -> tuple[Picture, list[tuple[Cell, ...]]]:
    figure = Figure(figsize=(12, 5), layout="constrained")
    panels = figure.subplots(1, len(DRAGS), sharey=True)
    rows: list[tuple[Cell, ...]] = []
    for axes, (zeta_b, colour) in zip(panels, DRAGS.items(), strict=True):
        three, two = (region_map(total / n, n, zeta_b, WIDE, tell) for n in (3, 2))
        found = BallCountComparison(three, two)
        for name, shares in (
            ("some position", found.somewhere),
            ("every position", found.everywhere),
        ):
            more = shares.only_ours - shares.only_other
            rows.append((total, zeta_b, name, *shares, more))
        regions = [
            Region(three.balanced, colour, "-", "three balls, some position (the paper's)"),
            Region(three.balanced_everywhere, colour, ":", "three balls, every position"),
            Region(two.balanced, "k", "--", "two balls"),
        ]
        _contours(axes, three.plane, regions)
        axes.set_title(f"η_total = {total:g}, ζ_B = {zeta_b:g}: stable to the right", fontsize=11)
    panels[1].set_ylabel("")
    caption = f"borders of the region where r = 0 is stable, eta_total = {total:g}"
    return written(figure, folder, number, caption), rows


def _contours(axes: Axes, plane: Plane, regions: list[Region]) -> None:
    zeta = np.array(plane.up.values) / (2.0 * MASS)
    for region in regions:
        if region.inside.any() and not region.inside.all():
            axes.contour(
                plane.across.values, zeta, region.inside.astype(float), levels=[0.5],
                colors=[region.colour], linestyles=[region.style], linewidths=1.6,
            )  # fmt: skip
    axes.set_xlabel("Ω")
    axes.set_ylabel("ζ")
    axes.set_ylim(0, zeta[-1])
    axes.grid(alpha=0.3)
    lines = [Line2D([], [], color=r.colour, ls=r.style, label=r.label) for r in regions]
    axes.legend(handles=lines, fontsize=8, loc="upper right")
