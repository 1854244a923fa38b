"""Section 4.4: which variable-speed period is best, and by what measure."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ab_sim.papers.page import Picture, Section, Table
from ab_sim.papers.thesis.claims import Claim, table_of
from ab_sim.papers.thesis.drive import THESIS, Period, Tell, start_ups
from ab_sim.papers.thesis.many import End, ends
from ab_sim.papers.thesis.pictures import FORCES, histories, written

PRINTED = {0.0: {0.4: 0.77, 0.5: 0.86, 0.6: 0.91}, 20.0: {0.4: 0.88, 0.5: 0.58, 0.6: 0.59}}
"""Settling periods [s], by acceleration in the period [rad/s^2] and its duration [s]."""
FIGURES = {(0.0, 0.4): "4.19", (0.0, 0.6): "4.20", (20.0, 0.4): "4.21", (20.0, 0.6): "4.22"}
NAMES = {0.0: "constant speed", 20.0: "half the acceleration"}
WITHIN = 0.06
"""What settling periods may differ by [s]: the balls pass -180 deg slowly."""
LINE = np.round(np.arange(0.2, 1.0001, 0.02), 3)
"""Durations of the fine line [s]."""
SPEEDS = np.round(np.arange(80.0, 140.1, 2.0), 3)
"""Start speeds of the grid [rad/s]."""
DURATIONS = np.round(np.arange(0.05, 1.201, 0.05), 3)
"""Of the grid [s]."""
JUDGED_FOR = 14.0
"""Runs that are judged as a drive is go on for so long [s], to a target of 200 rad/s."""
ILL = (
    "the balls touch -180 deg tangentially, or just not: which of the two decides over some "
    "hundredths or some tenths of a second"
)


class Judged(NamedTuple):
    """A start-up by the thesis' measure, and by what a drive is judged by."""

    settling: float | None
    """From the period's start until both balls first are at -180 deg or beyond [s]."""
    end: End


def judged(what: str, periods: Sequence[Period], tell: Tell) -> list[Judged]:
    """Start-ups to 200 rad/s, run for ``JUDGED_FOR``."""
    found = ends(what, [(THESIS, period) for period in periods], tell, 200.0, JUDGED_FOR)
    return [
        Judged(None if end.opposite is None else end.opposite - period.start, end)
        for end, period in zip(found, periods, strict=True)
    ]


def settling_section(folder: Path, tell: Tell) -> Section:
    """Figures 4.19 to 4.23, a fine line in place of eight points, and a grid."""
    tell("section 4.4", 0, 1)
    runs = {
        number: start_ups([(THESIS, Period(2.5, duration, acceleration))])[0]
        for (acceleration, duration), number in FIGURES.items()
    }
    caption = "Figures 4.19 to 4.22: periods of 0.4 and 0.6 s"
    pictures = [histories(folder, "4.19", runs, FORCES, caption)]
    lines = {
        acceleration: judged(
            "section 4.4, duration", [Period(2.5, float(d), acceleration) for d in LINE], tell
        )
        for acceleration in PRINTED
    }
    pictures.append(_line_picture(folder, lines))
    grid = grid_of(tell)
    pictures.append(_grid_picture(folder, grid))
    tables = (
        table_of("Settling as the thesis has it", settling_claims(lines)),
        _best_table(lines, grid),
    )
    text = (
        'The "settling period" ends when both balls first are at -180 deg, unwrapped. A drive is '
        "judged by how little it shakes in the end and how soon: final W/e, and when W stays "
        "within its band, counted from standstill. Both are shown, of start-ups to 200 rad/s.",
    )
    return Section(
        "4.4 The best variable-speed period: figures 4.19 to 4.23", text, tables, tuple(pictures)
    )


def settling_claims(lines: dict[float, list[Judged]]) -> list[Claim]:
    """The six printed numbers, and what is concluded from them."""
    claims, ours = [], {}
    for acceleration, printed in PRINTED.items():
        for duration, published in printed.items():
            found = lines[acceleration][_at(duration)].settling
            ours[acceleration, duration] = found
            claims.append(
                Claim(
                    FIGURES.get((acceleration, duration), "4.7" if acceleration == 0 else "4.15"),
                    f"{NAMES[acceleration]} for {duration:g} s: settled in {published:g} s",
                    "never" if found is None else f"{found:.3f} s",
                    found is not None and abs(found - published) <= WITHIN,
                    ILL,
                )
            )
    order = {
        acceleration: min(printed, key=lambda d: _or_never(ours[acceleration, d]))
        for acceleration, printed in PRINTED.items()
    }
    faster = [_or_never(ours[20.0, d]) < _or_never(ours[0.0, d]) for d in (0.4, 0.5, 0.6)]
    at = _at(0.7)
    last = [lines[acceleration][at].settling for acceleration in PRINTED]
    close = 1e3 * abs(_or_never(ours[20.0, 0.5]) - _or_never(ours[20.0, 0.6]))
    return [
        *claims,
        Claim("4.4", "at constant speed 0.4 s is soonest of 0.4, 0.5, 0.6 s",
              f"{order[0.0]:g} s is", order[0.0] == 0.4),
        Claim("4.4", "accelerating 0.5 s is soonest of them", f"{order[20.0]:g} s is",
              order[20.0] == 0.5,
              f"0.5 and 0.6 s differ by {close:.0f} ms"),
        Claim("4.23", "accelerating is sooner, except for 0.4 s",
              f"at 0.4, 0.5, 0.6 s: {', '.join('sooner' if f else 'later' for f in faster)}",
              faster == [False, True, True]),
        Claim("4.23", "0.7 s is added, without a number: accelerating is sooner there, too",
              ", ".join("never" if x is None else f"{x:.3f} s" for x in last),
              _or_never(last[1]) < _or_never(last[0])),
    ]  # fmt: skip


