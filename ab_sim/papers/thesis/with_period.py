"""Sections 4.2 and 4.3: with a variable-speed period at constant speed, and accelerating."""

from pathlib import Path

import numpy as np
from scipy.signal import find_peaks

from ab_sim.papers.page import Cell, Section, Table
from ab_sim.papers.thesis.claims import ABOUT, Claim, degrees, opposite, table_of, value
from ab_sim.papers.thesis.drive import HOLD, THESIS, Period, StartUp, Tell, start_ups
from ab_sim.papers.thesis.many import ends
from ab_sim.papers.thesis.measures import course_apart, entered, seconds
from ab_sim.papers.thesis.pictures import FORCES, histories

CASES = {
    "4.1": (THESIS, None),
    "4.3": (THESIS._replace(starts=(45.0, -45.0)), None),
    "4.5": (THESIS._replace(starts=(45.0, 90.0)), None),
    "4.7": (THESIS, HOLD),
    "4.9": (THESIS._replace(starts=(45.0, -45.0)), HOLD),
    "4.11": (THESIS._replace(starts=(45.0, 90.0)), HOLD),
    "4.13": (THESIS, Period(2.0)),
    "4.14": (THESIS, Period(3.0)),
    "4.15": (THESIS, Period(acceleration=20.0)),
    "4.16": (THESIS, Period(acceleration=10.0)),
    "4.17": (THESIS, Period(acceleration=30.0)),
    "4.18": (THESIS, Period(acceleration=-20.0)),
}
ALIKE = 0.1
""""Almost the same", relative, as in section 4.1."""
HARDLY = 0.05
""""Hardly changes", relative: ours; 0.06 to 0.07 N is an increase to the thesis."""
SLOW = 2.0
""""Not immediately": so many times as late after the critical speed as in 4.7; ours."""
ACCELERATIONS = (-20.0, -10.0, 0.0, 5.0, 10.0, 20.0, 30.0, 40.0)
"""In the period [rad/s^2]."""
SETTLED_AFTER = 14.0
"""A start-up to 200 rad/s has come to rest [s]."""
NOT_GONE = (
    "with this set two balls at -180 deg leave 1.04 of the disc's unbalance, because 2 m R is 2.04 "
    "times M0 e; balance is at +-119.3 deg"
)


def all_runs() -> dict[str, StartUp]:
    """By the figure's number."""
    return dict(zip(CASES, start_ups(list(CASES.values())), strict=True))


def period_sections(folder: Path, tell: Tell) -> tuple[Section, Section]:
    """Figures 4.7 to 4.18."""
    tell("sections 4.2 and 4.3", 0, 1)
    runs = all_runs()

    held = Section(
        "4.2 A period at constant speed: figures 4.7 to 4.14",
        (),
        (table_of("Constant speed in the period", hold_claims(runs)), matched_table(tell)),
        (
            histories(
                folder, "4.7", {n: runs[n] for n in ("4.7", "4.9", "4.11")}, FORCES,
                "Figures 4.7, 4.9 and 4.11: 0.5 s at the critical speed, three starts",
            ),
            histories(
                folder, "4.13", {n: runs[n] for n in ("4.13", "4.14")}, FORCES,
                "Figures 4.13 and 4.14: the hold earlier and later",
            ),
        ),
    )  # fmt: skip
    accelerated = Section(
        "4.3 A period of lower acceleration: figures 4.15 to 4.18",
        (),
        (table_of("Constant acceleration in the period", acceleration_claims(runs)),),
        (
            histories(
                folder, "4.15", {n: runs[n] for n in ("4.15", "4.16", "4.17", "4.18")}, FORCES,
                "Figures 4.15 to 4.18: a half, a quarter, three quarters of the acceleration, "
                "deceleration by a half",
            ),
        ),
    )  # fmt: skip
    return held, accelerated


