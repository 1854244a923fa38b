"""Figure 2: the whirl at rest and lambda_Rmax over the spindle's speed, and their landmarks."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.optimize import minimize_scalar

from ab_sim import Scene, equilibria
from ab_sim.analysis import without_balls
from ab_sim.results import RestingState
from gallery.page import Cell, PageSection, Table
from gallery.relative_stability.cases import BallMassCase, Tell, cases, own_speed, written

RATIOS = np.linspace(0.01, 2.5, 250)
"""Omega = w / omega_n, of the picture."""


class Landmark(NamedTuple):
    """Something that the report reads off figure 2."""

    case: int
    what: str
    find: Callable[[Scene, float, float], float]
    within: tuple[float, float]
    """Where it is looked for, Omega."""
    at: float | None
    """Published Omega."""
    value: float | None
    """Published lambda_Rmax [1/s]."""


def holding(scene: Scene, speed: float) -> RestingState | None:
    """The resting state that is not unstable at a speed [rad/s]; None where there is none."""
    states = [s for s in equilibria(scene, speed).branches if s.stable is not False]
    return max(states, key=lambda state: state.W, default=None)


def strength(scene: Scene, ratio: float) -> float:
    """lambda_Rmax [1/s] of that state at Omega: 0 where it is but for rounding; NaN of none."""
    state = holding(scene, ratio * own_speed(scene))
    if state is None:
        return math.nan
    return 0.0 if state.stable is None else state.lambda_max


def lowest(scene: Scene, low: float, high: float) -> float:
    """Omega at which lambda_Rmax is least between two."""
    return _extremum(scene, low, high, 1.0)


def highest(scene: Scene, low: float, high: float) -> float:
    """Omega at which lambda_Rmax is largest between two."""
    return _extremum(scene, low, high, -1.0)


def _extremum(scene: Scene, low: float, high: float, sense: float) -> float:
    found = minimize_scalar(
        lambda ratio: sense * strength(scene, ratio),
        bounds=(low, high),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return float(found.x)


def border(scene: Scene, low: float, high: float) -> float:
    """Omega at which the scene begins or ceases to have a state that is not unstable."""
    begins = holding(scene, high * own_speed(scene)) is not None
    while high - low > 1e-10:
        middle = 0.5 * (low + high)
        if (holding(scene, middle * own_speed(scene)) is not None) == begins:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


LANDMARKS = (
    Landmark(1, "lambda_Rmax turns near omega_n", lowest, (0.9, 1.1), None, None),
    Landmark(1, "local maximum", highest, (1.2, 1.6), 1.375, -0.054),
    Landmark(2, "minimum", lowest, (0.6, 0.95), 0.843, -0.067),
    Landmark(3, "local minimum", lowest, (0.6, 0.85), 0.788, -0.056),
    Landmark(3, "no stable state from", border, (0.8, 0.95), 0.872, None),
    Landmark(3, "no stable state to", border, (0.95, 1.1), None, None),
    Landmark(3, "lambda_Rmax turns", lowest, (1.2, 1.5), 1.408, None),
    Landmark(3, "local maximum", highest, (1.5, 1.8), 1.605, -0.157),
)


def landmark_rows() -> list[tuple[Cell, ...]]:
    """Case, what, speed [rad/s], Omega, published, lambda_Rmax [1/s], published."""
    scenes = {case.number: case.scene for case in cases()}
    rows: list[tuple[Cell, ...]] = []
    for mark in LANDMARKS:
        scene = scenes[mark.case]
        ratio = mark.find(scene, *mark.within)
        value = None if mark.find is border else strength(scene, ratio)
        where = (ratio * own_speed(scene), ratio, mark.at)
        rows.append((f"{mark.case}", mark.what, *where, value, mark.value))
    return rows


def resting_section(folder: Path, tell: Tell) -> PageSection:
    """Figure 2 with a table of its landmarks."""
    figure = Figure(figsize=(8, 9), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    for axes, case in zip(panels, cases(), strict=True):
        tell(f"figure 2, case {case.number}", case.number - 1, 4)
        _panel(axes, case)
    panels[-1].set_xlabel("Ω = ω / ω_n [1]")
    caption = "whirl at rest with and without balls, and lambda_Rmax, over speed"
    picture = written(figure, folder, 2, caption)
    tell("figure 2's landmarks", 3, 4)
    columns = (
        "case", "what", "speed [rad/s]", "Ω", "Ω published", "lambda_Rmax [1/s]", "published",
    )  # fmt: skip
    table = Table("Landmarks of figure 2", columns, tuple(landmark_rows()), digits=5)
    text = (
        "Resting states by the closed forms (15) to (24) with atan2; eigenvalues of the exact "
        "Jacobian. Ω uses each case's own sqrt(k/M) of 192.21, 192.18 and 192.15 rad/s. With "
        "Table 1's 192.18 for all, the landmark 0.788 would be 0.787.",
        "Case 3 has no stable state between two speeds: the state of clustered balls has ended "
        "in a fold, and the balanced state is not stable yet. The report's statement that the "
        "whirl has no real solution there is true for (15), the clustered balls.",
        "In case 2 lambda_Rmax is 0 above ω_n, and decides nothing: see the last section.",
    )
    return PageSection("Resting states: figure 2", text, (table,), (picture,))


def _panel(axes: Axes, case: BallMassCase) -> None:
    states = [holding(case.scene, ratio * case.omega_n) for ratio in RATIOS]
    alone = without_balls(case.scene)
    bare = [equilibria(alone, ratio * case.omega_n).branches[0].W for ratio in RATIOS]
    whirl = [np.nan if state is None else state.W for state in states]
    axes.plot(RATIOS, 1e3 * np.array(whirl), color="tab:blue")
    axes.plot(RATIOS, 1e3 * np.array(bare), color="0.5", lw=1.0, marker="o", ms=2.5, markevery=6)
    axes.set_ylabel("whirl W [mm]", color="tab:blue")
    axes.set_title(case.title, fontsize=10, loc="left")
    other = axes.twinx()
    growth = np.array([np.nan if state is None else state.lambda_max for state in states])
    other.plot(RATIOS, growth, color="tab:red", ls="--")
    other.set_ylabel("lambda_Rmax [1/s]", color="tab:red")
    axes.set_ylim(bottom=-0.003)
    axes.grid(alpha=0.3)
    if case.number == 1:
        lines = [
            Line2D([], [], color="tab:blue", label="W with balls, at rest"),
            Line2D([], [], color="0.5", marker="o", ms=2.5, lw=1.0, label="W without balls"),
            Line2D([], [], color="tab:red", ls="--", label="lambda_Rmax (right)"),
        ]
        axes.legend(handles=lines, loc="upper right", fontsize=8)
