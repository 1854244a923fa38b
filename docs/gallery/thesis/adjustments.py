"""Section 4.5: when to start the period, how to adjust it finely, and why R changes little."""

import numpy as np

from gallery.thesis.causes import farther_claim
from gallery.thesis.claims import ABOUT, READ, TIMED, Claim, degrees, value
from gallery.thesis.drive import ACCELERATION, THESIS, Parameters, Period, start_ups
from gallery.thesis.measures import pushed
from gallery.thesis.other_drives import Ratios, nearest, period_of

NEAR_1_G = np.round(np.arange(0.7e-3, 1.301e-3, 5e-5), 6)
"""Masses of a ball that are a fine adjustment of 1 g [kg]; ours."""
FINE = 0.25
"""A hold and a mass that are finely adjusted are changed by so much at most, relative; ours."""
STARTS = np.arange(80.0, 140.1, 2.0)
"""Speeds at which a hold is tried to start [rad/s]."""
OTHERS = ("c", "e", "R", "m", "c_b")
"""What is said not to matter to the start; a and beta_b move no ball by what is read off."""


def adjusted_claim(figure: str, printed: str, p: Parameters) -> Claim:
    """That the balance effect is had strictly by another end time, or by another m."""
    rule = start_ups([(p, period_of(p))])[0]
    duration, by_time = nearest(p)
    drives = [p._replace(m=float(m)) for m in NEAR_1_G]
    each = start_ups([(one, period_of(one)) for one in drives])
    best = int(np.argmin([abs(run.angles.mean() + 180.0) for run in each]))
    changes = [abs(duration / 0.5 - 1.0), abs(1e3 * float(NEAR_1_G[best]) - 1.0)]
    short = [float(abs(run.angles.mean() + 180.0)) for run in (by_time, each[best])]
    return Claim(
        figure, f"the balance effect strictly: {printed}",
        f"{degrees(rule.angles)}; with a hold of {duration:g} s {degrees(by_time.angles)}, with "
        f"m = {1e3 * NEAR_1_G[best]:g} g {degrees(each[best].angles)} (ours: to {READ:g} deg by "
        f"each, of 0.5 s and 1 g by {FINE:.0%} at most)",
        max(short) <= READ and max(changes) <= FINE,
        "that is no fine adjustment" if max(short) <= READ else "",
    )  # fmt: skip


def as_far_claim(figure: str, made: Ratios) -> Claim:
    """That the phase stays because twice the race has twice the force (4.32, 4.33)."""
    beside = "4.24" if figure == "4.32" else "4.25"
    run, other = made.runs[figure], made.runs[beside]
    way, force = run.parameters.R / other.parameters.R, pushed(run) / pushed(other)
    shares = (1.0 + run.parameters.carried) / (1.0 + other.parameters.carried)
    return Claim(
        figure,
        "the phase does not change much because the force grows like the path along the race",
        f"the way is {way:g} times as long, the force's integral over time {force:.2f} times that "
        f"in {beside} (ours: alike to {ABOUT:.0%})", abs(force / way - 1.0) <= ABOUT,
        f"1 + 2 m R / (M0 e), which drives the whirl, grows {shares:.2f} times only",
    )  # fmt: skip


def best_starts() -> dict[str, float | None]:
    """By drive the start of a 0.5 s hold with which balls are soonest at -180 deg [rad/s].

    From standstill, of ``STARTS``; None: with none of them they get there.
    """
    drives = {"the thesis' set": THESIS}
    for factor, words in ((0.5, "half"), (2.0, "twice")):
        drives |= {f"{words} {name}": THESIS._replace(**{name: factor * getattr(THESIS, name)})
                   for name in OTHERS}  # fmt: skip
    found: dict[str, float | None] = {}
    for name, p in drives.items():
        runs = start_ups([(p, Period(float(s) / ACCELERATION)) for s in STARTS], every=5)
        there = [np.inf if run.settling is None else s / ACCELERATION + run.settling
                 for s, run in zip(STARTS, runs, strict=True)]  # fmt: skip
        best = int(np.argmin(there))
        found[name] = float(STARTS[best]) if np.isfinite(there[best]) else None
    return found


def start_claims(best: dict[str, float | None]) -> list[Claim]:
    """That the start time is the critical speed's, whatever else changes: as a rule for design.

    Parameters
    ----------
    best
        By drive the best start [rad/s], the thesis' own first.
    """
    known = [speed for speed in best.values() if speed is not None]
    own, critical = known[0], THESIS.critical_speed
    words = ", ".join(f"{name} {speed:g}" for name, speed in best.items() if speed is not None)
    never = [name for name, speed in best.items() if speed is None]
    off = max(known, key=lambda speed: abs(speed / own - 1.0))
    return [
        Claim(
            "section 4.5", "the period starts where the speed is critical: the best start",
            f"balls are soonest at -180 deg, from standstill, with a hold of 0.5 s from {own:g} "
            f"rad/s on, critical are {critical:g} (ours: to {TIMED:.0%})",
            abs(own / critical - 1.0) <= TIMED,
            "a start slightly above it is faster, as in the grid of 4.4",
        ),
        Claim(
            "section 4.5", "the start time depends on M and k only: so does the best one",
            f"best starts [rad/s]: {words}; never there with {', '.join(never) or 'none'} (ours: "
            f"to {TIMED:.0%} of that of the thesis' set)", abs(off / own - 1.0) <= TIMED,
            f"up to {off:g} rad/s: the farther balls are driven, the later it may start",
        ),
    ]  # fmt: skip


def force_claims(made: Ratios) -> list[Claim]:
    """That the force decides how far the balls go, and that it grows with R in the hold, too."""
    runs = made.runs
    return [
        farther_claim("4.27", "because the force is small, the balls go only to about -100 deg",
                      runs["4.27"], ("4.25", runs["4.25"]), more=False),
        farther_claim("4.28", "by the larger force the balance effect is there",
                      runs["4.28"], ("4.27", runs["4.27"])),
        farther_claim("4.31", "by the smaller force the effect is the right one",
                      runs["4.31"], ("4.30", runs["4.30"]), more=False),
        value("4.33", "whirl in proportion to R: W/e over that of 4.25", 2.0,
              made.peak("4.33", "4.25")),
        value("4.33", "force in proportion to R", 2.0, made.force("4.33", "4.25")),
        farther_claim("4.36", "because the force is larger they go slightly farther",
                      runs["4.36"], ("4.24", runs["4.24"])),
    ]  # fmt: skip
