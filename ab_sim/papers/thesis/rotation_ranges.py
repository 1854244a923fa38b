"""What chapter 5 states of end positions and settling times over m, c_b and e."""

import numpy as np

from ab_sim.papers.thesis.claims import READ, Claim, opposite
from ab_sim.papers.thesis.drive import HOLD, THESIS, StartUp, start_ups
from ab_sim.papers.thesis.region import MAP_DRAGS, MAP_MASSES
from ab_sim.papers.thesis.rotation_measures import HALF_SECOND, settled_after

MASSES = (0.5e-3, 1e-3, 1.5e-3, 2e-3)
"""Of a ball [kg]."""
DRAGS = np.round(np.arange(0.2, 4.01, 0.1), 3)
"""c_b of figures 5.5 and 5.11 [N s/m]; the printed axes' range is not in the text."""
ECCENTRICITIES = np.round(np.arange(50e-6, 301e-6, 10e-6), 8)
"""e of figures 5.6 and 5.12 [m], half to three times the thesis'; the printed range is not in the
text."""
Ends = dict[float, tuple[np.ndarray, np.ndarray]]
"""By a ball's mass the end positions without and with the hold [deg]."""
STEADY = 60.0
"""[deg] over all eccentricities: "not so large"; ours, a third of the way between two positions."""
WIDE = 1.1
"""A stretch that serves has this ratio of its ends at least; ours: +-5 %."""


def at_drag(drag: Ends, held: int, c_b: float) -> list[float]:
    """End positions by ``MASSES`` [deg]."""
    k = int(np.argmin(np.abs(DRAGS - c_b)))
    return [float(drag[m][held][k]) for m in MASSES]


def drag_claims(figure: str, drag: Ends, held: int) -> list[Claim]:
    """Figures 5.5 and 5.11."""
    each = np.array([drag[m][held] for m in MASSES])
    ordered = np.all(np.diff(each, axis=0) < 0.0, axis=0)
    found = {m: longest(DRAGS, opposite(drag[m][held])) for m in MASSES}
    words = [
        f"{1e3 * m:g} g: " + (f"{low:g} to {high:g}" if high else "none")
        for m, (low, high) in found.items()
    ]
    return [
        Claim(figure, "the larger c_b, the less far",
              f"{_falling_words(drag, held)} (ours: but for {READ:g} deg)",
              bool(np.all(np.diff(each, axis=1) > -READ))),
        Claim(figure, "the larger m, the farther, at every c_b",
              f"at {ordered.sum()} of {len(DRAGS)} values of c_b from {DRAGS[0]:g} to "
              f"{DRAGS[-1]:g} N s/m", bool(ordered.all())),
        Claim(figure, "by c_b and m the end can be tuned to -180 deg",
              f"c_b of {'; '.join(words)} N s/m of up to {DRAGS[-1]:g} (ours: a factor of {WIDE:g} "
              "for each m)", all(high > WIDE * low for low, high in found.values())),
    ]  # fmt: skip


def eccentricity_claims(figure: str, ends: Ends, held: int) -> list[Claim]:
    """Figures 5.6 and 5.12: what is said of both."""
    whatever = ", whatever m" if held else ""
    times = settling_times(bool(held))
    spread = _spread(times)
    known = [time for time in times if time is not None]
    return [
        Claim(figure, f"e does not change the end position much{whatever}",
              f"{_spread_words(ends, held)} (ours: by {STEADY:g} deg)",
              all(np.ptp(ends[m][held]) <= STEADY for m in MASSES)),
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
        Claim("5.12", "settling is more stable than without the hold: the time, m = 1 g",
              f"spreads by {held:.2f} s, without the hold by {plain:.2f} s", held < plain),
    ]  # fmt: skip


def width_claim(ends: np.ndarray) -> Claim:
    """That 1 g and 1 N s/m with the hold are no pin point (chapter 7); of the map's ends [deg]."""
    good = opposite(ends[1])
    mass, drag = int(np.argmin(np.abs(MAP_MASSES - 1e-3))), int(np.argmin(np.abs(MAP_DRAGS - 1.0)))
    masses, drags = longest(1e3 * MAP_MASSES, good[:, drag]), longest(MAP_DRAGS, good[mass])
    return Claim(
        "5.7, chapter 7", "that 1 g and 1 N s/m serve is not a pin point: it has a certain width",
        f"c_b from {drags[0]:.2g} to {drags[1]:.2g} N s/m at {1e3 * MAP_MASSES[mass]:.2g} g, m "
        f"from {masses[0]:.2g} to {masses[1]:.2g} g at {MAP_DRAGS[drag]:.2g} N s/m (ours: a factor "
        f"of {WIDE:g} in both)",
        all(low > 0.0 and high > WIDE * low for low, high in (masses, drags)),
    )  # fmt: skip


def over_e(held: bool) -> list[StartUp]:
    """Start-ups of the thesis' drive over the eccentricity."""
    period = HOLD if held else None
    return start_ups([(THESIS._replace(e=float(e)), period) for e in ECCENTRICITIES[::5]])


def settling_times(held: bool) -> list[float | None]:
    """Of these [s]."""
    return [settled_after(run) for run in over_e(held)]


def longest(values: np.ndarray, good: np.ndarray) -> tuple[float, float]:
    """First and last value of the widest good stretch, by ratio; zeros: none."""
    best, first = (0.0, 0.0), None
    for k, ok in enumerate([*good, False]):
        if ok and first is None:
            first = k
        if not ok and first is not None:
            low, high = float(values[first]), float(values[k - 1])
            if not best[1] or high / low > best[1] / best[0]:
                best = low, high
            first = None
    return best


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
        f"{1e3 * m:g} g: by {np.ptp(ends[m][held]):.0f} deg, {ends[m][held][0]:.0f} to "
        f"{ends[m][held][-1]:.0f}"
        for m in MASSES
    )
