"""Sections 4.2 and 4.3: with a variable-speed period at constant speed, and accelerating."""

from pathlib import Path

import numpy as np
from scipy.signal import find_peaks

from ab_sim.papers.page import Section
from ab_sim.papers.thesis.causes import (
    alike_claim,
    joined_claim,
    sooner_claim,
)
from ab_sim.papers.thesis.claims import (
    ABOUT,
    BALANCED,
    READ,
    TIMED,
    Claim,
    degrees,
    opposite,
    table_of,
    value,
)
from ab_sim.papers.thesis.drive import (
    HOLD,
    OPPOSITE,
    THESIS,
    Period,
    StartUp,
    Tell,
    start_ups,
)
from ab_sim.papers.thesis.matched import matched_table, suppresses
from ab_sim.papers.thesis.measures import (
    at_time,
    course_apart,
    entered,
    pushed,
    seconds,
    turned_back,
)
from ab_sim.papers.thesis.pictures import FORCES, histories
from ab_sim.papers.thesis.without_period import ALIKE, SAME_TIME, SOON

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
SLOWER = "4.15, 4.16, 4.17"
"""Figures of a half, a quarter and three quarters of the acceleration."""
QUARTER = 0.25
"""Share of a rise that what "hardly changes" explains at most; ours."""
SLOW = 2.0
""""Not immediately": so many times as late after the critical speed as in 4.7; ours."""
ACCELERATIONS = (-20.0, -10.0, 0.0, 5.0, 10.0, 20.0, 30.0, 40.0)
"""In the period [rad/s^2]."""
NOT_GONE = (
    f"with this set two balls at -180 deg leave {THESIS.carried - 1:.2f} of the disc's unbalance, "
    f"because 2 m R is {THESIS.carried:.2f} times M0 e; balance is at "
    f"+-{np.degrees(np.arccos(-1 / THESIS.carried)):.1f} deg"
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
        (
            table_of("Constant speed in the period", [*hold_claims(runs), suppresses(tell)]),
            matched_table(tell),
        ),
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
    rise = [float(at_time(hold.whirl, hold, time)) for time in (1.5, 2.0, 2.5, 2.75, 3.0, 3.25)]
    stronger = peak / without.peak[0], hold.forward_peak[0] / without.forward_peak[0]
    claims = [
        Claim(
            "4.7 (a)", "W/e grows gradually with the speed until the period is over",
            ", ".join(f"{whirl:.0f}" for whirl in rise) + " at 1.5, 2, 2.5, 2.75, 3, 3.25 s",
            bool(np.all(np.diff(rise) > 0.0)),
        ),
        value("4.7 (a)", "peak W/e", 62.0, peak),
        value("4.7 (a)", "when, right after the period", 3.3, when, " s", TIMED),
        value("4.7 (a)", "more than in 4.1", 7.0, peak - without.peak[0]),
        value("4.7 (b)", "largest driving force", 0.07, hold.forward_peak[0], " N"),
        value("4.7 (b)", "when, as the whirl", 3.3, hold.forward_peak[1], " s", TIMED),
        _both("4.7 (c), 4.8", hold),
        Claim(
            "4.7", "whirl and force, larger than in 4.1, take the balls there",
            f"W/e by {stronger[0] - 1:.0%} and force by {stronger[1] - 1:.0%} more; "
            f"{hold.angles.mean():.0f} deg in place of {without.angles.mean():.0f}",
            min(stronger) > 1.0 and bool(opposite(hold.angles).all())
            and not opposite(without.angles).any(),
        ),
        _balance("4.7, 4.8", hold, without),
        Claim(
            "4.9 (a)", "W/e as in 4.7, in size and course",
            f"peak {split.peak[0]:.1f} at {split.peak[1]:.2f} s; courses "
            f"{course_apart(split, hold):.0%} of the peak apart {ALIKE}",
            abs(split.peak[0] / peak - 1) < ABOUT and abs(split.peak[1] - when) < SAME_TIME
            and course_apart(split, hold) < ABOUT,
        ),
        Claim(
            "4.9 (b)", "forces differ up to about 3 s, then are approximately equal",
            f"differ by {before:.0%} of the largest at most from 2 to 3 s, {after:.0%} after that "
            f"(ours: more, and less than {ABOUT:.0%})", before > ABOUT > after,
        ),
        value("4.9 (b)", "largest driving force (text of 4.11)", 0.07, split.forward_peak[0], " N"),
        _both("4.9 (c), 4.10", split),
        Claim(
            "4.9 (c)", "they do so after the point about three seconds",
            f"both first there at {seconds(entered(split)[0])}, for good from "
            f"{seconds(entered(split)[1])}: they swing about it (ours: first within {ABOUT:.0%} "
            "of 3 s)",
            3.0 < (entered(split)[0] or np.inf) < 3.0 * (1.0 + ABOUT),
        ),
        joined_claim(split),
        _balance("4.9, 4.10", split, runs["4.3"]),
        Claim(
            "4.11 (a)", "W/e at about 3.3 s larger than in 4.7",
            f"peak {other.peak[0]:.1f} at {other.peak[1]:.2f} s, in 4.7 {peak:.1f} at "
            f"{when:.2f} s (ours: both to {TIMED:.0%} of 3.3 s)",
            other.peak[0] > peak
            and all(abs(at - 3.3) <= TIMED * 3.3 for at in (other.peak[1], when)),
        ),
        value("4.11 (b)", "largest driving force", 0.08, other.forward_peak[0], " N"),
        value("4.11 (b)", "when, as the whirl", 3.3, other.forward_peak[1], " s", TIMED),
        Claim(
            "4.11 (b)", "a bit larger than in 4.7 (b) and 4.9 (b)",
            f"{other.forward_peak[0]:.4f}, {hold.forward_peak[0]:.4f}, "
            f"{split.forward_peak[0]:.4f} N",
            other.forward_peak[0] > max(hold.forward_peak[0], split.forward_peak[0]),
        ),
        Claim(
            "4.11 (b)", "both balls' forces are almost the same, in size and course",
            f"differ by {_apart(other, slice(2500, 5000)):.0%} of the largest at most from 2.5 s "
            f"on (ours: {ABOUT:.0%})", _apart(other, slice(2500, 5000)) < ABOUT,
        ),
        _as_first(other, hold),
        _both("4.11 (c), 4.12", other),
        Claim(
            "4.11 (c)", "they move there smoothly",
            f"until both are there at {seconds(entered(other)[0])} neither turns back by more than "
            f"{turned_back(other, entered(other)[0]):.0f} deg (ours: {READ:g})",
            turned_back(other, entered(other)[0]) <= READ,
        ),
        Claim(
            "4.11 (c)", "... and about alike",
            f"they end {abs(np.diff(other.angles)[0]):.0f} deg apart, 45 deg at the start (ours: "
            f"{OPPOSITE:g} deg)", abs(np.diff(other.angles)[0]) <= OPPOSITE,
        ),
        alike_claim(other, hold),
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
                f"{degrees(run.angles)} at 5 s (ours: {SLOW:g} times as late after the critical "
                "speed)", took > SLOW * quick,
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
    rising = half.forward[2500 : int(np.argmax(half.forward)) + 1]
    return [
        Claim(
            "4.15 (a)", "peak W/e almost that of 4.7",
            f"{half.peak[0]:.1f}, in 4.7 {hold.peak[0]:.1f} (ours: to {ABOUT:.0%})",
            abs(half.peak[0] / hold.peak[0] - 1) < ABOUT,
        ),
        value("4.15 (a)", "when, sooner than in 4.7", 3.0, half.peak[1], " s", TIMED),
        Claim(
            "4.15 (b)", "one hump in place of the twin hump of 4.7 (b)",
            f"{humps[1]} maximum, in 4.7 {humps[0]}", humps == (2, 1),
        ),
        Claim(
            "4.15 (b)", "the force rises continuously and smoothly from 2.5 s on",
            f"from {rising[0]:.3f} to {rising[-1]:.3f} N, "
            + ("without ever falling" if np.all(np.diff(rising) >= 0.0) else "with dips"),
            bool(np.all(np.diff(rising) >= 0.0)),
        ),
        value("4.15 (b)", "... to its peak at", 3.0, half.forward_peak[1], " s", TIMED),
        Claim(
            "4.15 (c)", "the balls reach -180 deg sooner than in 4.7",
            f"{_settled(half)}; in 4.7 {_settled(hold)}",
            half.settling is not None and hold.settling is not None
            and half.settling < hold.settling,
        ),
        sooner_claim(half, hold),
        _both("4.15 (c), as 4.8", half),
        _balance("4.15, as 4.8", half, runs["4.1"]),
        Claim(
            f"{SLOWER} (c)",
            "the smaller the acceleration in the period, the farther the balls go",
            f"at 10, 20, 30 rad/s^2: {', '.join(f'{end:.0f}' for end in went)} deg at 5 s",
            bool(np.all(np.diff(went) > 0)),
        ),
        Claim(
            "section 4.3", "the acceleration in the period controls how far the balls go",
            f"at {', '.join(f'{value:g}' for value in ACCELERATIONS)} rad/s^2: "
            f"{', '.join(f'{end:.0f}' for end in reach)} deg at 5 s (ours: one way from 0 to 40 "
            f"but for {READ:g} deg)",
            bool(np.all(np.diff(from_hold) > -READ)) and from_hold[-1] - from_hold[0] > READ,
            "one end has two accelerations",
        ),
        Claim(
            f"{SLOWER} (b)", "the largest force hardly changes ...",
            ", ".join(f"{force:.4f}" for force in forces) + " N at 10, 20, 30 rad/s^2: by "
            f"{max(forces) / min(forces) - 1:.0%} (ours: to {ABOUT:.0%})",
            max(forces) / min(forces) - 1 <= ABOUT,
        ),
        Claim(
            f"{SLOWER} (b)", "... but comes later where the acceleration is small",
            ", ".join(f"{time:.2f}" for time in times) + " s at 10, 20, 30 rad/s^2",
            bool(np.all(np.diff(times) < 0)),
        ),
        _why_farther(slower),
        _encouraged(slower, runs["4.1"]),
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


def _as_first(other: StartUp, hold: StartUp) -> Claim:
    """That 4.11 (b) is as 4.7 (b): the text may mean that, or its two balls."""
    (size, when), (size_7, when_7) = other.forward_peak, hold.forward_peak
    apart = float(np.sqrt(np.mean((other.forces - hold.forces) ** 2)) / size_7)
    return Claim(
        "4.11 (b)", "the force almost as in 4.7 (b), too, if that is meant",
        f"{size:.4f} N at {when:.2f} s, in 4.7 {size_7:.4f} N at {when_7:.2f} s; courses "
        f"{apart:.1%} of the peak apart {ALIKE}",
        bool(abs(size / size_7 - 1) < ABOUT and abs(when - when_7) < SAME_TIME and apart < ABOUT),
        "size and time of the peak are, the course just is not",
    )  # fmt: skip


def _why_farther(slower: list[StartUp]) -> Claim:
    """That the balls go farther because the force peaks later, not because it is larger.

    A ball that drag holds goes as far as the force's integral over time, over c_b R. Of two runs'
    ratio of integrals the ratio of peaks is one part, that of how long they last the other.
    """
    far, near = slower[0], slower[-1]
    more = pushed(far) / pushed(near)
    size = float(np.log(far.forward_peak[0] / near.forward_peak[0]) / np.log(more))
    return Claim(
        SLOWER, "they go farther because the force comes later, not because it is larger",
        f"its integral over time, which moves them, is {more - 1:.0%} more at 10 than at 30 "
        f"rad/s^2: {size:.0%} of that by its size, the rest by how long it lasts (ours: by its "
        f"size {QUARTER:.0%} at most)", size <= QUARTER,
        f"its size explains {size:.0%}",
    )  # fmt: skip


def _encouraged(slower: list[StartUp], without: StartUp) -> Claim:
    """That the balls move farther right after the critical speed than without a period."""
    went = [
        float(np.degrees(at_time(run.trajectory.ball_angles, run, 2.5 + SOON)).mean())
        for run in (*slower, without)
    ]
    return Claim(
        SLOWER, "it encourages the balls to move immediately after the critical speed",
        f"{SOON:g} s after it they are at " + ", ".join(f"{angle:.0f}" for angle in went[:-1])
        + f" deg, in 4.1 at {went[-1]:.0f} deg (ours: {READ:g} deg farther)",
        max(went[:-1]) <= went[-1] - READ,
    )  # fmt: skip


def _both(figure: str, run: StartUp) -> Claim:
    return Claim(
        figure, "both balls move to the vicinity of -180 deg", f"{degrees(run.angles)} at 5 s",
        bool(opposite(run.angles).all()),
    )  # fmt: skip


def _balance(figure: str, run: StartUp, without: StartUp) -> Claim:
    ours = (
        f"{run.residual:.2f} of the disc's unbalance, without a period {without.residual:.2f} "
        f"(ours: {BALANCED:g} at most)"
    )
    return Claim(
        figure, "residual unbalance is eliminated", ours, run.residual <= BALANCED, NOT_GONE
    )


def _settled(run: StartUp) -> str:
    took = run.settling
    return "never at -180 deg" if took is None else f"{took:.2f} s from the period's start"


def _apart(run: StartUp, steps: slice) -> float:
    """By how much the forces on both balls differ at most, over the largest of them."""
    forces = np.abs(run.forces[steps])
    return float(np.abs(np.diff(run.forces[steps], axis=1)).max() / forces.max())


def _humps(run: StartUp) -> int:
    """Maxima of the forward force."""
    force = run.forward
    return len(find_peaks(force, prominence=0.02 * force.max())[0])
