"""Section 4.5: nine rules for the variable-speed period of other drives."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from gallery.page import PageSection, Picture, Table
from gallery.thesis.claims import Claim, opposite, stretches, table_of
from gallery.thesis.drive import ACCELERATION, OPPOSITE, THESIS, Parameters, Tell
from gallery.thesis.many import ends
from gallery.thesis.other_drives import period_of
from gallery.thesis.pictures import written
from gallery.thesis.ratios import damped_table, left_table, ratio_claims

FACTORS = np.unique([*np.round(np.geomspace(0.5, 3.0, 20), 3), 1.0, 2.0])
"""Of the parameter that a rule is about."""
EASED = 0.5 * ACCELERATION
"""In an accelerating period, as in section 4.3 [rad/s^2]."""


SHOWN = -600.0
"""Lowest end position in the picture [deg]: so that the vicinity of -180 deg is seen."""
ENOUGH, TOO_LITTLE, TOO_MUCH = "enough", "too little", "too much"


class Ends(NamedTuple):
    """The balls' mean end positions by factor [deg]."""

    without: np.ndarray
    held: np.ndarray
    """With the rule's period, at constant speed."""
    eased: np.ndarray
    """With a period of the same start and duration at half the acceleration."""


class Rule(NamedTuple):
    """A parameter that is changed by a factor, and what the thesis does about it."""

    number: int
    what: str
    figure: str
    """Of the start-up with a period that shows it, at factor 2."""
    printed: str
    changed: Callable[[float], Parameters]
    """The drive, by the factor; with what the rule changes besides."""
    says: str = ENOUGH
    """What the thesis says of the balls' way at the rule's times: one of these words."""


RULES = (
    Rule(1, "M", "4.27", "start and end time as 1/sqrt(M); alone too little",
         lambda f: THESIS._replace(M=f * THESIS.M), TOO_LITTLE),
    Rule(1, "M, m with it", "4.28", "and m in proportion to M: both balls opposite",
         lambda f: THESIS._replace(M=f * THESIS.M, m=f * THESIS.m)),
    Rule(2, "k", "4.30", "start and end time as sqrt(k); alone too much",
         lambda f: THESIS._replace(k=f * THESIS.k), TOO_MUCH),
    Rule(2, "k, m against it", "4.31", "and m as 1/k: both balls opposite",
         lambda f: THESIS._replace(k=f * THESIS.k, m=THESIS.m / f)),
    Rule(3, "R", "4.33", "end time unchanged", lambda f: THESIS._replace(R=f * THESIS.R)),
    Rule(4, "c", "4.35", "same effect to some extent at the same times",
         lambda f: THESIS._replace(c=f * THESIS.c)),
    Rule(5, "e", "4.37", "a little too much at the same times: end time or m",
         lambda f: THESIS._replace(e=f * THESIS.e), TOO_MUCH),
    Rule(6, "a", "4.39", "no influence", lambda f: THESIS._replace(a=f * THESIS.a)),
    Rule(7, "m, c_b as its square", "4.41", "same effect at the same times (c_b = 4 at m = 2 g)",
         lambda f: THESIS._replace(m=f * THESIS.m, c_b=f * f * THESIS.c_b)),
    Rule(8, "beta_b", "4.43", "influence so small that the times stay",
         lambda f: THESIS._replace(beta_b=f * THESIS.beta_b)),
    Rule(9, "c_b, m 1.3 times for its double", "4.45", "same effect at the same times",
         lambda f: THESIS._replace(c_b=f * THESIS.c_b, m=1.3 ** math.log2(f) * THESIS.m)),
)  # fmt: skip


def rules_section(folder: Path, tell: Tell) -> PageSection:
    """Figures 4.24 to 4.45, and each rule over a range."""
    tell("section 4.5", 0, 1)
    ranges = over_ranges(tell)
    tables = (
        table_of("Printed ratios and positions", [*ratio_claims(), *range_claims(ranges)]),
        damped_table(),
        left_table(),
        _range_table(ranges),
    )
    text = (
        "Start and end times follow the rule; positions are those 2.5 s after the critical "
        "speed. Between and beyond the thesis' factor 2, c_b ~ m^2, and m grows by 1.3 per "
        "doubling of c_b. Balls at -180 deg leave a large residual unbalance unless 2 m R is "
        "M0 e.",
        'The rules scale an end time "already optimized" in section 4.4. The best hold there '
        "is 0.4 s, the figures use 0.5 s; both are judged. Time histories of 4.24 to 4.45 are "
        "not drawn.",
    )
    picture = _picture(folder, ranges)
    return PageSection("4.5 Rules for other drives: figures 4.24 to 4.45", text, tables, (picture,))


