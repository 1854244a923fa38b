"""Section 4.1: start-ups without a variable-speed period."""

from pathlib import Path

import numpy as np

from gallery.page import Cell, PageSection, Table
from gallery.thesis.causes import necessary_claim, parted_claim, remains_claim
from gallery.thesis.claims import (
    ABOUT,
    BALANCED,
    TIMED,
    Claim,
    degrees,
    opposite,
    table_of,
    value,
)
from gallery.thesis.drive import (
    HOLD,
    OPPOSITE,
    THESIS,
    Parameters,
    StartUp,
    Tell,
    start_ups,
)
from gallery.thesis.measures import at_time, course_apart
from gallery.thesis.pictures import FORCES, histories

STARTS = {"4.1": (0.0, 0.0), "4.3": (45.0, -45.0), "4.5": (45.0, 90.0)}
TABLE_4_1 = (
    (0, 0), (0, 45), (0, 90), (0, 135), (45, 45), (45, 90), (45, 135), (45, -45), (45, -90),
    (45, -135), (90, 90), (90, 135), (90, -90), (90, -135), (135, 135), (135, -135),
)  # fmt: skip
"""Its combinations of starts [deg]."""
SAME_TIME = 0.1
"""Peaks of courses that are "approximately equal" are this near to each other [s]; ours."""
ALIKE = f"(ours: {ABOUT:.0%}, {SAME_TIME:g} s)"
""""Approximately equal": peaks, relative; the root mean square of the difference of two courses,
over the peak (4.7's course is 0.23 from 4.1's); times of the peaks."""
RIGHT_AFTER = 2.8
"""When W/e of figure 4.1 is largest [s]: the Japanese text says so, the English leaves it out."""
SOON = 0.5
""""Immediately after" [s]; ours."""


def without_period_section(folder: Path, tell: Tell) -> PageSection:
    """Figures 4.1 to 4.6 and table 4.1."""
    tell("section 4.1", 0, 1)
    runs = dict(zip(STARTS, start_ups([(_at(s), None) for s in STARTS.values()]), strict=True))
    caption = "Figures 4.1, 4.3 and 4.5: without a variable-speed period"
    picture = histories(folder, "4.1", runs, FORCES, caption)
    all_starts = starts_runs()
    claims = [*without_claims(runs), *starts_claims(all_starts)]
    tables = table_of("Without a variable-speed period", claims), starts_table(all_starts)
    text = (
        f'"Near -180 deg" means within {OPPOSITE:g} deg of it on this page. The thesis judges '
        "balance by this angle alone; the residual unbalance is given too.",
        f"A printed number holds within {ABOUT:.0%}, an angle within {OPPOSITE:g} deg, a time "
        f'of two digits within {TIMED:.0%}. "Alike" and "in proportion" mean within '
        f"{ABOUT:.0%}. Criteria marked *ours* are in thesis.json.",
    )
    return PageSection(
        "4.1 Without a variable-speed period: figures 4.1 to 4.6", text, tables, (picture,)
    )


def without_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """What section 4.1 states."""
    first = runs["4.1"]
    return [
        *_first_claims(first),
        *_other_claims("4.3", runs["4.3"], first),
        *_other_claims("4.5", runs["4.5"], first),
        remains_claim(list(runs.values())),
    ]


def _first_claims(first: StartUp) -> list[Claim]:
    """Figure 4.1."""
    peak, when = first.peak
    angle = np.degrees(first.trajectory.ball_angles[:, 0])
    before = at_time(angle, first, 2.5)
    soon = at_time(angle, first, 3.2) - before
    size = np.abs(first.forces).max(axis=1)
    rise = [float(at_time(size, first, time)) for time in (1.5, 2.0, 2.3, 2.5, 2.8)]
    large = first.whirl > 0.5 * peak
    share = float(size[large].mean() / size[~large].mean())
    return [
        value("4.1 (a)", "peak W/e", 55.0, peak),
        value("4.1 (a)", "time of the peak, immediately after the critical speed at 2.5 s",
              RIGHT_AFTER, when, " s", TIMED),
        value("4.1 (b)", "largest driving force", 0.06, first.forward_peak[0], " N"),
        Claim(
            "4.1 (a)", "W/e rises with the speed, and falls again after its peak",
            f"{at_time(first.whirl, first, 2.0):.1f} at 2 s, {first.final_whirl:.1f} at 5 s "
            "(ours: a fifth of the peak at most)",
            bool(at_time(first.whirl, first, 2.0) < 0.2 * peak > first.final_whirl),
        ),
        value(
            "4.1 (b)",
            "time of the largest force, also immediately after the critical speed (printed for "
            "W/e)",
            RIGHT_AFTER, first.forward_peak[1], " s", TIMED,
        ),  # fmt: skip
        Claim(
            "4.1 (b)", "the force grows gradually with the speed",
            ", ".join(f"{force:.1g}" for force in rise) + " N at 1.5, 2, 2.3, 2.5, 2.8 s",
            bool(np.all(np.diff(rise) > 0.0)),
        ),
        Claim(
            "4.1 (b)", "it is large where the whirl is",
            f"{share:.0f} times as large in the mean where W/e is above half its peak (ours: at "
            "least twice, and largest within 0.1 s of it)",
            share > 2.0 and abs(first.forward_peak[1] - when) < SAME_TIME,
        ),
        Claim(
            "4.1 (c)", "the angle falls gradually, then a lot right after the critical speed",
            f"by {-before:.0f} deg until 2.5 s, by {-soon:.0f} deg in the 0.7 s after that "
            "(ours: five times as far)",
            -soon > 5.0 * -before,
        ),
        Claim(
            "4.1 (c), 4.2", "neither ball reaches -180 deg; residual unbalance remains",
            f"{degrees(first.angles)}; {first.residual:.2f} of the disc's unbalance (ours: more "
            f"than {BALANCED:g})",
            not opposite(first.angles).any() and first.residual > BALANCED,
        ),
        necessary_claim(),
    ]  # fmt: skip


