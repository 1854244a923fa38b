"""Figures 3 and 5: the resting states over the speed, and where runs settle among them."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ab_sim import Scene, equilibria
from ab_sim.results import RestingState
from gallery.page import PageSection, Picture, Table
from gallery.three_ball.drive import drive
from gallery.three_ball.settled import STARTS, at_rest_on_rotor, runs, settled
from gallery.three_ball.written import Tell, written

ZETA, ZETA_B = 0.05, 0.1
SPEEDS = np.linspace(0.02, 3.0, 299)
RUN_AT = np.arange(0.2, 3.01, 0.2)
PATTERNS = {
    "3+0": ("r11, r12: all three at θ", "tab:blue"),
    "2+1": ("r31, r32: two at θ, one opposite", "tab:orange"),
    "1+2": ("r41, r42: one at θ, two opposite", "tab:purple"),
    "0+3": ("r21, r22: all three opposite", "tab:brown"),
    "balanced": ("r = 0", "tab:green"),
}
"""Labels of the paper's cases, and the colours of their curves."""
MARKS = ("o", "^")


class Settled(NamedTuple):
    """Where a run ends up."""

    speed: float
    start: int
    whirl: float
    angles: tuple[float, ...]


def branches_section(folder: Path, tell: Tell) -> PageSection:
    """Figures 3 and 5, and the ranges of stability read off them."""
    pictures, rows = [], []
    for done, (number, eta) in enumerate(((3, 0.2), (5, 0.4))):
        tell(f"figure {number}", done, 2)
        scene = drive(eta, 3, ZETA, ZETA_B)
        states = [(float(w), state) for w in SPEEDS for state in equilibria(scene, w).branches]
        ends = _ends(scene)
        pictures.append(_drawn(folder, number, eta, states, ends))
        rows += _rows(number, eta, scene, states, ends)
    table = Table(
        f"What is stable, zeta = {ZETA:g}, zeta_B = {ZETA_B:g}",
        ("figure", "eta", "what", "published", "ours"),
        tuple(rows),
    )
    text = (
        "The eight radii (14)-(24) are four states listed twice: r12 = -r21, r22 = -r11, r32 = "
        "-r41, r42 = -r31. Each is shown once, with its positive radius. Solid curves are "
        "stable, dashed ones unstable. The formulas need atan2 in place of tan^-1.",
        "Speeds have a grid of 0.01. Marks show where runs from the paper's two starts settle, "
        f"at {len(RUN_AT)} speeds; runs that still move are not marked.",
        "r11 ends in a fold where (1 - Ω²)² = 4 (9 η² - 1) ζ² Ω². Between it and the threshold "
        "of r = 0 nothing is stable.",
    )
    return PageSection("Resting states: figures 3 and 5", text, (table,), tuple(pictures))


def _ends(scene: Scene) -> list[Settled]:
    starts = [(float(w), k) for w in RUN_AT for k in range(len(STARTS))]
    made = runs(scene, [at_rest_on_rotor(STARTS[k], w) for w, k in starts])
    found = []
    for (speed, start), trajectory in zip(starts, made, strict=True):
        end = settled(trajectory, scene)
        if end is not None:
            found.append(Settled(speed, start, *end))
    return found


def _rows(
    number: int,
    eta: float,
    scene: Scene,
    states: list[tuple[float, RestingState]],
    ends: list[Settled],
) -> list[tuple[str | float | None, ...]]:
    stable = {state.label for _, state in states if state.stable}
    others = sorted(x for x in stable if not x.startswith(("3+0", "balanced")))
    rows: list[tuple[str | float | None, ...]] = [
        (
            str(number),
            eta,
            "stable states except r11 and r = 0",
            "none",
            ", ".join(others) or "none",
        )
    ]
    upper = max(w for w, s in states if s.stable and s.label.startswith("3+0"))
    fold = _fold(eta)
    if fold is not None:
        rows.append((str(number), eta, "r11 stable up to", "about 0.9", upper))
        rows.append((str(number), eta, "its fold, closed form", None, fold))
        lowest = min(w for w, s in states if s.stable and s.label == "balanced")
        rows.append((str(number), eta, "r = 0 stable from", "about 1.42", lowest))
    off = [_nearest_off(scene, end) for end in ends]
    rows.append((str(number), eta, "runs that settle", None, f"{len(ends)} of {2 * len(RUN_AT)}"))
    rows.append(
        (str(number), eta, "farthest of them from a stable state, W/e", None, max(off, default=0.0))
    )
    return rows


