"""Figures 5 and 9 of 2008: where the balanced rotor is stable, over speed and ball mass."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import brentq

from ab_sim.analysis.floquet import follow, solutions_of
from ab_sim.analysis.result_cache import ResultCache
from gallery.deck_3d.maps import balanced_moduli
from gallery.page import PageSection, Table
from gallery.two_plane.long_rotor import DYNAMIC, STATIC, long_rotor, long_scene
from gallery.two_plane.printed import growth
from gallery.two_plane.rotor import Tell, balanced_alphas, written

Change = tuple[float, float]
"""Ball mass, speed."""


class Chart(NamedTuple):
    """One of the figures."""

    name: str
    unbalance: dict[str, float]
    least_mass: float
    """Printed: lighter balls cannot balance."""
    at_3: tuple[float, ...]
    """Ball masses at Omega = 3 where stability changes."""
    above: tuple[Change, ...]
    """Ball masses, and the speed above which it is stable."""
    runs: tuple[Change, ...]
    """Dots in the figure: runs of figures 11 and 12."""


CHARTS = (
    Chart(
        "figure 5, static",
        STATIC,
        0.0025,
        (0.00335, 0.00379, 0.00536),
        ((0.01, 3.529), (0.02, 4.277), (0.03, 4.902), (0.04, 5.539)),
        ((0.025, 2.0), (0.005, 2.5), (0.005, 4.0)),
    ),
    Chart(
        "figure 9, dynamic",
        DYNAMIC,
        0.00261,
        (0.00524,),
        ((0.01, 3.424), (0.02, 3.970), (0.03, 4.423), (0.04, 4.896)),
        ((0.005, 3.5),),
    ),
)
"""Printed values are read from the figures."""
OVER = np.linspace(1.25, 6.0, 39)
MASSES = np.sort([*np.geomspace(0.0027, 0.04, 16), 0.0034, 0.0035, 0.0036, 0.0037, 0.0038])
"""Of the maps; closer where figure 5 has a tongue of instability."""


def least_ball_mass(unbalance: dict[str, float]) -> float:
    """(22): lightest balls that can balance."""
    p = long_rotor(**unbalance)
    static = p.eccentricity * complex(math.cos(p.phase), math.sin(p.phase))
    couple = p.couple / p.planes[0]
    return max(abs(static + couple), abs(static - couple)) / 4.0


def borders_at_3(chart: Chart) -> list[float]:
    """Ball masses where stability changes at Omega = 3, rising."""
    masses = np.linspace(0.008, 1.02 * chart.least_mass, 28).tolist()
    return _borders(lambda m: (m, 3.0), masses, chart)


def lowest_stable(chart: Chart, mass: float) -> float:
    """Speed above which the balance is stable, up to 6."""
    return _borders(lambda w: (mass, w), np.linspace(6.0, 2.5, 15).tolist(), chart)[-1]


def second_border(chart: Chart, mass: float, between: tuple[float, float]) -> float:
    """Speed at which a second pair of multipliers leaves the unit circle."""

    def beyond(speed: float) -> float:
        scene = long_scene(long_rotor(**chart.unbalance, ball_mass=mass), speed, 1.0)
        (found,) = solutions_of(scene, speed, "balanced")
        return float(np.sort(np.abs(found.multipliers))[-3]) - 1.0

    return float(brentq(beyond, *between, xtol=1e-4))


def linear_borders_at_3(chart: Chart) -> list[float]:
    """``borders_at_3`` of the papers' equations of 2010."""
    masses = np.linspace(1.02 * chart.least_mass, 0.008, 200)
    return _crossings(lambda m: _growth(chart, m, 3.0), masses)


def linear_lowest_stable(chart: Chart, mass: float) -> float:
    """``lowest_stable`` of the papers' equations of 2010."""
    return _crossings(lambda w: _growth(chart, mass, w), np.linspace(2.5, 6.0, 200))[-1]


def _growth(chart: Chart, mass: float, speed: float) -> float:
    p = long_rotor(**chart.unbalance, ball_mass=mass)
    return growth(p, speed, balanced_alphas(p))


def _crossings(function: Callable[[float], float], values: np.ndarray) -> list[float]:
    """Where it is zero, rising."""
    found = np.array([function(value) for value in values.tolist()])
    at = np.flatnonzero(found[:-1] * found[1:] < 0.0)
    return [float(brentq(function, values[k], values[k + 1])) for k in at]


