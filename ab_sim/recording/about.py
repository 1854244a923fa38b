"""What is seen, in a few words."""

from __future__ import annotations

import numpy as np

from ab_sim.recording.drawing import Drawing
from ab_sim.recording.explained import Explained


def about(drawing: Drawing) -> str:
    """The text beside the pictures, in Markdown."""
    said = drawing.explained
    parts = [
        f"**{_balls(drawing.balls)}** on a race of radius R = {drawing.race:g} mm; "
        f"eccentricity e = {drawing.eccentricity:g} mm.",
        *_balance(said),
        *_arrows(drawing),
        *_alone(said),
        "**Vibration**: orange, what comes once per revolution (unbalance); blue, all the rest. "
        "Its spectrum is on the next page.",
    ]
    return "\n\n".join(parts) + "\n"


def _balls(count: int) -> str:
    return {0: "No balls", 1: "1 ball"}.get(count, f"{count} balls")


def _arrows(drawing: Drawing) -> list[str]:
    if drawing.top.arrows is None:
        return ["Orange: the unbalance."]
    if not drawing.balls:
        return ["**Arrow**: the unbalance M0 e."]
    return [
        "**Arrows**: orange, the rotor's unbalance M0 e; green, from its tip on, the balls' sum "
        "of m R; white, the *residual unbalance*, their sum: none when balanced. Balls in the same "
        "place are drawn in different sizes, in space on top of each other."
    ]


def _balance(said: Explained) -> list[str]:
    balance = said.balance
    if balance is None:
        why = said.left_out.get("balance")
        return [f"No balanced positions are marked: {why}."] if why else []
    turned = (-np.remainder(-np.degrees(balance.angles), 360.0)).tolist()
    angles = sorted({round(angle, 1) for angle in turned})
    places = ", ".join(f"{angle:g}" for angle in angles) + " deg"
    if balance.residual > 0.0 and said.unbalance:
        share = 100.0 * balance.residual / said.unbalance
        return [
            f"**These balls cannot balance it**: green rings mark the best they can do ({places}), "
            f"which leaves {share:.3g} % of the unbalance."
        ]
    if balance.residual > 0.0:
        return ["**A rotor without unbalance**: these balls can only make it worse."]
    many = " This is one of many positions that balance." if balance.many else ""
    return [f"**Green rings**: where the balls balance the rotor ({places}).{many}"]


def _alone(said: Explained) -> list[str]:
    if said.alone is not None:
        return [
            "**Whirl**: grey, what it would be without balls if the speed were held; near the "
            "critical speed a run-up does not get as far."
        ]
    why = said.left_out.get("alone")
    return [f"Whirl without balls is not drawn: {why}."] if why else []
