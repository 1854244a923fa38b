"""Chapter 5: what the hold is said to bring about, and over which m and c_b it does."""

import itertools

import numpy as np

from gallery.thesis.claims import Claim, degrees, opposite
from gallery.thesis.drive import HOLD, THESIS, Parameters, Period, StartUp, start_ups
from gallery.thesis.region import MAP_MASSES
from gallery.thesis.rotation_measures import (
    HALF_SECOND,
    after,
    lag,
    longer,
    settled_after,
)
from gallery.thesis.rotation_ranges import DRAGS, WIDE, longest

EXTREME = 10.0
"""An extreme lag is more [rad/s]: a tenth of the rotor's speed; ours."""
LONGER = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)
"""Holds up to that of figures 5.7 to 5.9 [s]; without one first."""


def promoted_claims() -> list[Claim]:
    """That balls settle sooner, later, unbalanced as a result of their movement's promotion.

    A cause shows where more of it makes more: over holds up to the figures'.
    """
    claims = []
    for figure, printed, m, c_b, sign in (
        ("5.7, summary of 5.2", "because of the promotion the balls settle sooner", 1e-3, 1.0,
         -1.0),
        ("5.8", "as a result of the promotion, too much of it, they settle later", 2e-3, 1.0, 1.0),
    ):  # fmt: skip
        runs = _over_holds(THESIS._replace(m=m, c_b=c_b))
        times = [np.inf if (time := settled_after(run)) is None else time for run in runs]
        best = int(np.argmin(times))
        ordered = all(sign * (b - a) > 0.0 or a == b == np.inf
                      for a, b in itertools.pairwise(times))  # fmt: skip
        claims.append(
            Claim(
                figure, printed,
                f"{_ends(runs)}, settled after "
                + ", ".join("not" if time == np.inf else f"{time:.2f}" for time in times)
                + f" s with {_holds()} (ours: the farther the "
                f"{'sooner' if sign < 0.0 else 'later'})", _farther(runs) and ordered,
                f"true up to {runs[best].angles.mean():.0f} deg, {LONGER[best]:g} s; "
                "farther is later",
            )
        )  # fmt: skip
    runs = _over_holds(THESIS._replace(m=2e-3, c_b=2.0))
    short = [float(abs(run.angles.mean() + 180.0)) for run in runs]
    claims.append(
        Claim(
            "5.9", "as a result of the promotion the balls settle in an unbalanced position",
            f"{_ends(runs)} with {_holds()} (ours: the farther the farther from -180 deg, at last "
            "not in its vicinity)",
            _farther(runs) and bool(np.all(np.diff(short) > 0.0))
            and not opposite(runs[-1].angles).any(),
        )
    )  # fmt: skip
    return claims


def reduced_claim(held: list[StartUp], without: list[StartUp]) -> Claim:
    """That the profile reduces the non-synchronous rotation (chapter 7)."""
    lags = [[lag(run) for run in runs] for runs in (held, without)]
    words = [", ".join(f"{x:.1f}" for x in each) for each in lags]
    reduced = all(x < y for x, y in zip(*lags, strict=True))
    return Claim(
        "chapter 7", "the profile's effect, examined in order to reduce non-synchronous rotation",
        f"lag with the hold {words[0]} rad/s at most in 5.7, 5.8, 5.9, without it {words[1]}; and "
        f"the balls fall behind by a larger angle: it is {'' if reduced else 'not '}reduced",
        None, "not said that it does, not counted; section 5.2: it does not go away",
    )  # fmt: skip


def quick_claim(one: StartUp, without: StartUp) -> Claim:
    """What chapter 7 calls the major benefit, of figure 5.7."""
    return Claim(
        "5.7, chapter 7", "settled sooner at the stable position without an extreme lag",
        f"{degrees(one.angles)} after {after(settled_after(one))}, without the hold "
        f"{degrees(without.angles)} after {after(settled_after(without))}; lag {lag(one):.1f} "
        f"rad/s (ours: by {HALF_SECOND:g} s, less than {EXTREME:g} rad/s)",
        serves(one, without),
    )  # fmt: skip


def width_claim() -> Claim:
    """That this is so not at 1 g and 1 N s/m alone (chapter 7)."""
    drags = _stretch(DRAGS, [THESIS._replace(c_b=float(c_b)) for c_b in DRAGS])
    masses = _stretch(1e3 * MAP_MASSES, [THESIS._replace(m=float(m)) for m in MAP_MASSES])
    return Claim(
        "5.7, chapter 7", "that 1 g and 1 N s/m serve so is not a pin point: it has a certain "
        "width",
        f"so, too, with c_b from {drags[0]:.3g} to {drags[1]:.3g} N s/m at 1 g, and m from "
        f"{masses[0]:.3g} to {masses[1]:.3g} g at 1 N s/m (ours: a factor of {WIDE:g} in both)",
        all(low > 0.0 and high > WIDE * low for low, high in (masses, drags)),
    )  # fmt: skip


def serves(held: StartUp, without: StartUp) -> bool:
    """Whether balls settle sooner with the hold, opposite, and never lag extremely."""
    settled, before = settled_after(held), settled_after(without)
    return (
        settled is not None
        and (before is None or (longer(settled, before) or 0.0) < -HALF_SECOND)
        and bool(opposite(held.angles).all())
        and lag(held) < EXTREME
    )


def _stretch(values: np.ndarray, drives: list[Parameters]) -> tuple[float, float]:
    """The widest stretch of drives that the hold serves."""
    with_it, without = (start_ups([(p, period) for p in drives]) for period in (HOLD, None))
    good = [serves(*pair) for pair in zip(with_it, without, strict=True)]
    return longest(values, np.array(good))


def _over_holds(p: Parameters) -> list[StartUp]:
    return start_ups([(p, Period(duration=d) if d else None) for d in LONGER])


def _farther(runs: list[StartUp]) -> bool:
    """Whether each longer hold takes the balls farther."""
    return bool(np.all(np.diff([run.angles.mean() for run in runs]) < 0.0))


def _ends(runs: list[StartUp]) -> str:
    return ", ".join(f"{run.angles.mean():.0f}" for run in runs) + " deg"


def _holds() -> str:
    return "holds of " + ", ".join(f"{d:g}" for d in LONGER) + " s"