def over_ranges(tell: Tell, factors: Sequence[float] = tuple(FACTORS)) -> dict[Rule, Ends]:
    """By rule the balls' end positions at some factors."""
    cases = []
    for rule in RULES:
        for factor in factors:
            p = rule.changed(float(factor))
            period = period_of(p)
            cases += [(p, None), (p, period), (p, period._replace(acceleration=EASED))]
    found = ends("section 4.5, rules over ranges", cases, tell)
    angles = np.array([end.angle for end in found]).reshape(len(RULES), len(factors), 3)
    return {rule: Ends(*angles[k].T) for k, rule in enumerate(RULES)}


def range_claims(
    ranges: dict[Rule, Ends], factors: Sequence[float] = tuple(FACTORS)
) -> list[Claim]:
    """What is said of accelerating periods."""
    at_2 = int(np.argmin(np.abs(np.array(factors) - 2.0)))
    both = {
        rule: (float(found.held[at_2]), float(found.eased[at_2])) for rule, found in ranges.items()
    }
    other = [
        f"({rule.number}) {rule.what}: {eased:.0f} in place of {held:.0f} deg"
        for rule, (held, eased) in both.items()
        if bool(opposite(np.array(held))) != bool(opposite(np.array(eased)))
    ]
    return [
        Claim(
            "section 4.5", "for an accelerating period the same rules serve",
            f"at factor 2 {len(both) - len(other)} of {len(both)} end at {EASED:g} rad/s^2 as at "
            f"constant speed, both near -180 deg or both not (ours: all)", not other,
            "; ".join(other),
        )
    ]  # fmt: skip


def where(good: np.ndarray) -> str:
    """Factors for which something holds, in words."""
    return ", ".join(
        f"{FACTORS[first]:g} to {FACTORS[last]:g}" if last > first else f"{FACTORS[first]:g}"
        for first, last in stretches(FACTORS, good)
    ) or "nowhere"  # fmt: skip


def word_of(rule: Rule, ends: np.ndarray) -> str:
    """What becomes of a rule, given where the balls end by factor [deg]."""
    good = opposite(ends)
    found = _enough(float(ends[_at(2.0)]))
    if found != rule.says:
        return f"refuted: at its times it is {found}"
    if rule.says != ENOUGH:
        return f"confirmed: at its times it is {found}"
    return "confirmed" if good.all() else "limited to these factors"


def _enough(end: float) -> str:
    """Of an end position [deg]: whether the balls' way is enough."""
    if opposite(np.array(end)):
        return ENOUGH
    return TOO_LITTLE if end > -180.0 else TOO_MUCH


def _range_table(ranges: dict[Rule, Ends]) -> Table:
    rows = []
    for rule, found in ranges.items():
        good = opposite(found.held)
        rows.append(
            (
                str(rule.number),
                rule.what,
                rule.printed,
                where(good),
                f"{found.held[_at(2.0)]:.0f}",
                word_of(rule, found.held),
                where(opposite(found.eased)),
            )
        )
    return Table(
        "Each rule over a range: for which factors are both balls opposite? The hold is the rule's",
        (
            "rule", "changed", "the thesis", "factors", "end at factor 2 [deg]",
            "as a rule for this", f"factors, accelerating by {EASED:g} rad/s^2",
        ),
        tuple(rows),
    )  # fmt: skip


def _at(factor: float) -> int:
    return int(np.argmin(np.abs(FACTORS - factor)))


def _picture(folder: Path, ranges: dict[Rule, Ends]) -> Picture:
    figure = Figure(figsize=(12.0, 9.0), layout="constrained")
    panels = figure.subplots(3, 4, sharex=True).flat
    for axes, (rule, found) in zip(panels, ranges.items(), strict=False):
        axes.axhspan(-180.0 - OPPOSITE, -180.0 + OPPOSITE, color="0.85", zorder=0)
        axes.plot(FACTORS, found.without, ".-", color="tab:gray", ms=4, label="without a period")
        axes.plot(FACTORS, found.held, ".-", color="tab:blue", ms=4, label="with the rule's period")
        axes.plot(FACTORS, found.eased, "--", color="tab:red", lw=1.2, label="accelerating in it")
        axes.set_title(f"({rule.number}) {rule.what}", fontsize=10)
        axes.axvline(2.0, color="0.3", lw=1.1, ls=":")
        if min(each.min() for each in found) < SHOWN:
            axes.set_ylim(SHOWN, 0.0)
        axes.grid(alpha=0.3)
    panels = figure.axes
    panels[-1].axis("off")
    panels[0].legend(fontsize=8)
    for axes in panels[8:11]:
        axes.set_xlabel("factor")
    for axes in panels[::4]:
        axes.set_ylabel("end position [deg]")
    caption = (
        "The nine rules over a range of the parameter; grey: opposite to the unbalance, "
        f"upright: the thesis' factor 2; shown to {SHOWN:.0f} deg"
    )
    return written(figure, folder, "4.5-rules", caption)
