"""The text beside the pictures: what they show."""

from __future__ import annotations

import numpy as np

from ab_sim.conventions import NOTATION
from ab_sim.recording.drawing import Drawing
from ab_sim.recording.explanation import Explanation


def legend_text(drawing: Drawing) -> str:
    """The text beside the pictures, in Markdown."""
    explained = drawing.explained
    parts = [
        f"**{_balls_text(drawing.balls)}** on a race of radius R = {drawing.race:g} mm; "
        f"eccentricity e = {drawing.eccentricity:g} mm.",
        f"**In space**: {_space_text(drawing)}; blue, the deck; dark, where it would be at rest.",
        *_balance_text(explained),
        *_arrows_text(drawing),
        *_without_balls_text(explained),
        "**Vibration**: red, what comes once per revolution (unbalance); blue, the "
        "rest; orange, all. Its spectrum is on the next page.",
        f"{NOTATION}.",
    ]
    return "\n\n".join(parts) + "\n"


def _space_text(drawing: Drawing) -> str:
    what = "displacement and tilt" if drawing.tilts else "displacement"
    times = drawing.space.factor
    return f"{what} {'to scale' if times == 1.0 else f'{times:g} times as large as they are'}"


def _balls_text(count: int) -> str:
    return {0: "No balls", 1: "1 ball"}.get(count, f"{count} balls")


def _arrows_text(drawing: Drawing) -> list[str]:
    if drawing.top.arrows is None:
        return ["Red: the unbalance."]
    if not drawing.balls:
        return ["**Arrow**: the unbalance M0 e."]
    return [
        "**Arrows**: red, the rotor's unbalance M0 e; green, from its tip on, the balls' sum "
        "of m R; white, the *residual unbalance*, their sum: none when balanced. Balls in the same "
        "place are drawn in different sizes, in space on top of each other."
    ]


def _balance_text(explained: Explanation) -> list[str]:
    balance = explained.balance
    if balance is None:
        why = explained.left_out.get("balance")
        return [f"No balanced positions are marked: {why}."] if why else []
    turned = (-np.remainder(-np.degrees(balance.angles), 360.0)).tolist()
    angles = sorted({round(angle, 1) for angle in turned})
    places = ", ".join(f"{angle:g}" for angle in angles) + " deg"
    if balance.residual > 0.0 and explained.unbalance:
        share = 100.0 * balance.residual / explained.unbalance
        whose = "This ball" if len(balance.angles) == 1 else "These balls"
        return [
            f"**{whose} cannot balance it**: yellow rings mark the best place ({places}), which "
            f"leaves {share:.3g} % of the unbalance."
        ]
    if balance.residual > 0.0:
        return ["**A rotor without unbalance**: a ball can only make it worse."]
    many = " This is one of many positions that balance." if balance.many else ""
    return [f"**Yellow rings**: where the balls balance the rotor ({places}).{many}"]


def _without_balls_text(explained: Explanation) -> list[str]:
    if explained.alone is not None:
        return [
            "**Whirl**: grey, what it would be without balls if the speed were held; near the "
            "critical speed a run-up does not get as far."
        ]
    why = explained.left_out.get("alone")
    return [f"Whirl without balls is not drawn: {why}."] if why else []