def _borders(place: Any, values: list[float], chart: Chart) -> list[float]:
    def case(value: float) -> tuple[Any, float]:
        mass, speed = place(value)
        p = long_rotor(**chart.unbalance, ball_mass=mass)
        return long_scene(p, speed, 1.0), speed

    followed = follow("value", case, values, ["balanced"])
    return sorted(border.value for border in followed.borders)


def border_section(folder: Path, tell: Tell) -> PageSection:
    """The maps, and the printed borders beside ours."""
    figure = Figure(figsize=(12.0, 5.0), layout="constrained")
    figure.suptitle("Balanced rotor: stable (shaded) over spindle speed and ball mass")
    rows: list[tuple[str, str, float, float, float]] = []
    for axes, chart in zip(figure.subplots(1, 2), CHARTS, strict=True):
        least = least_ball_mass(chart.unbalance)
        rows.append((chart.name, "least ball mass m", chart.least_mass, least, least))
        tell(f"{chart.name}: borders", 0, 1)
        found = zip(chart.at_3, borders_at_3(chart), linear_borders_at_3(chart), strict=True)
        rows += [(chart.name, "m at Omega = 3", *each) for each in found]
        for k, (mass, printed) in enumerate(chart.above):
            tell(f"{chart.name}: borders", k, len(chart.above))
            what = f"Omega at m = {mass:g}"
            ours, linear = lowest_stable(chart, mass), linear_lowest_stable(chart, mass)
            rows.append((chart.name, what, printed, ours, linear))
        _draw(axes, chart, tell)
    names = "figure", "border", "printed", "ours", "(1), (2) of 2010"
    dynamic = CHARTS[1]
    mass, printed = dynamic.above[-1]
    second = second_border(dynamic, mass, (printed - 0.1, printed + 0.1))
    table = Table("Where the stability of the balance changes", names, tuple(rows), 4)
    text = (
        "Ours are multipliers of one revolution of the exact rigid body; the papers use AUTO. "
        "Borders agree to the last one or two digits that can be read, except for the heaviest "
        f"balls under dynamic unbalance. The printed border is found at {second:.3f}, but a "
        "second pair of multipliers, in no printed curve, is unstable up to 5.287 and grows by "
        "at most 1.0009 per revolution.",
        "The last column uses the authors' later equations (2010), which omit the moments of "
        "the balls' lever R.",
    )
    caption = (
        "Shaded: the largest modulus of a multiplier is below 1; crosses: printed borders; dots: "
        "the runs below; hatched: the balls are too light to balance"
    )
    picture = written(figure, folder, "borders", caption)
    return PageSection("Where the balance is stable", text, (table,), (picture,))


def _draw(axes: Axes, chart: Chart, tell: Tell) -> None:
    moduli = []
    for k, mass in enumerate(MASSES.tolist()):
        tell(f"{chart.name}: map", k, len(MASSES))
        scene = long_scene(long_rotor(**chart.unbalance, ball_mass=mass), 3.0, 1.0)
        row = ResultCache(balanced_moduli).of(scene, speeds=OVER.tolist())["largest"]
        moduli.append([np.nan if x is None else x for x in row])
    # Growth is steep on one side of a border only, which would move a line drawn between points.
    growth = np.clip(np.log(moduli), -5e-3, 5e-3)
    axes.contourf(OVER, MASSES, growth, levels=[-1.0, 0.0], colors=["tab:green"], alpha=0.25)
    axes.contour(OVER, MASSES, growth, levels=[0.0], colors=["k"], linewidths=1.0)
    axes.axhspan(0.002, chart.least_mass, hatch="///", fc="0.9", ec="0.6", lw=0)
    printed = [(3.0, mass) for mass in chart.at_3] + [(w, mass) for mass, w in chart.above]
    axes.plot(*zip(*printed, strict=True), "x", color="tab:red", ms=6, label="printed border")
    axes.plot([w for _, w in chart.runs], [m for m, _ in chart.runs], "ko", ms=4, label="run")
    axes.set_yscale("log")
    axes.set_ylim(0.002, 0.045)
    axes.set_title(chart.name, fontsize=10)
    axes.set_xlabel("spindle speed [Omega_1]")
    axes.set_ylabel("ball mass m [M]")
    axes.legend(fontsize=8, loc="center left")
