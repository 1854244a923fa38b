"""Section 6.2: what was measured on a drive with five balls. Only orders are compared."""

import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gallery.page import Cell, PageSection, Picture, Table
from gallery.thesis.claims import table_of
from gallery.thesis.drive import HOLD, Tell
from gallery.thesis.five_balls import CHOICES, OTHERS_NAMED, Bar, Case, alone, bars_of
from gallery.thesis.judged import grid_of, judged
from gallery.thesis.measured import (
    ECCENTRIC,
    NEIGHBOUR,
    PERIODS,
    SPEEDS,
    TEN,
    TOUCHING,
    Eccentric,
    Speeds,
    measured_claims,
)
from gallery.thesis.pictures import written
from gallery.thesis.reasons import PASSED, beside, reason_claims
from gallery.thesis.rotation import over_eccentricity

THOUSAND, FEW = 1000, 40
"""Starts: of the drive as chosen; of each varied choice."""
OF_EASING = 400
"""Starts with an accelerating period."""
OF_ECCENTRIC = 100
"""Starts for each bar of figure 6.6."""
OF_SPEEDS = 30
"""Starts for each speed of figure 6.5."""


def experiment_section(folder: Path, tell: Tell) -> PageSection:
    """Figures 6.3 to 6.6."""
    named = [Case(rpm) for rpm in PERIODS.values()]
    bars = dict(zip(PERIODS, bars_of("figures 6.3 and 6.4", named, THOUSAND, tell), strict=True))
    bars_alone = alone(Case())
    (easing,) = bars_of("an accelerating period", [Case(2500.0, 200.0)], OF_EASING, tell)
    varied, over_speed, eccentric = varied_bars(tell), speed_bars(tell), eccentric_bars(tell)
    two_balls = judged("section 6.2, two balls", [None, HOLD], tell)
    whirls = [one.end.final_whirl for one in two_balls]
    grid = grid_of(tell)
    best = min(one.end.final_whirl for rows in grid.values() for row in rows for one in row)
    reasons = beside(bars["2500 rpm"], eccentric, over_eccentricity(tell), tell)
    more, interval = reasons.passing.more_than(reasons.collide)
    share = [
        by_name["2500 rpm"].mean / by_name["no period"].mean
        for name, (_, by_name) in varied.items()
        if name != OTHERS_NAMED
    ]
    text = (
        "Chosen here, because not printed: M = 0.1 kg, R = 1 cm, damping ratio 0.01, drag c_b "
        "= 0.033 N s/m, arm of friction 1 um, acceleration 400 rad/s^2, restitution 0.5. Mass, "
        "damping, friction and drag are halved and doubled below; a race of 12 mm with three "
        "times the friction and 240 rad/s^2 is tried, too. The deck moves in the plane, "
        "so only the horizontal bars are compared, and only their order. All cases use the "
        "same random starts; an order counts if the 95 % interval of the difference excludes "
        "zero.",
        f"Contact: five colliding balls end at {reasons.collide.words()} after the hold at 2500 "
        f"rpm, balls that pass through each other at {reasons.passing.words()} ({PASSED} starts, "
        f"difference {more:+.2f} +- {interval:.2f} um). Five balls that touch span "
        f"{math.degrees(4.0 * NEIGHBOUR):.0f} deg and carry at most {TOUCHING:.2f} g cm.",
    )  # fmt: skip
    return PageSection(
        "6.2 The experiments: figures 6.3 to 6.6",
        text,
        (
            table_of(
                "What was measured",
                measured_claims(
                    bars,
                    bars_alone,
                    easing,
                    over_speed,
                    eccentric,
                    whirls,
                    best,
                    share,
                    varied[OTHERS_NAMED][1],
                ),
            ),
            table_of("What is given as reasons", reason_claims(reasons)),
            _bars_table(bars, bars_alone),
            _choices_table(varied),
        ),
        (
            _bars_picture(folder, bars, bars_alone),
            _speed_picture(folder, over_speed),
            _eccentric_picture(folder, eccentric),
        ),
    )


def varied_bars(tell: Tell) -> dict[str, tuple[float, dict[str, Bar]]]:
    """By choice the whirl without balls [um], and the bars of ``PERIODS``."""
    varied = [(choice, factor) for choice in CHOICES for factor in (0.5, 2.0)]
    cases = [Case(rpm, choice=c, factor=f) for c, f in varied for rpm in PERIODS.values()]
    each = bars_of("choices halved and doubled", cases, FEW, tell)
    found = {}
    for k, (choice, factor) in enumerate(varied):
        own = each[len(PERIODS) * k : len(PERIODS) * (k + 1)]
        name = f"{'half' if factor < 1.0 else 'double'} the {choice}"
        found[name] = (
            alone(Case(choice=choice, factor=factor)), dict(zip(PERIODS, own, strict=True))
        )  # fmt: skip
    others = bars_of(
        "other choices", [Case(rpm, others=True) for rpm in PERIODS.values()], FEW, tell
    )
    free = alone(Case(others=True))
    return {**found, OTHERS_NAMED: (free, dict(zip(PERIODS, others, strict=True)))}


def speed_bars(tell: Tell) -> Speeds:
    """Figure 6.5; below the hold's speed there is none."""
    cases = [Case(2500.0 if speed > 2500.0 else None, target=float(speed)) for speed in SPEEDS]
    bars = bars_of("figure 6.5", cases, OF_SPEEDS, tell)
    return [(alone(case), bar) for case, bar in zip(cases, bars, strict=True)]


