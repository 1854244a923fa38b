"""Chapter 5: why the balls go so far, and whether they rest where they are said to be stable."""

import math

import numpy as np

from ab_sim import equilibria
from gallery.thesis.claims import ABOUT, Claim
from gallery.thesis.drive import HOLD, THESIS, Period, start_ups
from gallery.thesis.measures import pushed

HALF = 0.5
"""A reason explains at least so much of a change's logarithm; ours."""
END_SPEED = 200.0
"""Of the figures' start-ups, 2.5 s after the critical speed [rad/s]."""


def moved_claims(figure: str, period: Period | None) -> list[Claim]:
    """That drag makes balls difficult to move, and mass easy (5.5, 5.11)."""
    sets = THESIS, THESIS._replace(c_b=2.0 * THESIS.c_b), THESIS._replace(m=2.0 * THESIS.m)
    one, dragged, heavy = runs = start_ups([(p, period) for p in sets])
    ways = [-float(run.angles.mean()) for run in runs]
    pushes = [pushed(run) for run in runs]
    share = math.log(0.5) / math.log(ways[1] / ways[0])
    easier = (ways[2] / ways[0]) / (pushes[2] / pushes[0])
    return [
        Claim(
            figure, "the larger c_b the less far: the balls become difficult to move",
            f"twice c_b: {ways[1]:.0f} in place of {ways[0]:.0f} deg, of which half the way for "
            f"the same force explains {share:.0%}, {pushes[1] / pushes[0]:.2f} times the force's "
            f"integral the rest (ours: {HALF:.0%})", share >= HALF,
        ),
        Claim(
            figure, "the larger m, the farther they go: the balls become easy to move",
            f"2 g: {ways[2]:.0f} in place of {ways[0]:.0f} deg, by {pushes[2] / pushes[0]:.2f} "
            f"times the force's integral; for the same integral {easier:.2f} times as far (ours: "
            f"{ABOUT:.0%} farther)", easier >= 1.0 + ABOUT,
            "the force is larger; drag, not mass, decides how easily they move",
        ),
    ]  # fmt: skip


def stable_claim() -> Claim:
    """That odd multiples of -180 deg, such as -900 deg, are stable positions (5.8, chapter 7)."""
    (run,) = start_ups([(THESIS, HOLD)])
    states = equilibria(run.scene, END_SPEED).branches
    angles = [np.abs(np.degrees(state.theta)) for state in states]
    ((there, where),) = [
        (state, float(theta.min())) for state, theta in zip(states, angles, strict=True)
        if np.all(theta > 170.0)
    ]  # fmt: skip
    rest = [theta for state, theta in zip(states, angles, strict=True) if state.stable]
    return Claim(
        "5.8, chapter 7", "odd multiples of -180 deg are stable positions",
        f"both at {where:.1f} deg, at {END_SPEED:g} rad/s: what disturbs them grows by "
        f"{there.lambda_max:.2f} 1/s; stable is +-{rest[0].min():.1f} deg (ours: it falls)",
        bool(there.stable), "1 g is too heavy: see figure 4.7",
    )  # fmt: skip
