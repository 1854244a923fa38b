"""Figures 4 to 7: where the balanced deck is stable, over the speed and one parameter each."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ab_sim import Scene
from ab_sim.analysis.floquet import STARTS, TurnMap, largest_of
from ab_sim.analysis.result_cache import ResultCache
from gallery.deck_3d.case import (
    SPEEDS,
    DeckParameters,
    Tell,
    deck_of,
    least_radius,
    mark_frequencies,
    written,
)
from gallery.page import PageSection

OVER = np.linspace(100.0, 500.0, 81)
"""Spindle speeds [rad/s]."""
ROWS = 21


class Map(NamedTuple):
    """One of the figures."""

    number: int
    key: str
    """Of the parameters."""
    values: np.ndarray
    label: str
    logarithmic: bool = False


MAPS = (
    Map(4, "c", np.geomspace(0.02, 1.2, ROWS), "c, damping of a mount [N s/m]", True),
    Map(5, "d", np.linspace(0.0, 0.06, ROWS), "d, plate's centre to spindle [m]"),
    Map(6, "R", np.linspace(0.0238, 0.045, ROWS), "R, radius of the race [m]"),
    Map(7, "D", np.geomspace(1e-6, 1e-4, ROWS), "D, drag of a ball [N m s]", True),
)


def map_section(folder: Path, tell: Tell) -> PageSection:
    """The four maps, and whether the published verdicts hold all over them."""
    figure = Figure(figsize=(12.0, 9.0), layout="constrained")
    figure.suptitle("Balanced deck: stable (shaded) over spindle speed and one parameter each")
    for panel, each in zip(figure.subplots(2, 2).flat, MAPS, strict=True):
        _draw(panel, each, _rows(each, tell))
    caption = (
        "Figures 4 to 7: where the largest modulus of a multiplier of the balanced deck is below 1 "
        "(shaded); dotted: the six published natural frequencies; crosses: our parameters at the "
        "speeds that the paper judges; hatched: the balls are too light to balance"
    )
    text = (
        "The paper varies the damping c of a mount, the distance d from the plate's centre to "
        "the spindle, the race radius R and the drag D of a ball; its ranges are not printed, "
        "ours are wider. The disc's inertia changes with R, as in (9). Below R = M eps / (n m) "
        "two balls cannot balance.",
        "As published, the border lies just above the translational frequencies, and d hardly "
        "moves it. Less damping c or drag D, however, raises it by tens of rad/s. With c below "
        ".1 N s/m the balance is unstable around the rotational frequency 335 rad/s, which the "
        "paper excludes.",
    )
    return PageSection(
        "Stability over four parameters: figures 4 to 7", text, (),
        (written(figure, folder, "maps", caption),),
    )  # fmt: skip


def _rows(each: Map, tell: Tell) -> np.ndarray:
    """Largest moduli, shape (values, speeds)."""
    found = []
    for k, value in enumerate(each.values.tolist()):
        tell(f"figure {each.number}", k, len(each.values))
        scene = deck_of(DeckParameters(**{each.key: value}))
        row = ResultCache(balanced_moduli).of(scene, speeds=OVER.tolist())
        found.append([np.nan if x is None else x for x in row["largest"]])
    return np.array(found)


def balanced_moduli(scene: Scene, speeds: list[float]) -> dict[str, Any]:
    """The largest modulus of the balanced deck's multipliers at each speed [rad/s]."""
    largest: list[float | None] = []
    # Where balls balance is the same at any speed.
    guess = STARTS["balanced"](TurnMap(scene, speeds[0]))
    for speed in speeds:
        turn = TurnMap(scene, speed)
        orbit = turn.shoot(guess)
        largest.append(None if orbit is None else largest_of(turn, orbit))
    return {"largest": largest}


def _draw(axes: Axes, each: Map, moduli: np.ndarray) -> None:
    axes.contourf(OVER, each.values, moduli, levels=[0.0, 1.0], colors=["tab:green"], alpha=0.25)
    axes.contour(OVER, each.values, moduli, levels=[1.0], colors=["k"], linewidths=1.0)
    if each.key == "R":
        axes.axhspan(0.02, least_radius(), hatch="///", fc="0.9", ec="0.6", lw=0)
    if each.logarithmic:
        axes.set_yscale("log")
    mark_frequencies(axes)
    usual = getattr(DeckParameters(), each.key)
    axes.plot(SPEEDS, [usual] * len(SPEEDS), "kx", ms=5)
    axes.set_title(f"Figure {each.number}: over {each.key}", fontsize=10)
    axes.set_xlabel("spindle speed [rad/s]")
    axes.set_ylabel(each.label)
    axes.set_xlim(OVER[0], OVER[-1])
    axes.set_ylim(0.02 if each.key == "R" else each.values[0], each.values[-1])