def eccentric_bars(tell: Tell) -> Eccentric:
    """Figure 6.6, at 6000 rpm."""
    cases = [
        Case(rpm, target=6000.0, unbalance=unbalance)
        for unbalance in ECCENTRIC
        for rpm in (None, 2500.0)
    ]
    bars = bars_of("figure 6.6", cases, OF_ECCENTRIC, tell)
    free = [alone(case) for case in cases[::2]]
    each = zip(free, bars[::2], bars[1::2], strict=True)
    return dict(zip(ECCENTRIC, each, strict=True))


def _bars_table(bars: dict[str, Bar], bars_alone: float) -> Table:
    rows: list[tuple[Cell, ...]] = [("6.3 (a)", "no balls", bars_alone, None, None, None)]
    figures = ("6.3 (b)", "6.3 (c), 6.4 (a)", "6.4 (b)", "6.4 (c)")
    for figure, (name, one) in zip(figures, bars.items(), strict=True):
        ten = float(one.each[:TEN].mean())
        rows.append((figure, name, ten, one.mean, one.interval, float(one.each.std(ddof=1))))
    return Table(
        "Whirl at 8000 rpm [um]",
        (
            "figure", "period", "mean of ten starts", f"of {THOUSAND}", "its 95 % interval, +-",
            "standard deviation of one start",
        ),
        tuple(rows),
        3,
    )  # fmt: skip


def _choices_table(varied: dict[str, tuple[float, dict[str, Bar]]]) -> Table:
    """Which orders hold for every choice; of few starts each, start by start."""
    rows: list[tuple[Cell, ...]] = []
    always: list[set[str]] = [set(), set(), set()]
    for name, (free, bars) in varied.items():
        without, hold, early, late = bars.values()
        least = {_order(hold, early), _order(hold, late)}
        words = (
            "yes" if without.mean + without.interval < free else "no",
            _order(hold, without),
            next(word for word in ("no", "undecided", "yes") if word in least),
        )
        for seen, word in zip(always, words, strict=True):
            seen.add(word)
        rows.append((name, free, *(one.words() for one in bars.values()), *words))
    every = ["yes" if seen == {"yes"} else "no" if "no" in seen else "undecided" for seen in always]
    rows.append(("for every choice", *[None] * 5, *every))
    return Table(
        f"Other choices, {FEW} starts each: which orders hold?",
        (
            "choice", "no balls [um]", *PERIODS, "balls shake less", "2500 rpm less than none",
            "2500 rpm least of three",
        ),
        tuple(rows),
        3,
    )  # fmt: skip


def _order(one: Bar, other: Bar) -> str:
    """Whether one is below the other."""
    return "yes" if one.below(other) else "no" if other.below(one) else "undecided"


def _bars_picture(folder: Path, bars: dict[str, Bar], bars_alone: float) -> Picture:
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    axes = figure.subplots()
    axes.bar([0], [bars_alone], color="0.6")
    for k, one in enumerate(bars.values(), start=1):
        axes.bar([k], [one.mean], yerr=[one.interval], color="tab:blue", capsize=4, alpha=0.7)
        scatter = np.random.default_rng(k).uniform(-0.3, 0.3, len(one.each))
        axes.plot(k + scatter, one.each, ".", ms=1.5, color="0.3", alpha=0.4)
        axes.plot([k], [one.each[:TEN].mean()], "D", color="tab:red", ms=6)
    axes.set_xticks(range(5), ["no balls", *bars])
    axes.set_ylabel("whirl at 8000 rpm [um]")
    axes.grid(axis="y", alpha=0.3)
    caption = (
        "Figures 6.3 and 6.4: mean of a thousand random starts with its 95 % interval, each start "
        "as a dot, the mean of the first ten in red"
    )
    return written(figure, folder, "6.3", caption)


def _speed_picture(folder: Path, speeds: Speeds) -> Picture:
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    axes = figure.subplots()
    axes.plot(SPEEDS, [free for free, _ in speeds], "o-", color="0.5", ms=4, label="without balls")
    means, bars = [one.mean for _, one in speeds], [one.interval for _, one in speeds]
    axes.errorbar(SPEEDS, means, bars, fmt="s-", ms=4, color="tab:blue", label="with balls")
    axes.set_yscale("log")
    axes.set_xlabel("speed [rpm]")
    axes.set_ylabel("whirl [um]")
    axes.grid(alpha=0.3, which="both")
    axes.legend()
    return written(
        figure, folder, "6.5",
        "Figure 6.5: whirl over speed; with balls, and the hold at 2500 rpm for speeds above it: "
        f"means of {OF_SPEEDS} random starts with their 95 % intervals",
    )  # fmt: skip


def _eccentric_picture(folder: Path, eccentric: Eccentric) -> Picture:
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    axes = figure.subplots()
    for k, (free, plain, held) in enumerate(eccentric.values()):
        label = k == 0
        axes.bar(k - 0.25, free, 0.22, color="0.6", label="without balls" if label else None)
        for shift, one, color, name in (
            (0.0, plain, "tab:blue", "with balls, no period"),
            (0.25, held, "tab:red", "with balls and period"),
        ):
            axes.bar(k + shift, one.mean, 0.22, yerr=one.interval, color=color, capsize=4,
                     label=name if label else None)  # fmt: skip
    axes.set_xticks(range(len(eccentric)), [f"{u:g}" for u in eccentric])
    axes.set_xlabel("unbalance of the disc [g cm]")
    axes.set_ylabel("whirl at 6000 rpm [um]")
    axes.grid(axis="y", alpha=0.3)
    axes.legend()
    caption = f"Figure 6.6: means of {OF_ECCENTRIC} random starts with their 95 % intervals"
    return written(figure, folder, "6.6", caption)
