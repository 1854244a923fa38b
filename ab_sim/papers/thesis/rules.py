"""Section 4.5: nine rules for the variable-speed period of other drives."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ab_sim.papers.page import Picture, Section, Table
from ab_sim.papers.thesis.claims import ABOUT, Claim, degrees, opposite, table_of, value
from ab_sim.papers.thesis.drive import THESIS, Parameters, Period, StartUp, Tell, start_ups
from ab_sim.papers.thesis.many import ends
from ab_sim.papers.thesis.pictures import written

FACTORS = np.unique([*np.round(np.geomspace(0.5, 3.0, 20), 3), 1.0, 2.0])
"""Of the parameter that a rule is about."""
ROOT_2 = math.sqrt(2.0)
DURATIONS = np.round(np.arange(0.1, 1.51, 0.1), 3)
"""Of holds that are tried where the end time alone is not to do [s]."""


class Rule(NamedTuple):
    """A parameter that is changed by a factor, and what the thesis does about it."""

    number: int
    what: str
    figure: str
    """Of the start-up with a period that shows it, at factor 2."""
    printed: str
    changed: Callable[[float], Parameters]
    """The drive, by the factor; with what the rule changes besides."""
    enough: bool = True
    """Whether the thesis says that it brings both balls opposite."""


RULES = (
    Rule(1, "M", "4.27", "start and end time as 1/sqrt(M); alone not enough",
         lambda f: THESIS._replace(M=f * THESIS.M), enough=False),
    Rule(1, "M, m with it", "4.28", "and m in proportion to M: both balls opposite",
         lambda f: THESIS._replace(M=f * THESIS.M, m=f * THESIS.m)),
    Rule(2, "k", "4.30", "start and end time as sqrt(k); alone too much",
         lambda f: THESIS._replace(k=f * THESIS.k), enough=False),
    Rule(2, "k, m against it", "4.31", "and m as 1/k: both balls opposite",
         lambda f: THESIS._replace(k=f * THESIS.k, m=THESIS.m / f)),
    Rule(3, "R", "4.33", "end time unchanged", lambda f: THESIS._replace(R=f * THESIS.R)),
    Rule(4, "c", "4.35", "same effect to some extent at the same times",
         lambda f: THESIS._replace(c=f * THESIS.c)),
    Rule(5, "e", "4.37", "slightly too much at the same times",
         lambda f: THESIS._replace(e=f * THESIS.e)),
    Rule(6, "a", "4.39", "no influence", lambda f: THESIS._replace(a=f * THESIS.a)),
    Rule(7, "m, c_b as its square", "4.41", "same effect at the same times (c_b = 4 at m = 2 g)",
         lambda f: THESIS._replace(m=f * THESIS.m, c_b=f * f * THESIS.c_b)),
    Rule(8, "beta_b", "4.43", "influence so small that the times stay",
         lambda f: THESIS._replace(beta_b=f * THESIS.beta_b)),
    Rule(9, "c_b, m 1.3 times for its double", "4.45", "same effect at the same times",
         lambda f: THESIS._replace(c_b=f * THESIS.c_b, m=1.3 ** math.log2(f) * THESIS.m)),
)  # fmt: skip


def period_of(p: Parameters) -> Period:
    """The hold, its start and end scaled with the time of the critical speed."""
    return Period(p.critical_time, 0.5 * p.critical_time / THESIS.critical_time)


def rules_section(folder: Path, tell: Tell) -> Section:
    """Figures 4.24 to 4.45, and each rule over a range."""
    tell("section 4.5", 0, 1)
    ranges = over_ranges(tell)
    tables = (
        table_of("Printed ratios and positions", ratio_claims()),
        _range_table(ranges),
    )
    text = (
        "Figures 4.24 and 4.25 are 4.1 and 4.7 again. Times are those of the rule: start and end "
        "where the critical speed is scaled. End positions are those 2.5 s after the critical "
        'speed; "opposite" is -150 to -210 deg.',
    )
    picture = _picture(folder, ranges)
    return Section("4.5 Rules for other drives: figures 4.24 to 4.45", text, tables, (picture,))


def ratio_claims() -> list[Claim]:
    """What the text says at a factor of 2."""
    p = THESIS
    cases = {
        "4.24": (p, False), "4.25": (p, True),
        "4.26": (p._replace(M=0.2), False), "4.27": (p._replace(M=0.2), True),
        "4.28": (p._replace(M=0.2, m=2e-3), True),
        "4.29": (p._replace(k=2e3), False), "4.30": (p._replace(k=2e3), True),
        "4.31": (p._replace(k=2e3, m=5e-4), True),
        "4.29, c scaled": (p._replace(k=2e3, c=ROOT_2 * p.c), False),
        "4.30, c scaled": (p._replace(k=2e3, c=ROOT_2 * p.c), True),
        "4.32": (p._replace(R=0.02), False), "4.33": (p._replace(R=0.02), True),
        "4.34": (p._replace(c=0.4), False), "4.35": (p._replace(c=0.4), True),
        "4.36": (p._replace(e=2e-4), False), "4.37": (p._replace(e=2e-4), True),
        "4.38": (p._replace(a=2e-3), False), "4.39": (p._replace(a=2e-3), True),
        "4.40": (p._replace(m=2e-3), False), "4.41": (p._replace(m=2e-3, c_b=4.0), True),
        "4.42": (p._replace(beta_b=2e-6), False), "4.43": (p._replace(beta_b=2e-6), True),
        "4.44": (p._replace(c_b=2.0), False),
        "4.45, m = 2 g": (p._replace(c_b=2.0, m=2e-3), True),
        "4.45, m = 1.3 g": (p._replace(c_b=2.0, m=1.3e-3), True),
    }  # fmt: skip
    made = start_ups([(q, period_of(q) if held else None) for q, held in cases.values()])
    run = dict(zip(cases, made, strict=True))

    def peak(number: str, beside: str) -> float:
        return run[number].peak[0] / run[beside].peak[0]

    def force(number: str, beside: str) -> float:
        return run[number].forward_peak[0] / run[beside].forward_peak[0]

    def end(number: str) -> float:
        return float(run[number].angles.mean())

    by_law = "(2-15) makes it the ratio of the whirls times that of the speeds squared, a half"
    twice = "twice the mass times twice the whirl are four times the force by (2-15)"
    scaled_c = "with c scaled by sqrt 2 as well the printed values come out: see the rows below"
    reference = run["4.25"]
    return [
        value("4.26 (a)", "start time", 1.77, cases["4.26"][0].critical_time, " s", 0.01),
        value("4.26 (a)", "peak W/e over that of 4.24", 0.5, peak("4.26", "4.24")),
        value("4.26 (b)", "peak force over that of 4.24", 1 / 3, force("4.26", "4.24"), why=by_law),
        value("4.27 (a)", "peak W/e over that of 4.25", 2 / 3, peak("4.27", "4.25")),
        value("4.27 (b)", "peak force over that of 4.25", 2 / 3, force("4.27", "4.25"), why=by_law),
        value("4.27 (c)", "end position", -100.0, end("4.27"), " deg"),
        _opposite("4.28", "with m = 2 g the balance effect is there", run["4.28"]),
        value("4.29 (a)", "start time", 3.54, cases["4.29"][0].critical_time, " s", 0.01),
        value("4.29 (a)", "peak W/e over that of 4.24", 1.1, peak("4.29", "4.24"), why=scaled_c),
        value("4.29 (b)", "peak force over that of 4.24", 1.8, force("4.29", "4.24"), why=scaled_c),
        value("4.30 (a)", "peak W/e over that of 4.25", 1.0, peak("4.30", "4.25"), why=scaled_c),
        value("4.30 (b)", "peak force over that of 4.25", 1.5, force("4.30", "4.25"), why=scaled_c),
        value("4.30 (c)", "end position", -300.0, end("4.30"), " deg", why=scaled_c),
        value("4.29 (a), c scaled", "peak W/e over that of 4.24", 1.1,
              peak("4.29, c scaled", "4.24")),
        value("4.29 (b), c scaled", "peak force over that of 4.24", 1.8,
              force("4.29, c scaled", "4.24")),
        value("4.30 (a), c scaled", "peak W/e over that of 4.25", 1.0,
              peak("4.30, c scaled", "4.25")),
        value("4.30 (b), c scaled", "peak force over that of 4.25", 1.5,
              force("4.30, c scaled", "4.25")),
        value("4.30 (c), c scaled", "end position", -300.0, end("4.30, c scaled"), " deg"),
        _opposite("4.31", "with m = 0.5 g the effect is suppressed to the right one", run["4.31"]),
        value("4.32", "whirl grows in proportion to R: peak W/e over that of 4.24", 2.0,
              peak("4.32", "4.24")),
        value("4.32", "force grows in proportion to R", 2.0, force("4.32", "4.24"),
              why="the whirl itself grows by less than R"),
        Claim("4.33", "the end position does not change much: the end time stays",
              f"{degrees(run['4.33'].angles)}, in 4.25 {degrees(reference.angles)}",
              abs(end("4.33") - end("4.25")) <= 30.0),
        Claim("4.34", "peak W/e is suppressed", f"{run['4.34'].peak[0]:.1f}, in 4.24 "
              f"{run['4.24'].peak[0]:.1f}", run["4.34"].peak[0] < 0.9 * run["4.24"].peak[0]),
        _opposite("4.35", "the same effect to some extent", run["4.35"]),
        Claim("4.35", "strictly, m must be increased, too",
              f"{degrees(run['4.35'].angles)} as it is, in 4.25 {degrees(reference.angles)}",
              abs(end("4.35") + 180.0) > abs(end("4.25") + 180.0),
              "with more damping they end nearer to -180 deg than before"),
        value("4.36 (a)", "peak W/e", 33.0, run["4.36"].peak[0]),
        value("4.36 (a)", "whirl over that of 4.24", 1.3, 2.0 * peak("4.36", "4.24")),
        value("4.36 (b)", "largest force", 0.08, run["4.36"].forward_peak[0], " N"),
        Claim("4.36 (c)", "the balls go slightly farther than in 4.24",
              f"{end('4.36'):.0f} deg, in 4.24 {end('4.24'):.0f} deg",
              -60.0 < end("4.36") - end("4.24") < 0.0),
        Claim("4.37", "slightly too much", f"{degrees(run['4.37'].angles)}; in 4.25 "
              f"{degrees(reference.angles)}", -60.0 < end("4.37") - end("4.25") < 0.0),
        Claim("4.37", "m must be decreased", f"by {end('4.25') - end('4.37'):.0f} deg too far",
              end("4.25") - end("4.37") > 10.0, "the hold makes up for e"),
        _unchanged("4.38, 4.39", "a of the ball has no influence",
                   (run["4.38"], run["4.24"]), (run["4.39"], reference)),
        value("4.40 (a)", "peak W/e over that of 4.24", 2.0, peak("4.40", "4.24")),
        value("4.40 (b)", "largest force over that of 4.24", 2.0,
              force("4.40", "4.24"), why=twice),
        value("4.40 (c)", "end position", -600.0, end("4.40"), " deg"),
        _not_by_time("4.40", "m = 2 g: not by the end time alone", p._replace(m=2e-3)),
        _opposite("4.41", "with c_b = 4 the same effect at the same times", run["4.41"]),
        _unchanged("4.42, 4.43", "the influence of beta_b is small",
                   (run["4.42"], run["4.24"]), (run["4.43"], reference)),
        Claim("4.44", "the viscous drag hinders: the effect is insufficient",
              f"{degrees(run['4.44'].angles)}, in 4.24 {degrees(run['4.24'].angles)}",
              end("4.44") > end("4.24")),
        _not_by_time("4.44", "c_b = 2: not by the end time alone", p._replace(c_b=2.0)),
        _opposite("4.45", "m about 1.3 times gives the same effect (text)", run["4.45, m = 1.3 g"]),
        _opposite("4.45", "m = 2 g does (caption)", run["4.45, m = 2 g"]),
    ]  # fmt: skip


def over_ranges(tell: Tell) -> dict[Rule, tuple[np.ndarray, np.ndarray]]:
    """By rule the balls' mean end position without and with the period [deg], by factor."""
    cases = []
    for rule in RULES:
        for factor in FACTORS:
            p = rule.changed(float(factor))
            cases += [(p, None), (p, period_of(p))]
    found = ends("section 4.5, rules over ranges", cases, tell)
    angles = np.array([end.angle for end in found]).reshape(len(RULES), len(FACTORS), 2)
    return {rule: (angles[k, :, 0], angles[k, :, 1]) for k, rule in enumerate(RULES)}


