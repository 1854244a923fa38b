"""Sections 4.2 and 4.3: with a variable-speed period at constant speed, and accelerating."""

from pathlib import Path

import numpy as np

from gallery.page import PageSection
from gallery.thesis.accelerated import acceleration_claims
from gallery.thesis.causes import alike_claim, joined_claim
from gallery.thesis.claims import (
    ABOUT,
    READ,
    TIMED,
    UNDECIDED,
    Claim,
    barely_opposite,
    degrees,
    opposite,
    table_of,
    value,
)
from gallery.thesis.drive import (
    HOLD,
    OPPOSITE,
    THESIS,
    Period,
    StartUp,
    Tell,
    start_ups,
)
from gallery.thesis.matched import balance_claim, both_claim, matched_table, suppresses
from gallery.thesis.measures import (
    at_time,
    course_apart,
    entered,
    seconds,
    turned_back,
)
from gallery.thesis.pictures import FORCES, histories
from gallery.thesis.without_period import ALIKE, SAME_TIME

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


def all_runs() -> dict[str, StartUp]:
    """By the figure's number."""
    return dict(zip(CASES, start_ups(list(CASES.values())), strict=True))


def period_sections(folder: Path, tell: Tell) -> tuple[PageSection, PageSection]:
    """Figures 4.7 to 4.18."""
    tell("sections 4.2 and 4.3", 0, 1)
    runs = all_runs()

    held = PageSection(
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
    accelerated = PageSection(
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
    return [
        *_first_claims(runs), *_split_claims(runs), *_other_claims(runs),
        *(_not_there(number, runs) for number in ("4.13", "4.14")),
    ]  # fmt: skip


def _first_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """Figure 4.7."""
    without, hold = runs["4.1"], runs["4.7"]
    peak, when = hold.peak
    rise = [float(at_time(hold.whirl, hold, time)) for time in (1.5, 2.0, 2.5, 2.75, 3.0, 3.25)]
    stronger = peak / without.peak[0], hold.forward_peak[0] / without.forward_peak[0]
    return [
        Claim(
            "4.7 (a)", "W/e grows gradually with the speed until the period is over",
            ", ".join(f"{whirl:.0f}" for whirl in rise) + " at 1.5, 2, 2.5, 2.75, 3, 3.25 s",
            bool(np.all(np.diff(rise) > 0.0)),
        ),
        value("4.7 (a)", "peak W/e", 62.0, peak),
        value("4.7 (a)", "time of the peak, right after the period", 3.3, when, " s", TIMED),
        value("4.7 (a)", "increase of the peak from 4.1", 7.0, peak - without.peak[0]),
        value("4.7 (b)", "largest driving force", 0.07, hold.forward_peak[0], " N"),
        value("4.7 (b)", "time of the largest force, as of the whirl", 3.3,
              hold.forward_peak[1], " s", TIMED),
        both_claim("4.7 (c), 4.8", hold),
        Claim(
            "4.7", "whirl and force, larger than in 4.1, take the balls there",
            f"W/e by {stronger[0] - 1:.0%} and force by {stronger[1] - 1:.0%} more; "
            f"{hold.angles.mean():.0f} deg in place of {without.angles.mean():.0f}",
            min(stronger) > 1.0 and bool(opposite(hold.angles).all())
            and not opposite(without.angles).any(),
        ),
        balance_claim("4.7, 4.8", hold, without),
    ]  # fmt: skip


def _split_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """Figure 4.9."""
    hold, split = runs["4.7"], runs["4.9"]
    peak, when = hold.peak
    before, after = _until_and_after(split)
    return [
        Claim(
            "4.9 (a)", "W/e as in 4.7, in size and course",
            f"peak {split.peak[0]:.1f} at {split.peak[1]:.2f} s; courses "
            f"{course_apart(split, hold):.0%} of the peak apart {ALIKE}",
            abs(split.peak[0] / peak - 1) < ABOUT and abs(split.peak[1] - when) < SAME_TIME
            and course_apart(split, hold) < ABOUT,
        ),
        Claim(
            "4.9 (b)", "forces differ up to about 3 s, then are approximately equal",
            f"differ by {before:.0%} of the figure's largest at most until 3 s, {after:.0%} after "
            f"that (ours: more, and less than {ABOUT:.0%})", before > ABOUT > after,
        ),
        value("4.9 (b)", "largest driving force (text of 4.11)", 0.07, split.forward_peak[0], " N"),
        both_claim("4.9 (c), 4.10", split),
        Claim(
            "4.9 (c)", "they do so after the point about three seconds",
            f"both first there at {seconds(entered(split)[0])}, for good from "
            f"{seconds(entered(split)[1])}: they swing about it (ours: first within {ABOUT:.0%} "
            "of 3 s)",
            3.0 < (entered(split)[0] or np.inf) < 3.0 * (1.0 + ABOUT),
        ),
        joined_claim(split),
        balance_claim("4.9, 4.10", split, runs["4.3"]),
    ]  # fmt: skip


def _other_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """Figure 4.11."""
    hold, split, other = runs["4.7"], runs["4.9"], runs["4.11"]
    peak, when = hold.peak
    early, late = _until_and_after(other)
    return [
        Claim(
            "4.11 (a)", "W/e at about 3.3 s larger than in 4.7",
            f"peak {other.peak[0]:.1f} at {other.peak[1]:.2f} s, in 4.7 {peak:.1f} at "
            f"{when:.2f} s (ours: both to {TIMED:.0%} of 3.3 s)",
            other.peak[0] > peak
            and all(abs(at - 3.3) <= TIMED * 3.3 for at in (other.peak[1], when)),
        ),
        value("4.11 (b)", "largest driving force", 0.08, other.forward_peak[0], " N"),
        value("4.11 (b)", "time of the largest force, as of the whirl", 3.3,
              other.forward_peak[1], " s", TIMED),
        Claim(
            "4.11 (b)", "a bit larger than in 4.7 (b) and 4.9 (b)",
            f"{other.forward_peak[0]:.4f}, {hold.forward_peak[0]:.4f}, "
            f"{split.forward_peak[0]:.4f} N",
            other.forward_peak[0] > max(hold.forward_peak[0], split.forward_peak[0]),
        ),
        Claim(
            "4.11 (b)", "both balls' forces are almost the same, in size and course",
            f"differ by {early:.0%} of the figure's largest at most until 3 s, {late:.0%} after "
            f"that (ours: {ABOUT:.0%} at most)", max(early, late) <= ABOUT,
        ),
        _as_first(other, hold),
        both_claim("4.11 (c), 4.12", other),
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
        balance_claim("4.11, 4.12", other, runs["4.5"]),
    ]  # fmt: skip


def _not_there(number: str, runs: dict[str, StartUp]) -> Claim:
    """Figures 4.13 and 4.14; only the English adds "immediately"."""
    run, first = runs[number], entered(runs[number])[0]
    barely = barely_opposite(run.angles)
    return Claim(
        f"{number} (c)", "the balls do not reach the vicinity of -180 deg",
        f"first there {seconds(first)}, in 4.7 {seconds(entered(runs['4.7'])[0])}; "
        f"{degrees(run.angles)} at 5 s", None if barely else first is None,
        (f"{UNDECIDED}: " if barely else "") + f"within this page's {OPPOSITE:g} deg they do, at "
        "the figure's end (English: not immediately)"
        + (f"; within {OPPOSITE - READ:g} deg, as far as figures can be read, they do not"
           * barely),
    )  # fmt: skip


def _as_first(other: StartUp, hold: StartUp) -> Claim:
    """That 4.11 (b) is as 4.7 (b): the text may mean that, or its two balls."""
    (size, when), (size_7, when_7) = other.forward_peak, hold.forward_peak
    apart = float(np.sqrt(np.mean((other.forces - hold.forces) ** 2)) / size_7)
    return Claim(
        "4.11 (b)", "the force is also almost as in 4.7 (b), if that is meant",
        f"{size:.4f} N at {when:.2f} s, in 4.7 {size_7:.4f} N at {when_7:.2f} s; courses "
        f"{apart:.1%} of the peak apart {ALIKE}",
        bool(abs(size / size_7 - 1) < ABOUT and abs(when - when_7) < SAME_TIME and apart < ABOUT),
        "its peak is alike; its course differs slightly too much",
    )  # fmt: skip


def _until_and_after(run: StartUp) -> tuple[float, float]:
    """By how much the forces on both balls differ at most, until 3 s and then.

    Over the largest force of the figure, which is what its axis shows.
    """
    apart = np.abs(np.diff(run.forces, axis=1)).max(axis=1) / np.abs(run.forces).max()
    early = run.trajectory["time"] <= 3.0
    return float(apart[early].max()), float(apart[~early].max())
