"""What is left of the unbalance: with the thesis' balls, and with those that match the disc."""

import numpy as np

from gallery.page import Cell, Table
from gallery.thesis.claims import BALANCED, MUCH, Claim, degrees, opposite
from gallery.thesis.drive import HOLD, THESIS, Parameters, Period, StartUp, Tell, start_ups
from gallery.thesis.many import End, ends

SETTLED_AFTER = 14.0
"""A start-up to 200 rad/s has come to rest [s]."""
NOT_GONE = (
    f"with this set two balls at -180 deg leave {THESIS.carried - 1:.2f} of the disc's unbalance, "
    f"because 2 m R is {THESIS.carried:.2f} times M0 e; balance is at "
    f"+-{np.degrees(np.arccos(-1 / THESIS.carried)):.1f} deg"
)


def suppresses(tell: Tell) -> Claim:
    """What chapter 7 says of vibration at a high speed."""
    _, held, _, light = _matched(tell)[1]
    return suppressed_claim(held.final_whirl, light.final_whirl)


def _matched(tell: Tell) -> tuple[list[tuple[Parameters, Period | None]], list[End]]:
    """The thesis' balls and those that match the disc, without and with the hold, at rest."""
    own = 0.5 * THESIS.M * THESIS.e / (THESIS.R + THESIS.e)
    light = THESIS._replace(m=own, c_b=own / THESIS.m * THESIS.c_b)
    cases = [(p, period) for p in (THESIS, light) for period in (None, HOLD)]
    return cases, ends("balls that match", cases, tell, 200.0, SETTLED_AFTER)


def matched_table(tell: Tell) -> Table:
    """Balls of which two at -180 deg do balance, beside the thesis' own; not its statement."""
    cases, settled = _matched(tell)
    rows: list[tuple[Cell, ...]] = [
        (
            f"{1e3 * run.parameters.m:.3g} g, {run.parameters.c_b:.2g} N s/m",
            "none" if run.period is None else "hold of 0.5 s", degrees(run.angles),
            run.residual, end.final_whirl,
        )
        for run, end in zip(start_ups(cases), settled, strict=True)
    ]  # fmt: skip
    return Table(
        "Ours: balls that match the disc, 2 m R = M0 e, with c_b in proportion to m",
        (
            "m, c_b", "period", "at 5 s", "residual unbalance at 5 s [of the disc's]",
            f"W/e at 200 rad/s, {SETTLED_AFTER:g} s",
        ),
        tuple(rows),
        3,
    )  # fmt: skip


def suppressed_claim(held: float, light: float) -> Claim:
    """That a start-up with the period suppresses vibration at a high speed (chapter 7).

    Parameters
    ----------
    held
        W/e at 200 rad/s with the thesis' balls and the hold.
    light
        With balls that match the disc.
    """
    free = whirl_without_balls(200.0)
    return Claim(
        "4.7, chapter 7", "above the critical speed this suppresses vibration excellently",
        f"W/e at 200 rad/s {held:.2f} with the hold, {free:.2f} without balls (ours: {MUCH:.0%} "
        "of it at most)", held <= MUCH * free,
        f"the balls are too heavy for the disc; with balls that match it is {light:.3f}",
    )  # fmt: skip


def whirl_without_balls(speed: float) -> float:
    """W/e of the thesis' drive without balls, at a constant speed [rad/s]."""
    p = THESIS
    return speed**2 / abs(p.k / p.M - speed**2 + 1j * p.c / p.M * speed)


def both_claim(figure: str, run: StartUp) -> Claim:
    """That both balls are opposite."""
    return Claim(
        figure, "both balls move to the vicinity of -180 deg", f"{degrees(run.angles)} at 5 s",
        bool(opposite(run.angles).all()),
    )  # fmt: skip


def balance_claim(figure: str, run: StartUp, without: StartUp) -> Claim:
    """That nothing is left of the unbalance."""
    ours = (
        f"{run.residual:.2f} of the disc's unbalance, without a period {without.residual:.2f} "
        f"(ours: {BALANCED:g} at most)"
    )
    return Claim(
        figure, "residual unbalance is eliminated", ours, run.residual <= BALANCED, NOT_GONE
    )