def where(good: np.ndarray) -> str:
    """Factors for which something holds, in words."""
    if good.all():
        return f"{FACTORS[0]:g} to {FACTORS[-1]:g}"
    stretches, first = [], None
    for k, (factor, is_good) in enumerate(zip(FACTORS, good, strict=True)):
        if is_good and first is None:
            first = factor
        if first is not None and (not is_good or k == len(FACTORS) - 1):
            last = factor if is_good else FACTORS[k - 1]
            stretches.append(f"{first:g} to {last:g}" if last > first else f"{first:g}")
            first = None
    return ", ".join(stretches) or "nowhere"


def word_of(rule: Rule, good: np.ndarray) -> str:
    """What becomes of a rule, given for which factors both balls are opposite."""
    at_2 = bool(good[_at(2.0)])
    if at_2 != rule.enough:
        return "refuted"
    if not rule.enough:
        return "confirmed: it is not enough"
    return "confirmed" if good.all() else "limited to these factors"


def _range_table(ranges: dict[Rule, tuple[np.ndarray, np.ndarray]]) -> Table:
    rows = []
    for rule, (_, held) in ranges.items():
        good = opposite(held)
        rows.append(
            (
                str(rule.number),
                rule.what,
                rule.printed,
                where(good),
                f"{held[_at(2.0)]:.0f}",
                word_of(rule, good),
            )
        )
    return Table(
        "Each rule over a range: for which factors are both balls opposite, -150 to -210 deg?",
        ("rule", "changed", "the thesis", "factors", "end at factor 2 [deg]", "as a rule for this"),
        tuple(rows),
    )


