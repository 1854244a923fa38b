"""What chapter 5 states of balls that fall behind the rotor, and of where they come to rest."""

import numpy as np

from ab_sim import load_scene, simulate_batch
from gallery.thesis.claims import (
    BALANCED,
    BY_CONSTRUCTION,
    FAR,
    Claim,
    angle,
    at_odd,
    degrees,
)
from gallery.thesis.drive import BASE, HOLD, THESIS, StartUp, start_ups, variation_of
from gallery.thesis.measures import at_time
from gallery.thesis.rotation_causes import (
    promoted_claims,
    quick_claim,
    reduced_claim,
    width_claim,
)
from gallery.thesis.rotation_measures import (
    HALF_SECOND,
    SETTLED,
    STILL,
    after,
    lag,
    lag_during_hold,
    last_lag,
    last_range,
    longer,
    settled_after,
    shaking,
)
from gallery.thesis.rotation_ranges import (
    MASSES,
    Ends,
    at_drag,
    drag_claims,
    eccentricity_claims,
    steadier_claims,
)
from gallery.thesis.rotation_reasons import moved_claims, stable_claim
from gallery.thesis.rotation_settled import place_claims, settled_claims, trend_claim

PAIRS = {"5.1": (1e-3, 1.0), "5.2": (2e-3, 1.0), "5.3": (2e-3, 2.0)}
"""By figure m [kg] and c_b [N s/m]; figures 5.7 to 5.9 are the same with the hold."""
HELD = {"5.1": "5.7", "5.2": "5.8", "5.3": "5.9"}
FOLLOWS = 5.0
"""Balls keep the rotor's speed within so much, and lag by more [rad/s]: 5 % of it; ours."""
HELD_IN_PLACE = 300.0
"""c_b with which balls hardly move in a start-up [N s/m]."""
CAUSED = 0.1
"""By so much more W/e the balls' own motion shakes, if it does; ours."""
WORSE = 0.02
"""Of the unbalance more: ours."""


def without_claims(runs: dict[str, StartUp], drag: Ends, eccentricity: Ends) -> list[Claim]:
    """What section 5.1 states."""
    one, heavy, braked = (runs[number] for number in PAIRS)
    lags = [lag(run) for run in (one, heavy, braked)]
    later = [last_lag(run) for run in (one, heavy, braked)]
    masses = at_drag(drag, 0, 1.0)
    beyond = float(start_ups([(THESIS._replace(m=3e-3), None)])[0].angles.mean())
    last = _at_last()
    crept = (
        f"they have settled there by this page's measure, and creep to {last[-1]:.0f} deg in 15 s"
    )
    return [
        *moved_claims("5.5", None),
        Claim("5.1 (b), 5.2 (b)", "above the critical speed the balls lag behind the rotor",
              f"by {lags[0]:.1f} and {lags[1]:.1f} rad/s at most", min(lags[:2]) > FOLLOWS),
        _backwards([one, heavy, braked]),
        _shaken_by_lag([one, heavy]),
        Claim("5.2 (b)", "the heavier ball lags more", f"{lags[1]:.1f}, {lags[0]:.1f} rad/s",
              lags[1] > lags[0]),
        Claim("5.1 (c)", "after sufficient time the balls do not exceed -180 deg",
              f"{degrees(one.angles)}; {last[1]:.0f} deg after 15 s, held at 200 rad/s",
              bool((one.angles > -180.0).all()) and last[1] > -180.0),
        angle("5.1 (c)", "reached (section 5.2)", -150.0, float(one.angles.mean())),
        Claim("5.2 (c)", "greatly beyond -180 deg", f"by {-180.0 - heavy.angles.mean():.0f} deg "
              f"(ours: {FAR:g} deg)", bool((heavy.angles < -180.0 - FAR).all())),
        angle("5.2 (c)", "settles near the next balanced position", -540.0,
              float(heavy.angles.mean()),
              crept),
        angle("5.2 (c)", "settles (section 5.2)", -600.0, float(heavy.angles.mean())),
        Claim("5.3 (b)", "c_b = 2 reduces the lag",
              f"{lags[2]:.1f} in place of {lags[1]:.1f} rad/s", lags[2] < lags[1]),
        Claim("5.2 (c), 5.3 (c)", "as a result of the balls' lag they go so far",
              "their angle is the lag's integral over time", None, BY_CONSTRUCTION),
        _settles("5.2 (c)", 1.0, heavy),
        _settles("5.3 (c)", 0.5, braked),
        angle("5.3 (c)", "suppressed to", -200.0, float(braked.angles.mean())),
        Claim("5.1, 5.2, 5.3 (b)", "with rising speed the balls follow the rotor again",
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
              f"not within 2.5 s; after 15 s, held at 200 rad/s: {_list(last)} deg"),
        *drag_claims("5.5", drag, 0),
        *settled_claims(("5.5", "5.6"), drag, 0),
        *eccentricity_claims("5.6", eccentricity, 0),
    ]  # fmt: skip