def _nearest_off(scene: Scene, end: Settled) -> float:
    stable = equilibria(scene, end.speed).stable
    e = scene.rotor.eccentricity
    return min((abs(state.W / e - end.whirl) for state in stable), default=math.inf)


def _fold(eta: float) -> float | None:
    """Omega < 1 at which r11 ends: 1 - Omega^2 = 2 sqrt(9 eta^2 - 1) zeta Omega."""
    if 3.0 * eta <= 1.0:
        return None
    half = math.sqrt(9.0 * eta * eta - 1.0) * ZETA
    return math.hypot(half, 1.0) - half


def _drawn(
    folder: Path,
    number: int,
    eta: float,
    states: list[tuple[float, RestingState]],
    ends: list[Settled],
) -> Picture:
    figure = Figure(figsize=(9, 8), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    e = drive(eta).rotor.eccentricity
    labels = sorted(
        {s.label for _, s in states if "worst" not in s.label and "best" not in s.label}
    )
    for label in labels:
        colour = PATTERNS[label.partition("/")[0]][1]
        mine = {w: s for w, s in states if s.label == label}
        for stable, style in ((True, "-"), (False, "--")):
            held = [mine.get(float(w)) for w in SPEEDS]
            shown = [s if s is not None and bool(s.stable) is stable else None for s in held]
            whirl = [math.nan if s is None else s.W / e for s in shown]
            above.plot(SPEEDS, whirl, color=colour, ls=style, lw=1.8 if stable else 1.0)
            if label != "balanced":
                _angles(below, shown, colour, style, 1.8 if stable else 1.0)
    for end in ends:
        mark = {"marker": MARKS[end.start], "mfc": "none", "mec": "k", "ms": 6, "ls": ""}
        above.plot(end.speed, end.whirl, **mark)
        for angle in end.angles:
            below.plot(end.speed, math.degrees(angle) % 360.0, **mark)
    above.set_ylabel("r = W/e")
    above.set_ylim(-0.15, 6)
    below.set_ylabel("ball angles [deg]; curves: where most balls are")
    below.set_ylim(0, 360)
    below.set_yticks(range(0, 361, 60))
    below.set_xlabel("Ω")
    below.set_xlim(0, 3)
    for axes in (above, below):
        axes.grid(alpha=0.3)
    there = {label.partition("/")[0] for label in labels}
    lines = [Line2D([], [], color=c, label=x) for p, (x, c) in PATTERNS.items() if p in there]
    marks = [
        Line2D([], [], marker=m, mfc="none", mec="k", ls="", label=f"a run from start {k + 1}")
        for k, m in enumerate(MARKS)
    ]
    above.legend(handles=[*lines, *marks], fontsize=8, loc="upper right")
    caption = f"resting states over the speed, eta = {eta:g}, zeta = {ZETA:g}, zeta_B = {ZETA_B:g}"
    return written(figure, folder, number, caption)


def _angles(
    axes: Axes, states: list[RestingState | None], colour: str, style: str, width: float
) -> None:
    """The place of the larger group of balls, the paper's beta."""
    found = [math.nan if state is None else _majority(state.theta) for state in states]
    jumps = np.abs(np.diff(found)) > 180.0
    values = np.array(found)
    values[1:][jumps] = math.nan
    axes.plot(SPEEDS, values, color=colour, ls=style, lw=width)


def _majority(theta: np.ndarray) -> float:
    """[deg]: of balls at one place and opposite, the sum of whose directions is the majority's."""
    return math.degrees(np.angle(np.exp(1j * theta).sum())) % 360.0