def _at(factor: float) -> int:
    return int(np.argmin(np.abs(FACTORS - factor)))


def _opposite(figure: str, printed: str, run: StartUp) -> Claim:
    return Claim(figure, printed, degrees(run.angles), bool(opposite(run.angles).all()))


def _not_by_time(figure: str, printed: str, p: Parameters) -> Claim:
    """That no end of the hold brings both balls opposite."""
    periods = [period_of(p)._replace(duration=float(d)) for d in DURATIONS]
    good = [bool(opposite(run.angles).all()) for run in start_ups([(p, x) for x in periods])]
    found = [f"{d:g}" for d, ok in zip(DURATIONS, good, strict=True) if ok]
    ours = f"holds of {', '.join(found)} s do" if found else "no hold of up to 1.5 s does"
    return Claim(figure, printed, ours, not found)


def _unchanged(figure: str, printed: str, *pairs: tuple[StartUp, StartUp]) -> Claim:
    pairs_of_ends = [(float(one.angles.mean()), float(other.angles.mean())) for one, other in pairs]
    ours = "; ".join(f"{one:.0f} deg in place of {other:.0f}" for one, other in pairs_of_ends)
    return Claim(figure, printed, ours, all(abs(a / b - 1) < ABOUT for a, b in pairs_of_ends))


def _picture(folder: Path, ranges: dict[Rule, tuple[np.ndarray, np.ndarray]]) -> Picture:
    figure = Figure(figsize=(12.0, 9.0), layout="constrained")
    panels = figure.subplots(3, 4, sharex=True).flat
    for axes, (rule, (without, held)) in zip(panels, ranges.items(), strict=False):
        axes.axhspan(-210.0, -150.0, color="0.9", zorder=0)
        axes.plot(FACTORS, without, ".-", color="tab:gray", ms=4, label="without a period")
        axes.plot(FACTORS, held, ".-", color="tab:blue", ms=4, label="with the rule's period")
        axes.set_title(f"({rule.number}) {rule.what}", fontsize=10)
        axes.axvline(2.0, color="0.7", lw=0.8, ls=":")
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
        "dotted: the thesis' factor 2"
    )
    return written(figure, folder, "4.5-rules", caption)