def hold_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """What section 4.2 states."""
    without, hold = runs["4.1"], runs["4.7"]
    peak, when = hold.peak
    split, other = runs["4.9"], runs["4.11"]
    before, after = _apart(split, slice(2000, 3000)), _apart(split, slice(3000, 5000))
    claims = [
        value("4.7 (a)", "peak W/e", 62.0, peak),
        value("4.7 (a)", "when, right after the period", 3.3, when, " s", 0.05),
        value("4.7 (a)", "more than in 4.1", 7.0, peak - without.peak[0]),
        value("4.7 (b)", "largest driving force", 0.07, hold.forward_peak[0], " N"),
        value("4.7 (b)", "when, as the whirl", 3.3, hold.forward_peak[1], " s", 0.05),
        _both("4.7 (c), 4.8", hold),
        _balance("4.7, 4.8", hold, without),
        Claim(
            "4.9 (a)", "W/e as in 4.7, in size and course",
            f"peak {split.peak[0]:.1f} at {split.peak[1]:.2f} s; courses "
            f"{course_apart(split, hold):.0%} of the peak apart",
            abs(split.peak[0] / peak - 1) < ALIKE and abs(split.peak[1] - when) < ALIKE
            and course_apart(split, hold) < ALIKE,
        ),
        Claim(
            "4.9 (b)", "forces differ up to about 3 s, then are approximately equal",
            f"apart by {before:.0%} of the largest from 2 to 3 s, {after:.0%} after that (ours: "
            "more than 30 %, less than 15 %)", before > 2.0 * ABOUT and after < ABOUT,
        ),
        _both("4.9 (c), 4.10", split),
        Claim(
            "4.9 (c)", "they do so after the point about three seconds",
            f"both first there at {seconds(entered(split)[0])}, for good from "
            f"{seconds(entered(split)[1])}: they swing about it",
            3.0 < (entered(split)[0] or np.inf) < 3.0 * (1.0 + ABOUT),
        ),
        _balance("4.9, 4.10", split, runs["4.3"]),
        Claim(
            "4.11 (a)", "W/e at about 3.3 s larger than in 4.7",
            f"peak {other.peak[0]:.1f}, in 4.7 {peak:.1f}", other.peak[0] > peak,
        ),
        value("4.11 (b)", "largest driving force", 0.08, other.forward_peak[0], " N"),
        Claim(
            "4.11 (b), (c)", "both balls feel and do about the same at about 3.3 s",
            f"forces apart by {_apart(other, slice(3200, 3400)):.0%}; they end "
            f"{abs(np.diff(other.angles)[0]):.0f} deg apart, 45 deg at the start",
            _apart(other, slice(3200, 3400)) < ABOUT and abs(np.diff(other.angles)[0]) < 20.0,
        ),
        _both("4.11 (c), 4.12", other),
        _balance("4.11, 4.12", other, runs["4.5"]),
    ]  # fmt: skip
    for number in ("4.13", "4.14"):
        run = runs[number]
        quick = (entered(hold)[0] or np.inf) - THESIS.critical_time
        took = (entered(run)[0] or np.inf) - THESIS.critical_time
        claims.append(
            Claim(
                f"{number} (c)", "the balls do not reach the vicinity of -180 deg immediately",
                f"first there {seconds(entered(run)[0])}, in 4.7 {seconds(entered(hold)[0])}; "
                f"{degrees(run.angles)} at 5 s", took > SLOW * quick,
            )
        )  # fmt: skip
    return claims


