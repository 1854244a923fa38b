"""Section 4.1: start-ups without a variable-speed period."""

from pathlib import Path

import numpy as np

from ab_sim.papers.page import Cell, Section, Table
from ab_sim.papers.thesis.claims import Claim, degrees, opposite, table_of, value
from ab_sim.papers.thesis.drive import HOLD, THESIS, Parameters, StartUp, Tell, start_ups
from ab_sim.papers.thesis.pictures import FORCES, histories

STARTS = {"4.1": (0.0, 0.0), "4.3": (45.0, -45.0), "4.5": (45.0, 90.0)}
TABLE_4_1 = (
    (0, 0), (0, 45), (0, 90), (0, 135), (45, 45), (45, 90), (45, 135), (45, -45), (45, -90),
    (45, -135), (90, 90), (90, 135), (90, -90), (90, -135), (135, 135), (135, -135),
)  # fmt: skip
"""Its combinations of starts [deg]."""
ALIKE = 0.1
""""Approximately equal" peaks, relative; their times within as many seconds."""


def without_period_section(folder: Path, tell: Tell) -> Section:
    """Figures 4.1 to 4.6 and table 4.1."""
    tell("section 4.1", 0, 1)
    runs = dict(zip(STARTS, start_ups([(_at(s), None) for s in STARTS.values()]), strict=True))
    caption = "Figures 4.1, 4.3 and 4.5: without a variable-speed period"
    picture = histories(folder, "4.1", runs, FORCES, caption)
    tables = table_of("Without a variable-speed period", without_claims(runs)), starts_table()
    text = (
        "The thesis' sketches 4.2, 4.4 and 4.6 show where the balls of 4.1, 4.3 and 4.5 end. "
        '"In the vicinity of -180 deg" is -150 to -210 deg here: the thesis calls -200 so.',
    )
    return Section(
        "4.1 Without a variable-speed period: figures 4.1 to 4.6", text, tables, (picture,)
    )


def without_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """What section 4.1 states."""
    first = runs["4.1"]
    peak, when = first.peak
    angle = np.degrees(first.trajectory.ball_angles[:, 0])
    before = _at_time(angle, first, 2.5)
    soon = _at_time(angle, first, 3.2) - before
    claims = [
        value("4.1 (a)", "peak W/e", 55.0, peak),
        Claim(
            "4.1 (a)", "peak immediately after the critical speed at 2.5 s", f"{when:.2f} s",
            2.5 < when < 3.0,
        ),
        value("4.1 (b)", "largest driving force", 0.06, first.forward_peak[0], " N"),
        Claim(
            "4.1 (a)", "W/e rises with the speed, and falls again after its peak",
            f"{_at_time(first.whirl, first, 2.0):.1f} at 2 s, {first.final_whirl:.1f} at 5 s",
            _at_time(first.whirl, first, 2.0) < 0.2 * peak > first.final_whirl,
        ),
        Claim(
            "4.1 (b)", "largest force immediately after the critical speed",
            f"{first.forward_peak[1]:.2f} s", 2.5 < first.forward_peak[1] < 3.0,
        ),
        Claim(
            "4.1 (c)", "the angle falls gradually, then a lot right after the critical speed",
            f"by {-before:.0f} deg until 2.5 s, by {-soon:.0f} deg in the 0.7 s after that",
            -soon > 5.0 * -before,
        ),
        Claim(
            "4.1 (c), 4.2", "neither ball reaches -180 deg; residual unbalance remains",
            f"{degrees(first.angles)}; {first.residual:.2f} of the disc's unbalance",
            bool((first.angles > -180.0).all()) and first.residual > 0.1,
        ),
    ]  # fmt: skip
    for number in ("4.3", "4.5"):
        run = runs[number]
        peak_here, when_here = run.peak
        near = int(opposite(run.angles).sum())
        claims += [
            Claim(
                f"{number} (a)", "W/e as in 4.1, in size and course",
                f"peak {peak_here:.1f} at {when_here:.2f} s; in 4.1 {peak:.1f} at {when:.2f} s",
                abs(peak_here - peak) < ALIKE * peak and abs(when_here - when) < ALIKE,
            ),
            Claim(
                f"{number} (b)", "driving forces differ from ball to ball",
                ", ".join(f"{force:.3f}" for force in run.forces.max(axis=0)) + " N at most",
                bool(abs(run.forces[:, 0] - run.forces[:, 1]).max() > 0.5 * run.forward_peak[0]),
            ),
            Claim(
                f"{number} (c), {number[:2]}{int(number[2]) + 1}",
                "one ball in the vicinity of -180 deg, the other not",
                degrees(run.angles), near == 1,
            ),
        ]  # fmt: skip
    return claims


def starts_table() -> Table:
    """All starts of table 4.1, of which the thesis shows three."""
    cases = [(_at(start), period) for start in TABLE_4_1 for period in (None, HOLD)]
    runs = start_ups(cases, every=10)
    rows: list[tuple[Cell, ...]] = []
    for start, without, hold in zip(TABLE_4_1, runs[::2], runs[1::2], strict=True):
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


def _at_time(values: np.ndarray, run: StartUp, time: float) -> float:
    return float(values[np.argmin(np.abs(run.trajectory["time"] - time))])


def _at(starts: tuple[float, ...]) -> Parameters:
    return THESIS._replace(starts=tuple(map(float, starts)))
