"""Chapter 5: which balls have settled 2.5 s after the critical speed, and where to."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gallery.thesis.claims import BALANCED, ENGLISH_ONLY, Claim, degrees, stretches
from gallery.thesis.drive import HOLD, OPPOSITE, THESIS, Parameters, start_ups
from gallery.thesis.rotation_measures import after, settled_after
from gallery.thesis.rotation_ranges import DRAGS, ECCENTRICITIES, MASSES, WIDE, Ends, longest

FARTHER = (3, 5)
"""Odd multiples of -180 deg beyond the first."""
FINE = 41
"""Values of c_b around a stretch, with which its ends are found."""
MOST = 0.8
""""As a general trend" is at so many of all; ours, as "almost all" of figure 6.5."""


class Swept(NamedTuple):
    """A figure's axis: end positions depend on it, and whether the balls have settled there."""

    values: np.ndarray
    settled: dict[float, np.ndarray]
    """By a ball's mass."""


def over_drag(held: bool) -> Swept:
    """Figures 5.5, 5.11."""
    return _swept(DRAGS, lambda m, c_b: THESIS._replace(m=m, c_b=c_b), held)


def over_eccentricity(held: bool) -> Swept:
    """Figures 5.6, 5.12."""
    return _swept(ECCENTRICITIES, lambda m, e: THESIS._replace(m=m, e=e), held)


def _swept(values: np.ndarray, drive: Callable[[float, float], Parameters], held: bool) -> Swept:
    # Each step is kept, as in figures 5.1 to 5.10: near the measure's edge ten of them matter.
    period = HOLD if held else None
    settled = {}
    for m in MASSES:
        runs = start_ups([(drive(m, float(value)), period) for value in values])
        settled[m] = np.array([settled_after(run) is not None for run in runs])
    return Swept(values, settled)


def settled_claims(figures: tuple[str, str], ends: Ends, held: int) -> list[Claim]:
    """Of a figure over c_b and of one over e.

    Parameters
    ----------
    figures
        both.
    ends
        Over c_b.
    held
        1 with the hold, else 0.
    """
    drag, eccentricity = over_drag(bool(held)), over_eccentricity(bool(held))
    return [
        *odd_claims(figures[0], ends, held),
        settled_claim(figures[0], drag, ("c_b", 1.0, "N s/m")),
        settled_claim(figures[1], eccentricity, ("e", 1e6, "um")),
    ]


def settled_claim(figure: str, swept: Swept, unit: tuple[str, float, str]) -> Claim:
    """That the positions over c_b or e are of balls that have settled.

    Parameters
    ----------
    figure
        Of the thesis.
    swept
        Its axis.
    unit
        The axis' name, by what its values are shown, and their unit.
    """
    name, scale, words = unit
    hold = sum(int(each.sum()) for each in swept.settled.values())
    of = sum(each.size for each in swept.settled.values())
    moving = "; ".join(
        f"{1e3 * m:g} g: " + ", ".join(_from_to(swept.values[[a, b]] * scale) for a, b in where)
        for m, each in swept.settled.items() if (where := stretches(swept.values, ~each))
    )  # fmt: skip
    axis = _from_to(swept.values[[0, -1]] * scale)
    return Claim(
        figure, "the balls have settled 2.5 s after the critical speed",
        f"at {hold} of {of} points, of all m at {name} from {axis} {words}"
        + (f"; they still move at {name} [{words}] of {moving}" if moving else ""),
        None, ENGLISH_ONLY,
    )  # fmt: skip


def odd_claims(figure: str, ends: Ends, held: int) -> list[Claim]:
    """That balls can be tuned to an odd multiple of -180 deg: to the next ones, once settled."""
    claims = []
    for odd in FARTHER:
        found = {m: stretch_near(-180.0 * odd, m, ends, held) for m in MASSES}
        widest = max((high / low if low else 0.0) for low, high in found.values())
        half = 100.0 * (np.sqrt(widest) - 1.0)
        words = "; ".join(
            f"{1e3 * m:g} g: " + (_from_to(np.array(one)) if one[1] else "none")
            for m, one in found.items()
        )
        claims.append(
            Claim(
                figure, f"... or to another odd multiple: {-180 * odd} deg",
                f"c_b [N s/m] of {words} (ours: settled, a factor of {WIDE:g} for one m)",
                bool(widest >= WIDE),
                f"a factor of {widest:.3f} at most: to be met to +-{half:.1f} %",
            )
        )  # fmt: skip
    return claims


def stretch_near(target: float, m: float, ends: Ends, held: int) -> tuple[float, float]:
    """Stretch of c_b [N s/m] for which balls have settled near an angle [deg]; zeros: none.

    Its ends are between two of ``DRAGS``: there it is run again with finer steps.

    Parameters
    ----------
    target
        The angle [deg].
    m
        Of a ball [kg].
    ends
        Figure 5.5 or 5.11.
    held
        1 with the hold, else 0.
    """
    low, high = longest(DRAGS, np.abs(ends[m][held] - target) <= OPPOSITE)
    if not high:
        return 0.0, 0.0
    first, last = np.flatnonzero((DRAGS == low) | (DRAGS == high))[[0, -1]]
    around = DRAGS[max(first - 1, 0)], DRAGS[min(last + 1, len(DRAGS) - 1)]
    fine = np.round(np.geomspace(*around, FINE), 4)
    cases = [(THESIS._replace(m=m, c_b=float(c_b)), HOLD if held else None) for c_b in fine]
    good = [abs(run.angles.mean() - target) <= OPPOSITE and settled_after(run) is not None
            for run in start_ups(cases)]  # fmt: skip
    return longest(fine, np.array(good))


def trend_claim(ends: Ends) -> Claim:
    """That the hold moves balls farther as a general trend (chapter 7)."""
    farther = np.array([ends[m][1] < ends[m][0] for m in MASSES])
    less = [f"{1e3 * m:g} g: {_from_to(DRAGS[[0, last]])}" for m, each in
            zip(MASSES, farther, strict=True) for first, last in stretches(DRAGS, ~each)
            if first == 0]  # fmt: skip
    return Claim(
        "5.5, 5.11, chapter 7", "the hold promotes the balls' movement as a general trend",
        f"farther at {farther.sum()} of {farther.size} points of m and c_b, not with c_b [N s/m] "
        f"of {'; '.join(less) or 'any'} (ours: at four of five)",
        bool(farther.mean() >= MOST),
    )  # fmt: skip


def place_claims() -> list[Claim]:
    """Figure 5.10: that 1 g and 1.5 g have settled, and 1.5 g in an unbalanced position."""
    one, other = start_ups([(THESIS._replace(m=m), HOLD) for m in MASSES[1:3]])
    settled = [settled_after(run) for run in (one, other)]
    return [
        Claim(
            "5.10", "m = 1 g and 1.5 g have settled",
            f"{', '.join(after(time) for time in settled)} after the critical speed",
            None not in settled,
        ),
        Claim(
            "5.10",
            "m = 1.5 g, unlike 1 g: an unbalanced position, judged by the remaining unbalance",
            f"{degrees(other.angles)}, {other.residual:.2f} of the disc's unbalance left; 1 g "
            f"{one.residual:.2f} (ours: more than {BALANCED:g}, and 1 g {BALANCED:g} at most)",
            bool(other.residual > BALANCED >= one.residual), "1 g is not balanced, either",
        ),
    ]  # fmt: skip


def _from_to(ends: np.ndarray) -> str:
    low, high = float(ends[0]), float(ends[-1])
    return f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"