def _other_claims(number: str, run: StartUp, first: StartUp) -> list[Claim]:
    """Figures 4.3 and 4.5, beside 4.1."""
    (peak, when), (peak_here, when_here) = first.peak, run.peak
    apart, forces = course_apart(run, first), run.forward_each
    each = float(np.sqrt(np.mean(np.diff(run.forces, axis=1) ** 2)) / forces.max())
    near = int(opposite(run.angles).sum())
    return [
        Claim(
            f"{number} (a)", "W/e as in 4.1, in size and course",
            f"peak {peak_here:.1f} at {when_here:.2f} s, in 4.1 {peak:.1f} at {when:.2f} s; "
            f"courses {apart:.0%} of the peak apart {ALIKE}",
            abs(peak_here - peak) < ABOUT * peak and abs(when_here - when) < SAME_TIME
            and apart < ABOUT,
        ),
        Claim(
            f"{number} (b)", "driving forces differ from ball to ball, in size and course",
            ", ".join(f"{force:.3f}" for force in forces) + f" N at most; courses {each:.0%} "
            f"of the larger apart (ours: {ABOUT:.0%} above the smaller, {ABOUT:.0%})",
            bool(forces.max() > (1.0 + ABOUT) * forces.min()) and each > ABOUT,
        ),
        Claim(
            f"{number} (c), {number[:2]}{int(number[2]) + 1}",
            "one ball in the vicinity of -180 deg, the other not",
            degrees(run.angles), near == 1, _why_not(run),
        ),
        parted_claim(number, run),
        Claim(
            f"{number[:2]}{int(number[2]) + 1}", "residual unbalance remains",
            f"{run.residual:.2f} of the disc's unbalance (ours: more than {BALANCED:g})",
            run.residual > BALANCED,
        ),
    ]  # fmt: skip


def starts_runs() -> list[tuple[StartUp, StartUp]]:
    """From all starts of table 4.1, without a period and with the hold."""
    cases = [(_at(start), period) for start in TABLE_4_1 for period in (None, HOLD)]
    runs = start_ups(cases, every=10)
    return list(zip(runs[::2], runs[1::2], strict=True))


def starts_claims(runs: list[tuple[StartUp, StartUp]]) -> list[Claim]:
    """What is said of (45, -45) and (45, 90) deg: that they stand for the table."""
    near = [[int(opposite(-(-one.angles % 360.0)).sum()) for one in pair] for pair in runs]
    one = sum(without == 1 for without, _ in near)
    both = sum(held == 2 for _, held in near)
    why = "the start of the balls decides"
    most = f"of {len(runs)} starts (ours: more than half of them)"
    return [
        Claim(
            "table 4.1", "two starts are representative: without a period one ball is opposite",
            f"{one} {most}", 2 * one > len(runs), why,
        ),
        Claim(
            "table 4.1",
            "two starts are representative: with the hold both balls are opposite (section 4.2)",
            f"{both} {most}",
            2 * both > len(runs), why,
        ),
    ]  # fmt: skip


def starts_table(runs: list[tuple[StartUp, StartUp]]) -> Table:
    """All starts of table 4.1, of which the thesis shows three."""
    rows: list[tuple[Cell, ...]] = []
    for start, (without, hold) in zip(TABLE_4_1, runs, strict=True):
        ends = (degrees(run.angles) for run in (without, hold))
        rows.append((", ".join(f"{s:g}" for s in start), *ends, without.residual, hold.residual))
    return Table(
        "Table 4.1: all its starts, at 5 s",
        (
            "start [deg]",
            "without a period",
            "hold of 0.5 s",
            "residual unbalance without [of the disc's]",
            "with the hold",
        ),
        tuple(rows),
        3,
    )


def _why_not(run: StartUp) -> str:
    short = float(np.abs(run.angles + 180.0).min())
    return (
        f"one is {short:.0f} deg short; the balls are {abs(np.diff(run.angles)[0]):.0f} deg apart "
        "and cancel each other, not the disc's unbalance"
    )


def _at(starts: tuple[float, ...]) -> Parameters:
    return THESIS._replace(starts=tuple(map(float, starts)))
