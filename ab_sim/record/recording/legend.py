"""Text next to the drawings of a recording."""

from __future__ import annotations

import numpy as np

from ab_sim.base.presentation import NOTATION, in_one_turn
from ab_sim.record.recording.drawing import Drawing
from ab_sim.record.recording.explanation import Explanation
from ab_sim.record.recording.signals import Final


def legend_text(drawing: Drawing, final: Final | None, alone: Final | None) -> str:
    """Return the text next to the drawings, in Markdown.

    Args:
        drawing: drawing of the drive.
        final: final whirl [m]; None if unknown.
        alone: final whirl of the drive without balls [m]; None if unknown.
    """
    explained = drawing.explained
    parts = [
        *_final_text(drawing, final, alone),
        "**Play**: space. For a tenth of the speed, click 1.00x below and type 0.1; in a narrow "
        "window show the time panel first, by its button at the top.",
        f"**{_balls_text(drawing.balls)}**, R = {drawing.race:g} mm, e = "
        f"{drawing.eccentricity:g} mm. {_space_text(drawing)}; grey: the deck at rest.",
        *_arrows_text(drawing),
        *_balance_text(explained),
        *_without_balls_text(explained),
        f"{NOTATION}.",
    ]
    return "\n\n".join(parts) + "\n"


def _final_text(drawing: Drawing, final: Final | None, alone: Final | None) -> list[str]:
    if final is None:
        return []
    e = 1e-3 * drawing.eccentricity
    text = f"W/e = {final.rms / e:.3g}" if e else f"W = {1e3 * final.rms:.3g} mm"
    share = f", {final.rms / alone.rms:.3g} times that without balls" if alone and alone.rms else ""
    return [f"**At the end**: {text}{share} (r.m.s. from {final.begin:.4g} to {final.end:.4g} s)."]


def _space_text(drawing: Drawing) -> str:
    what = "displacement and tilt" if drawing.tilts else "displacement"
    times = drawing.space.factor
    return f"In space: {what} {'to scale' if times == 1.0 else f'{times:g} times as large'}"


def _balls_text(count: int) -> str:
    return {0: "No balls", 1: "1 ball"}.get(count, f"{count} balls")


def _arrows_text(drawing: Drawing) -> list[str]:
    if drawing.top.arrows is None:
        return ["Red: the unbalance."]
    if not drawing.balls:
        return ["**Arrow**: the unbalance M0 e."]
    return [
        "**Arrows**: red, the unbalance M0 e; green, from its tip, the balls' sum of m R; blue, "
        "their sum, the residual unbalance. Balls at one place are drawn in different sizes."
    ]


def _balance_text(explained: Explanation) -> list[str]:
    balance = explained.balance
    if balance is None:
        why = explained.left_out.get("balance")
        return [f"No balanced positions are marked: {why}."] if why else []
    turned = np.degrees(in_one_turn(np.array(balance.angles))).tolist()
    angles = sorted({round(angle, 1) for angle in turned})
    places = ", ".join(f"{angle:g}" for angle in angles) + " deg"
    if balance.residual > 0.0 and explained.unbalance:
        share = 100.0 * balance.residual / explained.unbalance
        whose = "This ball" if len(balance.angles) == 1 else "These balls"
        return [
            f"**{whose} cannot balance the rotor**: green rings mark the best place ({places}), "
            f"which leaves {share:.3g} % of the unbalance."
        ]
    if balance.residual > 0.0:
        return ["**A rotor without unbalance**: a ball can only make it worse."]
    many = " This is one of many positions that balance." if balance.many else ""
    return [f"**Rings**: positions in which the balls balance the rotor ({places}).{many}"]


def _without_balls_text(explained: Explanation) -> list[str]:
    if explained.alone is not None:
        return ["**Whirl**: grey, the same drive without balls, at this run's speed."]
    why = explained.left_out.get("alone")
    return [f"Whirl without balls is not drawn: {why}."] if why else []
