"""What chapter 5 states of balls that fall behind the rotor, and of where they come to rest."""

import numpy as np

from ab_sim.batch import simulate_batch
from ab_sim.papers.thesis.claims import Claim, angle, at_odd, degrees, opposite
from ab_sim.papers.thesis.drive import BASE, HOLD, THESIS, StartUp, start_ups, variation_of
from ab_sim.papers.thesis.measures import at_time
from ab_sim.scene import load_scene

PAIRS = {"5.1": (1e-3, 1.0), "5.2": (2e-3, 1.0), "5.3": (2e-3, 2.0)}
"""By figure m [kg] and c_b [N s/m]; figures 5.7 to 5.9 are the same with the hold."""
HELD = {"5.1": "5.7", "5.2": "5.8", "5.3": "5.9"}
MASSES = (0.5e-3, 1e-3, 1.5e-3, 2e-3)
"""Of a ball [kg]."""
DRAGS = np.round(np.arange(0.2, 4.01, 0.1), 3)
"""c_b of figures 5.5 and 5.11 [N s/m]; the printed axes' range is not in the text."""
ECCENTRICITIES = np.round(np.arange(50e-6, 301e-6, 10e-6), 8)
"""e of figures 5.6 and 5.12 [m], half to three times the thesis'; the printed range is not in the
text."""
Ends = dict[float, tuple[np.ndarray, np.ndarray]]
"""By a ball's mass the end positions without and with the hold [deg]."""
SETTLED = 25.0
"""Balls have settled when they stay this near to where they end [deg]; one for all figures."""
HALF_SECOND = 0.25
"""Times are printed to half a second: they hold within a quarter."""
FOLLOWS = 5.0
"""Balls keep the rotor's speed within so much, and lag by more [rad/s]: 5 % of it; ours."""
STEADY = 60.0
"""[deg] over all eccentricities: "not so large"; ours, a third of the way between two positions."""
WIDE = 1.1
"""c_b can be tuned where the stretch that serves has this ratio of its ends; ours: +-5 %."""


def without_claims(runs: dict[str, StartUp], drag: Ends, eccentricity: Ends) -> list[Claim]:
    """What section 5.1 states."""
    one, heavy, braked = (runs[number] for number in PAIRS)
    lags = [lag(run) for run in (one, heavy, braked)]
    later = [last_lag(run) for run in (one, heavy, braked)]
    masses = [drag[m][0][_drag_at(1.0)] for m in MASSES]
    beyond = float(start_ups([(THESIS._replace(m=3e-3), None)])[0].angles.mean())
    times = [settled_after(run) for run in over_e(False)]
    return [
        Claim("5.1 (b), 5.2 (b)", "above the critical speed the balls lag behind the rotor",
              f"by {lags[0]:.1f} and {lags[1]:.1f} rad/s at most", min(lags[:2]) > FOLLOWS),
        Claim("5.2 (b)", "more so with the heavier ball", f"{lags[1]:.1f}, {lags[0]:.1f} rad/s",
              lags[1] > lags[0]),
        Claim("5.1 (c)", "the balls do not exceed -180 deg", degrees(one.angles),
              bool((one.angles > -180.0).all())),
        angle("5.1 (c)", "up to (section 5.2)", -150.0, float(one.angles.mean())),
        angle("5.2 (c)", "settles near, the next balanced position", -540.0,
              float(heavy.angles.mean()),
              "at 5 s they are further; they come back to -544 deg later, see 5.4"),
        angle("5.2 (c)", "settles (section 5.2)", -600.0, float(heavy.angles.mean())),
        Claim("5.3 (b)", "c_b = 2 reduces the lag",
              f"{lags[2]:.1f} in place of {lags[1]:.1f} rad/s", lags[2] < lags[1]),
        _settles("5.2 (c)", 1.0, heavy),
        _settles("5.3 (c)", 0.5, braked),
        angle("5.3 (c)", "suppressed to", -200.0, float(braked.angles.mean())),
        Claim("5.1-5.3 (b)", "with rising speed the balls follow the rotor again",
              ", ".join(f"{x:.1f}" for x in later) + " rad/s over the last 0.2 s (ours: at most a "
              "tenth of the largest lag)",
              all(abs(x) <= 0.1 * most for x, most in zip(later, lags, strict=True))),
        _balanced_where(drag),
        _worse_with_drag(),
        Claim("5.4", "the heavier the balls, the farther they go",
              _list(masses) + " deg for m = 0.5, 1, 1.5, 2 g", bool(np.all(np.diff(masses) < 0))),
        Claim("5.4", "beyond 2 g farther still", f"{beyond:.0f} deg for m = 3 g",
              beyond < masses[-1]),
        Claim("5.4", "they settle in the vicinity of odd multiples of -180 deg",
              _list(masses) + " deg", bool(at_odd(np.array(masses)).all()),
              f"not within 2.5 s; after 15 s, held at 200 rad/s: {_list(_at_last())} deg"),
        Claim("5.5", "the larger c_b, the less far", _rising_words(drag, 0), _rises(drag, 0)),
        _tunable("5.5", drag, 0),
        Claim("5.6", "e does not change the end position much (ours: by 60 deg)",
              _spread_words(eccentricity, 0), _steady(eccentricity, 0)),
        _unhurried("5.6", times),
    ]  # fmt: skip