def hold_claims(runs: dict[str, StartUp], drag: Ends, eccentricity: Ends) -> list[Claim]:
    """What section 5.2 states."""
    masses = at_drag(drag, 1, 1.0)
    return [
        *_place_and_time_claims(runs),
        *_longer_claims(runs),
        *promoted_claims(),
        stable_claim(),
        *moved_claims("5.11", HOLD),
        *_lag_claims(runs),
        Claim("5.10", "the heavier the balls, the farther they go",
              _list(masses) + " deg for m = 0.5, 1, 1.5, 2 g", bool(np.all(np.diff(masses) < 0))),
        Claim("5.10", "m = 1 g: nearly -180 deg; m = 1.5 g: an unbalanced position",
              _list(masses[1:3]) + " deg",
              bool(at_odd(np.array(masses[1]))) and not bool(at_odd(np.array(masses[2])))),
        *place_claims(),
        *drag_claims("5.11", drag, 1),
        *settled_claims(("5.11", "5.12"), drag, 1),
        trend_claim(drag),
        *eccentricity_claims("5.12", eccentricity, 1),
        *steadier_claims(eccentricity),
        quick_claim(runs["5.7"], runs["5.1"]),
        width_claim(),
    ]  # fmt: skip


def _place_and_time_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """Figures 5.7 to 5.9 (c)."""
    held = one, heavy, braked = [runs[HELD[number]] for number in PAIRS]
    without = [runs[number] for number in PAIRS]
    settled, before = [settled_after(run) for run in held], [settled_after(run) for run in without]
    still = last_range(heavy)
    went = float(np.ptp(np.degrees(heavy.trajectory.ball_angles[[-501, -1], 0])))
    back = heavy.trajectory.ball_angles[-1, 0] > heavy.trajectory.ball_angles[-501, 0]
    return [
        angle("5.7 (c)", "1 s after the critical speed", -200.0,
              float(np.degrees(at_time(one.trajectory.ball_angles, one, 3.5)).mean())),
        _settles("5.7 (c)", 1.0, one),
        Claim("5.8 (c)", "greatly beyond -540 deg, heading towards -900 deg",
              f"{degrees(heavy.angles)} at 5 s; {went:.0f} deg {'back' if back else 'further'} "
              f"than 0.5 s before (ours: by {FAR:g} deg)",
              bool((heavy.angles < -540.0 - FAR).all()) and not back),
        Claim("5.8 (c)", "not settled at 5 s",
              f"they swing over {still:.0f} deg in the last {STILL:g} s (ours: to stay within "
              f"{SETTLED:g} deg of their end)",
              settled[1] is None),
        Claim("5.7", "settled sooner than without the period", f"after {after(settled[0])}, "
              f"without {after(before[0])} (ours: by {HALF_SECOND:g} s)",
              (longer(settled[0], before[0]) or 0.0) < -HALF_SECOND),
        Claim("5.8", "settled later than without the period", f"{after(settled[1])}, without "
              f"{after(before[1])}", settled[1] is None and before[1] is not None),
        Claim("5.9", "greatly beyond -180 deg", f"{degrees(braked.angles)} (ours: by {FAR:g} deg)",
              bool((braked.angles < -180.0 - FAR).all())),
        Claim("5.9", "settled in an unbalanced position",
              f"{degrees(braked.angles)}; {braked.residual:.2f} of the disc's unbalance left",
              not bool(at_odd(braked.angles).any()) and last_range(braked) <= SETTLED),
    ]  # fmt: skip


def _longer_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """By how much the hold makes settling longer."""
    grown = {HELD[number]: longer(settled_after(runs[HELD[number]]), settled_after(runs[number]))
             for number in PAIRS}  # fmt: skip
    by_half = [figure for figure, x in grown.items()
               if x is not None and abs(x - 0.5) <= HALF_SECOND]  # fmt: skip
    by = ", ".join("not settled" if x is None else f"{x:+.2f} s" for x in grown.values())
    return [
        Claim("5.7, 5.8, 5.9", "the settling time grows by the period of 0.5 s",
              f"{by} (ours: within {HALF_SECOND:g} s)", len(by_half) == len(grown),
              f"in {', '.join(by_half) or 'none'} alone; the thesis' own 5.7 settles sooner"),
        Claim("5.9", "... in some cases (summary of section 5.2)",
              f"in {', '.join(by_half) or 'none'}", bool(by_half)),
    ]  # fmt: skip


