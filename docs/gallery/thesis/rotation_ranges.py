"""What chapter 5 states of end positions and settling times over m, c_b and e."""

import numpy as np

from gallery.page import Cell, Table
from gallery.thesis.claims import FAR, READ, Claim, opposite, stretches
from gallery.thesis.drive import HOLD, OPPOSITE, THESIS, StartUp, start_ups
from gallery.thesis.rotation_measures import HALF_SECOND, settled_after

MASSES = (0.5e-3, 1e-3, 1.5e-3, 2e-3)
"""Of a ball [kg]."""
DRAGS = np.unique([*np.round(np.geomspace(0.2, 8.0, 76), 3), 1.0])
"""c_b of figures 5.5 and 5.11 [N s/m], 5 % apart; the printed axes' range is not in the text."""
ECCENTRICITIES = np.round(np.arange(50e-6, 301e-6, 10e-6), 8)
"""e of figures 5.6 and 5.12 [m], half to three times the thesis'; the printed range is not in the
text."""
Ends = dict[float, tuple[np.ndarray, np.ndarray]]
"""By a ball's mass the end positions without and with the hold [deg]."""
WIDE = 1.1
"""A stretch that serves has this ratio of its ends at least; ours: +-5 %, two steps of c_b."""


def at_drag(drag: Ends, held: int, c_b: float) -> list[float]:
    """End positions by ``MASSES`` [deg]."""
    k = int(np.argmin(np.abs(DRAGS - c_b)))
    return [float(drag[m][held][k]) for m in MASSES]


def drag_claims(figure: str, drag: Ends, held: int) -> list[Claim]:
    """Figures 5.5 and 5.11."""
    each = np.array([drag[m][held] for m in MASSES])
    ordered = np.all(np.diff(each, axis=0) < 0.0, axis=0)
    found = {m: longest(DRAGS, opposite(drag[m][held])) for m in MASSES}
    words = [f"{1e3 * m:g} g: {_stretch(opposite(drag[m][held]))}" for m in MASSES]
    return [
        Claim(figure, "the larger c_b, the less far",
              f"{_falling_words(drag, held)} (ours: but for {READ:g} deg)",
              bool(np.all(np.diff(each, axis=1) > -READ))),
        Claim(figure, "the larger m, the farther, at every c_b",
              f"at {ordered.sum()} of {len(DRAGS)} values of c_b from {DRAGS[0]:g} to "
              f"{DRAGS[-1]:g} N s/m", bool(ordered.all())),
        Claim(figure, "by c_b and m the end can be tuned to -180 deg",
              f"c_b [N s/m] of {'; '.join(words)} (ours: a factor of {WIDE:g} for each m)",
              all(high > WIDE * low for low, high in found.values())),
    ]  # fmt: skip


def eccentricity_claims(figure: str, ends: Ends, held: int) -> list[Claim]:
    """Figures 5.6 and 5.12: what is said of both."""
    whatever = ", whatever m" if held else ""
    times = settling_times(bool(held))
    spread = _spread(times)
    known = [time for time in times if time is not None]
    return [
        Claim(figure, f"e does not change the end position much{whatever}",
              f"{_spread_words(ends, held)} (ours: by {FAR:g} deg)",
              all(np.ptp(ends[m][held]) <= FAR for m in MASSES)),
        Claim(figure, "the settling time is not significantly changed by e, m = 1 g",
              f"{min(known):.2f} to {max(known):.2f} s from 50 to 300 um (ours: by "
              f"{HALF_SECOND:g} s)", spread <= HALF_SECOND),
    ]  # fmt: skip


def steadier_claims(ends: Ends) -> list[Claim]:
    """That settling depends less on e with the hold."""
    narrower = [m for m in MASSES if np.ptp(ends[m][1]) < np.ptp(ends[m][0])]
    plain, held = _spread(settling_times(False)), _spread(settling_times(True))
    return [
        Claim("5.12", "the end position changes less than without the hold",
              "less for " + (", ".join(f"{1e3 * m:g} g" for m in narrower) or "none")
              + f"; without: {_spread_words(ends, 0)}", len(narrower) == len(MASSES)),
        Claim("5.12", "settling time is more stable than without the hold, m = 1 g",
              f"spreads by {held:.2f} s, without the hold by {plain:.2f} s (ours: {HALF_SECOND:g} "
              "s less)", held <= plain - HALF_SECOND,
              "the difference is too small to read"),
    ]  # fmt: skip


def width_table(drag: Ends, shares: tuple[float, float]) -> Table:
    """How wide the good stretch of c_b is, at each of some masses.

    Parameters
    ----------
    drag
        Figures 5.5 and 5.11.
    shares
        Of the map that is near an odd multiple of -180 deg, without and with the hold.
    """
    rows: list[tuple[Cell, ...]] = [
        (f"{1e3 * m:g} g", *(_stretch(opposite(drag[m][held]), True) for held in (0, 1)))
        for m in MASSES
    ]
    rows.append(("share of the map, any odd multiple", *(f"{share:.0%}" for share in shares)))
    return Table(
        f"c_b [N s/m] for which both balls end within {OPPOSITE:g} deg of -180 deg",
        ("m", "without a period", "hold of 0.5 s"),
        tuple(rows),
    )


def _stretch(good: np.ndarray, factor: bool = False) -> str:
    """Widest good stretch of ``DRAGS``; where the range ends there, it says so."""
    low, high = longest(DRAGS, good)
    if not high:
        return "none"
    edges = [word for word, end, at in (("below", DRAGS[0], low), ("above", DRAGS[-1], high))
             if at == end]  # fmt: skip
    words = f"{low:.3g} to {high:.3g}"
    if edges:
        return f"{words} and {' and '.join(edges)}"
    return f"{words}, a factor of {high / low:.3g}" if factor else words


def over_e(held: bool) -> list[StartUp]:
    """Start-ups of the thesis' drive over the eccentricity."""
    period = HOLD if held else None
    return start_ups([(THESIS._replace(e=float(e)), period) for e in ECCENTRICITIES[::5]])


def settling_times(held: bool) -> list[float | None]:
    """Of these [s]."""
    return [settled_after(run) for run in over_e(held)]


def longest(values: np.ndarray, good: np.ndarray) -> tuple[float, float]:
    """First and last value of the widest good stretch, by ratio; zeros: none."""
    found = [(float(values[first]), float(values[last]))
             for first, last in stretches(values, good)]  # fmt: skip
    return max(found, key=lambda ends: ends[1] / ends[0], default=(0.0, 0.0))


def _spread(times: list[float | None]) -> float:
    """Of settling times [s]; infinite where balls have not settled."""
    known = [np.inf if time is None else time for time in times]
    return max(known) - min(known)


def _falling_words(ends: Ends, held: int) -> str:
    back = {m: float(-np.diff(ends[m][held]).min()) for m in MASSES}
    return "; ".join(
        f"{1e3 * m:g} g: {ends[m][held][0]:.0f} to {ends[m][held][-1]:.0f} deg"
        + (f", falls by up to {fall:.0f}" if fall > READ else "")
        for m, fall in back.items()
    )


def _spread_words(ends: Ends, held: int) -> str:
    return "; ".join(
        f"{1e3 * m:g} g: by {np.ptp(ends[m][held]):.0f} deg, {ends[m][held].max():.0f} to "
        f"{ends[m][held].min():.0f}"
        for m in MASSES
    )