def hold_claims(runs: dict[str, StartUp], drag: Ends, eccentricity: Ends) -> list[Claim]:
    """What section 5.2 states."""
    held = one, heavy, braked = [runs[HELD[number]] for number in PAIRS]
    without = [runs[number] for number in PAIRS]
    during, lags = [lag_during_hold(run) for run in held], [lag(run) for run in held]
    masses = [drag[m][1][_drag_at(1.0)] for m in MASSES]
    settled, before = [settled_after(run) for run in held], [settled_after(run) for run in without]
    longer = [after - first for after, first in zip(settled, before, strict=True)]
    still = last_range(heavy)
    went = float(np.ptp(np.degrees(heavy.trajectory.ball_angles[[-501, -1], 0])))
    back = heavy.trajectory.ball_angles[-1, 0] > heavy.trajectory.ball_angles[-501, 0]
    narrower = [np.ptp(eccentricity[m][1]) < np.ptp(eccentricity[m][0]) for m in MASSES]
    return [
        angle("5.7 (c)", "1 s after the critical speed", -200.0,
              float(np.degrees(at_time(one.trajectory.ball_angles, one, 3.5)).mean())),
        _settles("5.7 (c)", 1.0, one),
        Claim("5.8 (c)", "beyond -540 deg, heading towards -900 deg",
              f"{degrees(heavy.angles)} at 5 s; {went:.0f} deg {'back' if back else 'further'} in "
              "the last 0.5 s", bool((heavy.angles < -540.0 - SETTLED).all()) and not back),
        Claim("5.8 (c)", "not settled at 5 s",
              f"within {still:.0f} deg over the last 0.25 s (ours: more than {SETTLED:g})",
              still > SETTLED),
        Claim("5.7", "settled sooner than without the period", f"after {settled[0]:.2f} s, "
              f"without {before[0]:.2f} s", settled[0] < before[0] - HALF_SECOND),
        Claim("5.8", "settled later than without the period", f"not within 2.5 s, without after "
              f"{before[1]:.2f} s", still > SETTLED and before[1] < 2.0),
        Claim("5.9", "settled in an unbalanced position", degrees(braked.angles),
              not bool(at_odd(braked.angles).any()) and last_range(braked) <= SETTLED),
        Claim("5.7-5.9", "the settling time grows by the period of 0.5 s",
              "by " + ", ".join(f"{x:+.2f}" for x in longer) + " s (ours: within 0.25 s)",
              all(abs(x - 0.5) <= HALF_SECOND for x in longer),
              "in 5.9 alone; the thesis' own 5.7 settles sooner"),
        angle("5.9 (c)", "settled", -300.0, float(braked.angles.mean())),
        Claim("5.7-5.9 (b)", "in the hold the balls keep the rotor's speed",
              ", ".join(f"{x:.1f}" for x in during) + " rad/s behind it at most",
              max(during) < FOLLOWS),
        Claim("5.7-5.9 (b)", "after the hold they lag behind: the lag does not go away",
              ", ".join(f"{x:.1f}" for x in lags) + " rad/s", min(lags) > FOLLOWS),
        Claim("5.2", "the lag grows with m and falls with c_b",
              ", ".join(f"{x:.1f}" for x in lags) + " rad/s",
              lags[1] > lags[0] and lags[2] < lags[1]),
        Claim("5.2", "the balls' movement is promoted",
              "; ".join(f"{r.angles.mean():.0f} in place of {w.angles.mean():.0f} deg"
                        for r, w in zip(held, without, strict=True)),
              all(r.angles.mean() < w.angles.mean()
                  for r, w in zip(held, without, strict=True))),
        Claim("5.10", "the heavier the balls, the farther they go",
              _list(masses) + " deg for m = 0.5, 1, 1.5, 2 g", bool(np.all(np.diff(masses) < 0))),
        Claim("5.10", "m = 1 g: nearly -180 deg; m = 1.5 g: an unbalanced position",
              _list(masses[1:3]) + " deg",
              bool(at_odd(np.array(masses[1]))) and not bool(at_odd(np.array(masses[2])))),
        Claim("5.11", "the larger c_b, the less far", _rising_words(drag, 1), _rises(drag, 1)),
        _tunable("5.11", drag, 1),
        Claim("5.12", "e does not change the end position much, whatever m (ours: by 60 deg)",
              _spread_words(eccentricity, 1), _steady(eccentricity, 1)),
        Claim("5.12", "it changes less than without the hold",
              "less for " + (", ".join(f"{1e3 * m:g} g" for m, less in
                             zip(MASSES, narrower, strict=True) if less) or "none")
              + f"; without: {_spread_words(eccentricity, 0)}", all(narrower)),
        _unhurried("5.12", [settled_after(run) for run in over_e(True)]),
    ]  # fmt: skip


