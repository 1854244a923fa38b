"""What the paper says in numbers: frequencies, balanced angle, verdicts; and where it ends."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ab_sim import Scene
from ab_sim.analysis.floquet import Followed, follow, solutions_of
from ab_sim.analysis.modes import vibration_of
from ab_sim.analysis.result_cache import ResultCache
from ab_sim.show.multipliers import draw_modulus_curve
from gallery.deck_3d.case import (
    PUBLISHED,
    ROTATION,
    SPEEDS,
    TRANSLATION,
    DeckParameters,
    Tell,
    deck_of,
    mark_frequencies,
    written,
)
from gallery.page import PageSection, Table

DAMPINGS = (0.6, 0.2, 0.1, 0.05)
"""Of a mount [N s/m]."""
COUNTS = (1, 2, 3, 4)
"""Balls, of the same mass together."""
WORDS = {True: "stable", False: "unstable", None: "undecided"}


def verdict_section(folder: Path, tell: Tell) -> PageSection:
    """Frequencies, the balanced angle, and stability at the speeds that are judged."""
    scene = deck_of(DeckParameters())
    modes = vibration_of(scene).modes
    named = zip((*TRANSLATION, *ROTATION), (mode.frequency for mode in modes), strict=True)
    frequencies = Table(
        "Natural frequencies, balls and disc averaged over a turn",
        ("published [rad/s]", "ours [rad/s]"),
        tuple(named),
    )
    rows = []
    for k, speed in enumerate(SPEEDS):
        tell("stability at the published speeds", k, len(SPEEDS))
        (found,) = solutions_of(scene, speed, "balanced")
        rows.append((speed, WORDS[PUBLISHED[speed]], WORDS[found.stable], found.largest))
    verdicts = Table(
        "Stability of the balanced deck",
        ("speed [rad/s]", "published", "ours", "largest modulus"),
        tuple(rows),
        9,
    )
    angle = math.degrees(abs(found.angles[0]))
    text = (
        f"The balanced angle (21) is +-{angle:.4f} deg; published: +-142.3 deg. All eight "
        "published verdicts are reproduced. Multipliers are those of the deck's 16 coordinates "
        "over one revolution; the paper prints none.",
    )
    return PageSection("Frequencies and verdicts", text, (frequencies, verdicts))


def border_section(folder: Path, tell: Tell) -> PageSection:
    """Where balance becomes stable, over damping and the number of balls."""
    figure = Figure(figsize=(11.0, 12.0), layout="constrained")
    figure.suptitle("Largest modulus of a multiplier over spindle speed")
    panels = figure.subplots(4, 2, sharex=True)
    cases = [(f"c = {c:g} N s/m, 2 balls", DeckParameters(c=c)) for c in DAMPINGS]
    cases += [
        (f"{n} ball{'s' if n > 1 else ''} of {4e-4 / n:.3g} kg, c = .6", DeckParameters(n=n))
        for n in COUNTS
    ]
    rows: list[tuple[Any, ...]] = []
    for k, (panel, (title, p)) in enumerate(zip(panels.T.flat, cases, strict=True)):
        tell("borders", k, len(cases))
        followed = over_speed(deck_of(p))
        draw_modulus_curve(panel, followed)
        mark_frequencies(panel)
        panel.set_title(title, fontsize=10)
        panel.set_xlim(100.0, 500.0)
        borders = ", ".join(
            f"{border.value:.6f} ({'un' if border.stable_below else ''}stable above)"
            for border in sorted(followed.borders, key=lambda border: border.value)
        )
        fastest = followed.points[0].solution
        whirl = "-" if fastest is None else f"{1e6 * fastest.whirl_max:.3g}"
        rows.append((title, borders or "none", whirl))
    for panel in panels[-1]:
        panel.set_xlabel("spindle speed [rad/s]")
    caption = (
        "Left: over the mounts' damping; right: over the number of balls, which have the same mass "
        "together. Shaded: stable; dotted: the published natural frequencies"
    )
    least = ResultCache(least_dampings).of(deck_of(DeckParameters()), speeds=[*ROTATION, 500.0])
    lowest = Table(
        "Damping of a mount below which the balance is not stable; -: stable from .6 to .002",
        ("speed [rad/s]", "c [N s/m]"),
        tuple((speed, c) for speed, c in zip((*ROTATION, 500.0), least["c"], strict=True)),
    )
    text = (
        "The paper concludes that the rotational frequencies never matter. With low damping "
        "they do: the table gives the damping at which the largest modulus crosses 1 as c "
        "falls from .6 to .002. The growing motion is in the plane, without tilt.",
        "One ball of the same mass is too heavy to balance this rotor and leaves a whirl. "
        "Three and four balls have a manifold of balanced positions; the table judges the one "
        "with the most evenly spread balls.",
    )
    names = "case", "borders [rad/s]", "whirl at 500 rad/s [um]"
    table = Table("Borders from 100 to 500 rad/s", names, tuple(rows))
    return PageSection(
        "Where the balance becomes stable", text, (table, lowest),
        (written(figure, folder, "borders", caption),),
    )  # fmt: skip


def over_speed(scene: Scene) -> Followed:
    """The balanced solution from 500 to 100 rad/s; of one ball the one nearest to balance."""
    speeds = np.linspace(500.0, 100.0, 81).tolist()
    return follow("speed", lambda speed: (scene, speed), speeds, ["balanced"])


def least_dampings(scene: Scene, speeds: list[float]) -> dict[str, Any]:
    """Damping of the mounts below which the balanced deck is unstable at each speed [N s/m].

    None where it is stable from 0.6 down to .002. The scene itself is the paper's.
    """

    def least(speed: float) -> float | None:
        def case(c: float) -> tuple[Scene, float]:
            return deck_of(DeckParameters(c=c)), speed

        followed = follow("c", case, np.geomspace(0.6, 0.002, 12).tolist(), ["balanced"])
        return max((border.value for border in followed.borders), default=None)

    return {"c": [least(speed) for speed in speeds]}
