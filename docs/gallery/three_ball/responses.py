"""Figures 6 and 8: responses over time."""

import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ab_sim import Scene, Trajectory
from ab_sim.scene.load import changed_scene
from gallery.page import Cell, PageSection, Table
from gallery.three_ball.drive import drive
from gallery.three_ball.growth import WORST, balanced, threshold
from gallery.three_ball.settled import STARTS, at_rest_on_rotor, runs
from gallery.three_ball.written import Tell, written

TWO_PLACES = (0.4, 2.0, 0.05, 0.1)
"""Figure 6: eta, Omega; zeta, zeta_B as figure 5 needs them."""
TOTAL, ZETA, ZETA_B = 1.2, 0.5, 0.1
"""Figure 8: what is known of point B, and the zeta chosen for it."""
SHOWN = 300.0
"""Of figure 6, [1/w_n]."""
LONG = 3000.0
"""Of figure 8, [1/w_n]: both balancers are near their thresholds."""


def two_places_section(folder: Path, tell: Tell) -> PageSection:
    """Figure 6: two starts that end balanced, with the balls elsewhere."""
    tell("figure 6", 0, 1)
    eta, speed, zeta, zeta_b = TWO_PLACES
    scene = drive(eta, 3, zeta, zeta_b)
    found = runs(scene, [at_rest_on_rotor(start, speed) for start in STARTS], every=1)
    figure = Figure(figsize=(11, 6), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    rows: list[tuple[Cell, ...]] = []
    for k, (run, (above, below)) in enumerate(zip(found, panels.T, strict=True)):
        time, whirl = run["time"], run.whirl / scene.rotor.eccentricity
        above.plot(time, whirl, color="tab:red", lw=1.0)
        above.set_title("start " + ", ".join(f"{a:g}π" for a in STARTS[k]), fontsize=11)
        below.plot(time, np.degrees(run.ball_angles), lw=1.2)
        below.set_xlabel("t ω_n")
        below.set_xlim(0, SHOWN)
        last = run.ball_angles[-1]
        turned = sorted(math.degrees(x) % 360.0 for x in last)
        left = float(abs(1.0 + eta * np.exp(1j * last).sum()))
        rows.append((k + 1, ", ".join(f"{x:.1f}" for x in turned), left, float(whirl[-1])))
        for axes in (above, below):
            axes.grid(alpha=0.3)
    panels[0, 0].set_ylabel("r = W/e")
    panels[1, 0].set_ylabel("ball angles [deg]")
    table = Table(
        "Where the two runs end",
        ("start", "ball angles [deg]", "residual unbalance / (m_d e)", "W/e"),
        tuple(rows),
        3,
    )
    text = (
        "As published, both starts end balanced with the balls at different positions. The "
        "published positions are not printed.",
    )
    caption = f"two starts at eta = {eta:g}, Ω = {speed:g}, zeta = {zeta:g}, zeta_B = {zeta_b:g}"
    picture = written(figure, folder, 6, caption)
    return PageSection("Two starts, two places: figure 6", text, (table,), (picture,))


def point_b() -> float:
    """Omega between the thresholds of two balls and of three at their worst position."""
    two = threshold(drive(TOTAL / 2, 2, ZETA, ZETA_B))
    three = threshold(drive(TOTAL / 3, 3, ZETA, ZETA_B), WORST)
    return 0.5 * (two + three)


def point_b_section(folder: Path, tell: Tell) -> PageSection:
    """Figure 8: at a point where three balls hold the balance and two do not."""
    tell("figure 8", 0, 1)
    speed = point_b()
    figure = Figure(figsize=(11, 4.4), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    rows: list[tuple[Cell, ...]] = []
    for n, axes in zip((2, 3), panels, strict=True):
        scene = changed_scene(
            drive(TOTAL / n, n, ZETA, ZETA_B), {"duration": LONG, "solver.step": 0.02}, "figure 8"
        )
        run = runs(scene, [_beside(scene, speed)])[0]
        whirl = run.whirl / scene.rotor.eccentricity
        axes.plot(run["time"], whirl, color="tab:red", lw=0.8)
        axes.set_title(f"{n} balls", fontsize=11)
        axes.set_xlabel("t ω_n")
        axes.grid(alpha=0.3)
        growth = balanced(scene, speed, WORST).lambda_max
        rows.append((n, growth, _mean(run, whirl, 0.0, 0.1), _mean(run, whirl, 0.9, 1.0)))
    panels[0].set_ylabel("r = W/e")
    table = Table(
        f"At zeta = {ZETA:g}, Omega = {speed:.4f}",
        ("balls", "largest real part / w_n, worst position", "W/e, first tenth", "last tenth"),
        tuple(rows),
        3,
    )
    text = (
        "The paper does not print point B. Here it is at zeta = 0.5, midway between the "
        "thresholds of two balls and of three at their worst position. Both runs start 0.2 rad "
        "from a balanced position: two balls keep whirling, three balance.",
    )
    caption = f"whirl near balance, eta_total = {TOTAL:g}, zeta_B = {ZETA_B:g}, at our point B"
    picture = written(figure, folder, 8, caption)
    return PageSection("Point B: figure 8", text, (table,), (picture,))


def _beside(scene: Scene, speed: float) -> dict[str, object]:
    """A start near the symmetric balanced position, one ball moved by 0.2 rad."""
    angles = balanced(scene, speed).theta.copy()
    angles[0] += 0.2
    return {"start.speed": speed, "start.ball_angles": angles.tolist()}


def _mean(run: Trajectory, whirl: np.ndarray, first: float, last: float) -> float:
    """Root mean square over a stretch of the run."""
    k = len(run["time"])
    return float(np.sqrt(np.mean(whirl[int(first * k) : int(last * k)] ** 2)))