def over_e(held: bool) -> list[StartUp]:
    """Start-ups of the thesis' drive over the eccentricity."""
    period = HOLD if held else None
    return start_ups([(THESIS._replace(e=float(e)), period) for e in ECCENTRICITIES[::5]])


def lag(run: StartUp) -> float:
    """How far the mean ball falls behind the rotor at most, above the critical speed [rad/s]."""
    late = run.trajectory["time"] > run.parameters.critical_time
    return float(-run.trajectory.ball_rates[late].mean(axis=1).min())


def last_lag(run: StartUp) -> float:
    """Mean of the lag over the last 0.2 s [rad/s]."""
    time = run.trajectory["time"]
    return float(-run.trajectory.ball_rates[time > time[-1] - 0.2].mean())


def last_range(run: StartUp) -> float:
    """What the balls cover in the last 0.25 s [deg]."""
    time = run.trajectory["time"]
    return float(np.degrees(np.ptp(run.trajectory.ball_angles[time > time[-1] - 0.25, 0])))


def lag_during_hold(run: StartUp) -> float:
    """The largest [rad/s]."""
    time = run.trajectory["time"]
    return float(-run.trajectory.ball_rates[(time > 2.5) & (time < 3.0)].min())


def settled_after(run: StartUp) -> float:
    """How long after the critical speed the balls have settled [s]."""
    turned = np.degrees(run.trajectory.ball_angles.mean(axis=1))
    away = np.flatnonzero(np.abs(turned - turned[-1]) > SETTLED)
    last = 0 if not len(away) else int(away[-1])
    return float(run.trajectory["time"][last] - run.parameters.critical_time)


def _settles(figure: str, printed: float, run: StartUp) -> Claim:
    ours = settled_after(run)
    return Claim(
        figure, f"settled about {printed:g} s after the critical speed", f"{ours:.2f} s",
        abs(ours - printed) <= HALF_SECOND,
    )  # fmt: skip


def _unhurried(figure: str, times: list[float]) -> Claim:
    """That the settling time hardly depends on e."""
    return Claim(
        figure, "the settling time is not significantly changed by e, m = 1 g",
        f"{min(times):.2f} to {max(times):.2f} s from 50 to 300 um (ours: by 0.25 s)",
        max(times) - min(times) <= HALF_SECOND,
    )  # fmt: skip


