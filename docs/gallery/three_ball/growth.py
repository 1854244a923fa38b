"""Figure 2: real parts of the eigenvalues of a balanced position over the speed."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq

from ab_sim import Scene, equilibria
from ab_sim.results import RestingState
from gallery.page import Cell, PageSection, Table
from gallery.three_ball.drive import drive
from gallery.three_ball.written import Tell, written

ETA = 0.4
SETS = ((0.02, 0.1, 1.51, "figure 2"), (0.05, 0.1, 1.42, "figure 5"))
"""zeta, zeta_B, the threshold that is published, and where."""
SPEEDS = np.linspace(1.0, 3.0, 201)
SYMMETRIC, BEST, WORST = "balanced", "balanced, best", "balanced, worst"


def balanced(scene: Scene, speed: float, label: str = SYMMETRIC) -> RestingState:
    """A balanced state; of two balls there is one, whatever the label."""
    states = {state.label: state for state in equilibria(scene, speed).branches}
    return states.get(label, states[SYMMETRIC])


def threshold(scene: Scene, label: str = SYMMETRIC, low: float = 1.05, high: float = 4.0) -> float:
    """The highest Omega at which a balanced position ceases to be stable; NaN where none is."""
    grid = np.linspace(low, high, 60)
    unstable = [balanced(scene, w, label).lambda_max > 0.0 for w in grid]
    if not any(unstable) or unstable[-1]:
        return float("nan")
    last = int(np.flatnonzero(unstable)[-1])
    return float(
        brentq(
            lambda w: balanced(scene, w, label).lambda_max, grid[last], grid[last + 1], xtol=1e-10
        )
    )


def growth_section(folder: Path, tell: Tell) -> PageSection:
    """Figure 2, and what its threshold depends on."""
    tell("figure 2", 0, 1)
    rows: list[tuple[Cell, ...]] = []
    thresholds = []
    for zeta, zeta_b, published, where in SETS:
        scene = drive(ETA, 3, zeta, zeta_b)
        each = [threshold(scene, label) for label in (SYMMETRIC, BEST, WORST)]
        thresholds.append(each[0])
        rows.append((zeta, zeta_b, f"{published} ({where})", *each))
    table = Table(
        "Omega above which balance is stable, eta = 0.4",
        ("zeta", "zeta_B", "published", "ours, symmetric position", "best", "worst position"),
        tuple(rows),
    )
    caption = (
        f"real parts of the eigenvalues of the symmetric balanced position, eta = {ETA:g}, "
        f"zeta = {SETS[0][0]:g}, zeta_B = {SETS[0][1]:g}; one of them is 0 by structure"
    )
    text = (
        "The two thresholds for eta = 0.4, 1.51 (figure 2) and 1.42 (figure 5), cannot belong "
        "to one set of parameters: with mu / delta = 0.03 and zeta_B = 0.1, the first needs "
        "zeta = 0.02 and the second zeta = 0.05. These values are chosen here to meet them.",
        "The threshold of three balls depends on their position. The table gives it for the "
        "symmetric position (one ball at 180°) and for the best and worst of all. The paper "
        "does not state the position of figure 2.",
    )
    scene = drive(ETA, 3, *SETS[0][:2])
    figure = Figure(figsize=(8, 4.6), layout="constrained")
    axes = figure.subplots()
    parts = np.array([np.sort(balanced(scene, w).eigenvalues.real)[::-1] for w in SPEEDS])
    for column in parts.T:
        axes.plot(SPEEDS, column, ".", color="tab:blue", ms=2.5)
    at = thresholds[0]
    axes.axhline(0.0, color="0.4", lw=0.8)
    axes.axvline(at, color="tab:red", lw=1.0, ls="--", label=f"ours: {at:.4f}")
    axes.axvline(SETS[0][2], color="0.3", lw=1.2, ls=":", label=f"published: {SETS[0][2]}")
    axes.set_xlabel("Ω")
    axes.set_ylabel("real parts of eigenvalues / ω_n")
    axes.set_xlim(SPEEDS[0], SPEEDS[-1])
    axes.grid(alpha=0.3)
    axes.legend(loc="upper right", fontsize=9)
    picture = written(figure, folder, 2, caption)
    return PageSection("Where balance is lost: figure 2", text, (table,), (picture,))
