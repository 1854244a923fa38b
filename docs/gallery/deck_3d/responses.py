"""Figures 8 to 13: runs at a held speed, with balls and without."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ab_sim import Scene
from ab_sim.analysis import run_scene, without_balls
from ab_sim.scene.load import changed_scene
from ab_sim.show.curves import draw_curve
from gallery.deck_3d.case import PUBLISHED, DeckParameters, Tell, deck_of, written
from gallery.page import PageSection, Table

FIGURES = {8: 130.0, 9: 179.0, 10: 325.0, 11: 335.0, 12: 347.0, 13: 500.0}
"""Speeds [rad/s]."""
START = (1.0, -2.0)
"""Where balls start [rad]; the paper does not say. The deck is at rest."""
DURATION = 4.0
LAST = 0.1
"""Share of a run that its end is."""


class DeckResponse(NamedTuple):
    """A run."""

    time: np.ndarray
    vibration: np.ndarray
    """VQ = |(X, Y, Z)| (27) [m]."""
    angles: np.ndarray
    """Of the balls [rad], shape (samples, balls)."""

    @property
    def final(self) -> float:
        """Root mean square of VQ at its end [m]."""
        end = self.vibration[-int(LAST * len(self.vibration)) :]
        return float(np.sqrt(np.mean(end**2)))


def response_section(folder: Path, tell: Tell) -> PageSection:
    """The time responses, and what becomes of the vibration."""
    figure = Figure(figsize=(12.0, 15.0), layout="constrained")
    figure.suptitle("Held speed, from rest: vibration VQ and ball angles from the unbalance")
    panels = figure.subplots(len(FIGURES), 2, sharex=True)
    rows = []
    for k, (number, speed) in enumerate(FIGURES.items()):
        tell("time responses", k, len(FIGURES))
        scene = started(speed)
        balls, bare = response(scene), response(without_balls(scene))
        _draw(panels[k], number, speed, balls, bare)
        ratio = balls.final / bare.final
        ends = ", ".join(f"{math.degrees(angle):.1f}" for angle in _ends(balls))
        published = "balanced" if PUBLISHED[speed] else "not balanced"
        ours = "balanced" if ratio < 1e-3 else "not balanced"
        rows.append((number, speed, published, ours, 1e6 * bare.final, 1e6 * balls.final, ends))
    for panel in panels[-1]:
        panel.set_xlabel("time [s]")
    names = (
        *("figure", "speed [rad/s]", "published", "ours", "VQ without balls [um]"),
        *("VQ with balls [um]", "balls at the end [deg]"),
    )
    table = Table(
        f"Vibration in the last tenth of {DURATION:g} s, root mean square", names, tuple(rows), 4
    )
    text = (
        "The paper does not state start and duration. Here the deck starts at rest, the speed is "
        f"constant, and the balls start at {START[0]:g} and {START[1]:g} rad. The results "
        "agree: at 130 rad/s the balls add to the unbalance, at 179 rad/s they find no rest, "
        "above they balance. VQ is |(X, Y, Z)|, equation (27).",
    )
    caption = "Figures 8 to 13: left VQ with (blue) and without balls (grey); right the balls"
    return PageSection(
        "Time responses: figures 8 to 13", text, (table,),
        (written(figure, folder, "responses", caption),),
    )  # fmt: skip


def started(speed: float) -> Scene:
    """The deck at rest at a held speed [rad/s]."""
    changes = {
        "start.speed": speed, "start.ball_angles": [*START], "solver.step": 5e-4,
        "duration": DURATION,
    }  # fmt: skip
    return changed_scene(deck_of(DeckParameters()), changes, "time response")


def response(scene: Scene) -> DeckResponse:
    """A run of a scene."""
    run = run_scene(scene).trajectory
    return DeckResponse(run["time"], np.linalg.norm(run.position, axis=1), run.ball_angles)


def _ends(balls: DeckResponse) -> np.ndarray:
    """The balls' last angles, within +-pi [rad]."""
    last = balls.angles[-1]
    return np.asarray(last - 2.0 * math.pi * np.round(last / (2.0 * math.pi)))


def _draw(
    panels: tuple[Axes, Axes], number: int, speed: float, balls: DeckResponse, bare: DeckResponse
) -> None:
    left, right = panels
    draw_curve(left, bare.time, 1e6 * bare.vibration, color="0.6", lw=1.0, label="without balls")
    draw_curve(
        left, balls.time, 1e6 * balls.vibration, color="tab:blue", lw=1.0, label="with balls"
    )
    left.set_ylabel("VQ [um]")
    left.set_ylim(0.0, 1.3e6 * float(max(balls.vibration.max(), bare.vibration.max())))
    left.set_title(f"Figure {number}: {speed:g} rad/s", fontsize=10, loc="left")
    left.legend(fontsize=8, loc="upper right")
    for k, color in enumerate(("tab:blue", "tab:red")):
        angle = np.degrees(balls.angles[:, k])
        right.plot(balls.time, angle, color=color, lw=1.0)
    if np.ptp(np.degrees(balls.angles)) < 720.0:
        for opposite in (-217.7, -142.3, 142.3, 217.7):
            right.axhline(opposite, color="0.4", lw=0.8, ls=":")
    right.set_ylabel("ball angles [deg]")
    right.grid(alpha=0.3)
    left.grid(alpha=0.3)