def _balanced_where(drag: Ends) -> Claim:
    """That odd multiples of -180 deg are the balanced positions."""
    left = [2.0 * m * THESIS.R / ((THESIS.M - 2.0 * m) * THESIS.e) for m in MASSES]
    return Claim(
        "5.2 (c)", "odd multiples of -180 deg are the balanced positions",
        ", ".join(f"{abs(1.0 - share):.2f}" for share in left)
        + " of the disc's unbalance left there with m = 0.5, 1, 1.5, 2 g",
        all(abs(1.0 - share) < 0.1 for share in left),
        "so with 0.5 g alone; the heavier ones balance on both sides of it",
    )  # fmt: skip


def _worse_with_drag() -> Claim:
    """Above the critical speed, at constant speed, from off balance."""
    drags = (1.0, 2.0, 4.0)
    variations = [
        variation_of(THESIS._replace(c_b=c_b, starts=(90.0, -150.0)), None, 200.0, 10.0)
        | {"start.speed": 200.0}
        for c_b in drags
    ]
    left = []
    for c_b, run in zip(drags, simulate_batch(load_scene(BASE), variations, 10).runs, strict=True):
        p = THESIS._replace(c_b=c_b)
        left.append(StartUp(p, None, run.scene, run.trajectory).residual)
    return Claim(
        "5.1", "a large c_b makes the balancer worse above the critical speed",
        ", ".join(f"{x:.2f}" for x in left) + " of the disc's unbalance left for c_b = 1, 2, 4 "
        "after 10 s at 200 rad/s, from 90 and -150 deg (ours)", bool(np.all(np.diff(left) > 0.02)),
    )  # fmt: skip


def _at_last() -> list[float]:
    """Where balls of ``MASSES`` are after 15 s, the last 10 s at 200 rad/s [deg]."""
    drives = [(THESIS._replace(m=m), None) for m in MASSES]
    runs = start_ups(drives, every=10, target=200.0, duration=15.0)
    return [float(run.angles.mean()) for run in runs]


def _drag_at(c_b: float) -> int:
    return int(np.argmin(np.abs(DRAGS - c_b)))


def _list(values: list[float]) -> str:
    return ", ".join(f"{value:.0f}" for value in values)


def _rises(ends: Ends, held: int) -> bool:
    """Whether the balls go less far with every step of c_b, but for 5 deg."""
    return all(bool(np.all(np.diff(ends[m][held]) > -5.0)) for m in MASSES)


def _rising_words(ends: Ends, held: int) -> str:
    back = {m: float(-np.diff(ends[m][held]).min()) for m in MASSES}
    return "; ".join(
        f"{1e3 * m:g} g: {ends[m][held][0]:.0f} to {ends[m][held][-1]:.0f} deg"
        + (f", falls by up to {fall:.0f}" if fall > 5.0 else "")
        for m, fall in back.items()
    )


def _tunable(figure: str, ends: Ends, held: int) -> Claim:
    """That c_b can be chosen, for each mass, with something to spare."""
    found = {m: _longest(opposite(ends[m][held])) for m in MASSES}
    words = [
        f"{1e3 * m:g} g: " + (f"{low:g} to {high:g}" if high else "none")
        for m, (low, high) in found.items()
    ]
    return Claim(
        figure, "by c_b and m the end can be tuned to -180 deg",
        "c_b of " + "; ".join(words) + f" N s/m of up to 4 (ours: a factor of {WIDE:g} for each m)",
        all(high > WIDE * low for low, high in found.values()),
    )  # fmt: skip


def _longest(good: np.ndarray) -> tuple[float, float]:
    """First and last c_b of the widest stretch, by ratio; zeros: none."""
    best, first = (0.0, 0.0), None
    for k, ok in enumerate([*good, False]):
        if ok and first is None:
            first = k
        if not ok and first is not None:
            low, high = float(DRAGS[first]), float(DRAGS[k - 1])
            if not best[1] or high / low > best[1] / best[0]:
                best = low, high
            first = None
    return best


def _steady(ends: Ends, held: int) -> bool:
    return all(np.ptp(ends[m][held]) <= STEADY for m in MASSES)


def _spread_words(ends: Ends, held: int) -> str:
    return "; ".join(
        f"{1e3 * m:g} g: by {np.ptp(ends[m][held]):.0f} deg, {ends[m][held][0]:.0f} to "
        f"{ends[m][held][-1]:.0f}"
        for m in MASSES
    )