def _lag_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """Figures 5.7 to 5.9 (b), and where the lag leads."""
    held = [runs[HELD[number]] for number in PAIRS]
    without = [runs[number] for number in PAIRS]
    during, lags = [lag_during_hold(run) for run in held], [lag(run) for run in held]
    braked = held[2]
    return [
        angle("5.9 (c)", "settled", -300.0, float(braked.angles.mean())),
        Claim("5.7, 5.8, 5.9 (b)", "in the hold the balls keep the rotor's speed",
              ", ".join(f"{x:.1f}" for x in during) + " rad/s behind it at most",
              max(during) < FOLLOWS),
        Claim("5.7, 5.8, 5.9 (b)", "after the hold they lag behind: the lag does not go away",
              ", ".join(f"{x:.1f}" for x in lags) + " rad/s", min(lags) > FOLLOWS),
        Claim("section 5.2", "the lag grows with m and falls with c_b",
              ", ".join(f"{x:.1f}" for x in lags) + " rad/s",
              lags[1] > lags[0] and lags[2] < lags[1]),
        reduced_claim(held, without),
        Claim("section 5.2", "the balls' movement is promoted",
              "; ".join(f"{r.angles.mean():.0f} in place of {w.angles.mean():.0f} deg"
                        for r, w in zip(held, without, strict=True)),
              all(r.angles.mean() < w.angles.mean()
                  for r, w in zip(held, without, strict=True))),
    ]  # fmt: skip


def _settles(figure: str, printed: float, run: StartUp) -> Claim:
    ours = settled_after(run)
    return Claim(
        figure, f"settled about {printed:g} s after the critical speed", after(ours),
        ours is not None and abs(ours - printed) <= HALF_SECOND,
    )  # fmt: skip


def _backwards(runs: list[StartUp]) -> Claim:
    """That balls that turn slower than the rotor turn backwards: as seen from it."""
    late = [run.trajectory["time"] > run.parameters.critical_time for run in runs]
    rates = [run.trajectory.ball_rates.min(axis=1) for run in runs]
    least = [float(each[at].min()) for each, at in zip(rates, late, strict=True)]
    own = [float((run.trajectory["speed"] + each)[at].min())
           for run, each, at in zip(runs, rates, late, strict=True)]  # fmt: skip
    return Claim(
        "chapter 5, 5.1, 5.2, 5.3", "this means that the balls turn backwards, relative to the "
        "rotor (the head of chapter 5: opposite to the motor)",
        f"{_tenths(least)} rad/s relative to it; their own speed is {_tenths(own)} rad/s at least "
        "above the critical speed, with the motor's direction", max(least) < 0.0,
    )  # fmt: skip


def _shaken_by_lag(runs: list[StartUp]) -> Claim:
    """That balls that turn slower than the rotor shake it; noise is not computed."""
    fixed = start_ups([(run.parameters._replace(c_b=HELD_IN_PLACE), None) for run in runs])
    own, other = [shaking(run) for run in runs], [shaking(run) for run in fixed]
    return Claim(
        "chapter 5, 5.1, 5.2", "such balls cause vibration near the critical speed",
        f"W/e, root mean square from it on: {_tenths(own)}; {_tenths(other)} with the same balls "
        f"held in place by c_b = {HELD_IN_PLACE:g} N s/m (ours: {CAUSED:.0%} more)",
        all(x >= (1.0 + CAUSED) * y for x, y in zip(own, other, strict=True)),
    )  # fmt: skip


def _balanced_where(drag: Ends) -> Claim:
    """That odd multiples of -180 deg are the balanced positions."""
    left = [THESIS._replace(m=m).carried for m in MASSES]
    return Claim(
        "5.2 (c)", "odd multiples of -180 deg are the balanced positions",
        ", ".join(f"{abs(1.0 - share):.2f}" for share in left)
        + " of the disc's unbalance left there with m = 0.5, 1, 1.5, 2 g (ours: "
        f"{BALANCED:g} at most)",
        all(abs(1.0 - share) <= BALANCED for share in left),
        "true for 0.5 g only; heavier balls balance on both sides of it",
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
    batch = simulate_batch(load_scene(BASE), variations, every=10)
    for c_b, run in zip(drags, batch.runs, strict=True):
        p = THESIS._replace(c_b=c_b)
        left.append(StartUp(p, None, run.scene, run.trajectory).residual)
    return Claim(
        "section 5.1", "a large c_b makes the balancer worse above the critical speed",
        ", ".join(f"{x:.2f}" for x in left) + " of the disc's unbalance left for c_b = 1, 2, 4 "
        "after 10 s at 200 rad/s, from 90 and -150 deg (ours: each by "
        f"{WORSE:g} more)", bool(np.all(np.diff(left) >= WORSE)),
    )  # fmt: skip


def _at_last() -> list[float]:
    """Where balls of ``MASSES`` are after 15 s, the last 10 s at 200 rad/s [deg]."""
    drives = [(THESIS._replace(m=m), None) for m in MASSES]
    runs = start_ups(drives, every=10, target=200.0, duration=15.0)
    return [float(run.angles.mean()) for run in runs]


def _tenths(values: list[float]) -> str:
    return ", ".join(f"{value:.1f}" for value in values)


def _list(values: list[float]) -> str:
    return ", ".join(f"{value:.0f}" for value in values)