def grid_of(tell: Tell) -> dict[float, list[list[Judged]]]:
    """By acceleration in the period, start speed and duration."""
    found = {}
    for acceleration in PRINTED:
        periods = [
            Period(float(speed) / 40.0, float(duration), acceleration)
            for speed in SPEEDS
            for duration in DURATIONS
        ]
        what = f"section 4.4, start speed and duration, {NAMES[acceleration]}"
        flat = judged(what, periods, tell)
        width = len(DURATIONS)
        found[acceleration] = [flat[k : k + width] for k in range(0, len(flat), width)]
    return found


def _best_table(lines: dict[float, list[Judged]], grid: dict[float, list[list[Judged]]]) -> Table:
    rows = []
    for acceleration, name in NAMES.items():
        cells = [
            (f"{speed:g} rad/s, {duration:g} s", one)
            for speed, row in zip(SPEEDS, grid[acceleration], strict=True)
            for duration, one in zip(DURATIONS, row, strict=True)
        ]
        for what, key in _MEASURES:
            values = [key(one) for _, one in cells]
            best, one = cells[int(np.argmin(values))]
            rows.append(
                (
                    name,
                    what,
                    best,
                    one.settling,
                    one.end.opposite,
                    one.end.in_band,
                    one.end.final_whirl,
                )
            )
    return Table(
        "Best start speed and duration on the grid, by measure",
        (
            "period", "soonest or least of", "start speed, duration", "settling period [s]",
            "at -180 deg from [s]", "in band from [s]", "final W/e",
        ),
        tuple(rows),
        4,
    )  # fmt: skip


def _or_never(value: float | None) -> float:
    return np.inf if value is None else value


_MEASURES: tuple[tuple[str, Callable[[Judged], float]], ...] = (
    ("settling period", lambda one: _or_never(one.settling)),
    ("-180 deg, from standstill", lambda one: _or_never(one.end.opposite)),
    ("in band, from standstill", lambda one: _or_never(one.end.in_band)),
    ("final W/e", lambda one: one.end.final_whirl),
)


def _at(duration: float) -> int:
    return int(np.argmin(np.abs(LINE - duration)))


def _line_picture(folder: Path, lines: dict[float, list[Judged]]) -> Picture:
    """Figure 4.23, with a fine line, and what a drive is judged by."""
    figure = Figure(figsize=(8.0, 9.0), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    values: tuple[tuple[str, Callable[[Judged], float | None]], ...] = (
        ("settling period [s]", lambda one: one.settling),
        ("in band from [s]", lambda one: one.end.in_band),
        ("final W/e", lambda one: one.end.final_whirl),
    )
    for axes, (label, pick) in zip(panels, values, strict=True):
        for acceleration, color in zip(PRINTED, ("tab:blue", "tab:red"), strict=True):
            ours = [np.nan if pick(one) is None else pick(one) for one in lines[acceleration]]
            axes.plot(LINE, ours, ".-", ms=3, color=color, label=NAMES[acceleration])
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    for acceleration, color in zip(PRINTED, ("tab:blue", "tab:red"), strict=True):
        printed = PRINTED[acceleration]
        panels[0].plot(
            list(printed), list(printed.values()), "o", mfc="none", color=color,
            label=f"printed, {NAMES[acceleration]}",
        )  # fmt: skip
    panels[0].legend(fontsize=9)
    panels[-1].set_xlabel("duration of the variable-speed period [s]")
    caption = (
        "Figure 4.23 as a line (gaps: the balls never reach -180 deg), and below what a drive is "
        "judged by; target 200 rad/s"
    )
    return written(figure, folder, "4.23", caption)


def _grid_picture(folder: Path, grid: dict[float, list[list[Judged]]]) -> Picture:
    figure = Figure(figsize=(11.0, 9.5), layout="constrained")
    panels = figure.subplots(3, 2, sharex=True, sharey=True)
    for column, (acceleration, rows) in zip(panels.T, grid.items(), strict=True):
        _map(figure, column[0], [[one.settling for one in row] for row in rows], "settling [s]")
        _map(
            figure,
            column[1],
            [[one.end.in_band for one in row] for row in rows],
            "in band from [s]",
        )
        _map(figure, column[2], [[one.end.final_whirl for one in row] for row in rows], "final W/e")
        column[0].set_title(NAMES[acceleration])
        column[-1].set_xlabel("duration [s]")
    for axes in panels[:, 0]:
        axes.set_ylabel("start speed [rad/s]")
    caption = (
        "Start speed and duration of the period: settling as the thesis counts it (grey: never), "
        "when the whirl is in its final band, and the final whirl; darker is better"
    )
    return written(figure, folder, "4.4-grid", caption)


def _map(figure: Figure, axes: Axes, values: list[list[float | None]], label: str) -> None:
    axes.set_facecolor("0.8")
    shown = np.array([[np.nan if v is None else v for v in row] for row in values])
    drawn = axes.pcolormesh(DURATIONS, SPEEDS, shown, shading="nearest", cmap="viridis")
    figure.colorbar(drawn, ax=axes, label=label)