def acceleration_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """What section 4.3 states."""
    hold, half = runs["4.7"], runs["4.15"]
    slower = [runs[number] for number in ("4.16", "4.15", "4.17")]
    swept = start_ups([(THESIS, Period(acceleration=value)) for value in ACCELERATIONS])
    reach = [float(run.angles.mean()) for run in swept]
    braked = runs["4.18"]
    went = [float(run.angles.mean()) for run in slower]
    forces = [run.forward_peak[0] for run in slower]
    times = [run.forward_peak[1] for run in slower]
    from_hold = [end for at, end in zip(ACCELERATIONS, reach, strict=True) if at >= 0.0]
    humps = _humps(hold), _humps(half)
    return [
        Claim(
            "4.15 (a)", "peak W/e almost that of 4.7",
            f"{half.peak[0]:.1f}, in 4.7 {hold.peak[0]:.1f}",
            abs(half.peak[0] / hold.peak[0] - 1) < ALIKE,
        ),
        value("4.15 (a)", "when, sooner than in 4.7", 3.0, half.peak[1], " s", 0.05),
        Claim(
            "4.15 (b)", "one hump in place of the twin hump of 4.7 (b)",
            f"{humps[1]} maximum, in 4.7 {humps[0]}", humps == (2, 1),
        ),
        Claim(
            "4.15 (c)", "the balls reach -180 deg sooner than in 4.7",
            f"{_settled(half)}; in 4.7 {_settled(hold)}",
            half.settling is not None and hold.settling is not None
            and half.settling < hold.settling,
        ),
        Claim(
            "4.15-4.17 (c)",
            "the smaller the acceleration in the period, the farther the balls go",
            f"at 10, 20, 30 rad/s^2: {', '.join(f'{end:.0f}' for end in went)} deg at 5 s",
            bool(np.all(np.diff(went) > 0)),
        ),
        Claim(
            "4.3", "the acceleration in the period controls how far the balls go",
            f"at {', '.join(f'{value:g}' for value in ACCELERATIONS)} rad/s^2: "
            f"{', '.join(f'{end:.0f}' for end in reach)} deg at 5 s (ours: one way from 0 to 40)",
            bool(np.all(np.diff(from_hold) > 0)),
            "farthest at 5 rad/s^2; the same end has two accelerations",
        ),
        Claim(
            "4.15-4.17 (b)", "the largest force hardly changes ...",
            ", ".join(f"{force:.4f}" for force in forces) + " N at 10, 20, 30 rad/s^2",
            max(forces) / min(forces) - 1 < HARDLY,
            f"by {max(forces) / min(forces) - 1:.0%}, and the later the larger; ours: "
            f"{HARDLY:.0%}, as the thesis calls 0.06 to 0.07 N an increase",
        ),
        Claim(
            "4.15-4.17 (b)", "... but comes later where the acceleration is small",
            ", ".join(f"{time:.2f}" for time in times) + " s at 10, 20, 30 rad/s^2",
            bool(np.all(np.diff(times) < 0)),
        ),
        Claim(
            "4.18", "deceleration inhibits whirl, force and the balls' movement",
            f"peak W/e {braked.peak[0]:.1f}, force {braked.forward_peak[0]:.4f} N, "
            f"{degrees(braked.angles)} at 5 s; in 4.7 {hold.peak[0]:.1f}, "
            f"{hold.forward_peak[0]:.4f} N, {degrees(hold.angles)}; less than in 4.1, too",
            all(
                braked.peak[0] < one.peak[0] and braked.forward_peak[0] < one.forward_peak[0]
                and bool(np.all(braked.angles > one.angles)) for one in (hold, runs["4.1"])
            ),
        ),
    ]  # fmt: skip


def _both(figure: str, run: StartUp) -> Claim:
    return Claim(
        figure, "both balls move to the vicinity of -180 deg", f"{degrees(run.angles)} at 5 s",
        bool(opposite(run.angles).all()),
    )  # fmt: skip


def matched_table(tell: Tell) -> Table:
    """Balls of which two at -180 deg do balance, beside the thesis' own; not its statement."""
    own = 0.5 * THESIS.M * THESIS.e / (THESIS.R + THESIS.e)
    light = THESIS._replace(m=own, c_b=own / THESIS.m * THESIS.c_b)
    cases = [(p, period) for p in (THESIS, light) for period in (None, HOLD)]
    settled = ends("balls that match", cases, tell, 200.0, SETTLED_AFTER)
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


def _balance(figure: str, run: StartUp, without: StartUp) -> Claim:
    ours = f"{run.residual:.2f} of the disc's unbalance, without a period {without.residual:.2f}"
    return Claim(figure, "residual unbalance is eliminated", ours, run.residual < 0.1, NOT_GONE)


def _settled(run: StartUp) -> str:
    took = run.settling
    return "never at -180 deg" if took is None else f"{took:.2f} s from the period's start"


def _apart(run: StartUp, steps: slice) -> float:
    """How far the forces on both balls are from each other, over the largest of them."""
    forces = np.abs(run.forces[steps])
    return float(np.abs(np.diff(run.forces[steps], axis=1)).max() / forces.max())


def _humps(run: StartUp) -> int:
    """Maxima of the forward force."""
    force = run.forward
    return len(find_peaks(force, prominence=0.02 * force.max())[0])
