"""What section 4.5 says of other drives, at twice each parameter."""

import math

import numpy as np

from gallery.page import Cell, Table
from gallery.thesis.adjustments import (
    adjusted_claim,
    as_far_claim,
    best_starts,
    force_claims,
    start_claims,
)
from gallery.thesis.causes import farther_claim, force_by_whirl_claim
from gallery.thesis.claims import (
    ABOUT,
    BALANCED,
    BY_CONSTRUCTION,
    FAR,
    READ,
    UNDECIDED,
    Claim,
    angle,
    at_odd,
    bound,
    degrees,
    opposite,
    own,
    stretches,
    value,
)
from gallery.thesis.drive import (
    AFTER,
    OPPOSITE,
    THESIS,
    Parameters,
    StartUp,
    start_ups,
)
from gallery.thesis.measures import at_time
from gallery.thesis.optimum import optimum_claim
from gallery.thesis.other_drives import (
    CASES,
    DURATIONS,
    Ratios,
    holds_of,
    nearest,
    period_of,
)

SLIGHTLY = (READ, FAR)
"""[deg] farther; ours."""
NEARLY = 0.05
"""How far beyond ``ABOUT`` proportion without a printed number is undecided; ours."""
SUPPRESSED = 0.1
MORE_THAN_A_LITTLE = 0.3
"""What is "suppressed" is less by this share at least; ours."""
EFFECTIVE = (
    "4.25", "4.28", "4.31", "4.33", "4.35", "4.37", "4.39", "4.41", "4.43", "4.45, m = 1.3 g",
    "4.45, m = 2 g",
)  # fmt: skip
"""Figures in which balls are to balance."""
FRICTIONS = (2.0, 10.0, 30.0, 100.0, 300.0)
"""Factors of beta_b."""
ROOT_2 = math.sqrt(2.0)
OR_MORE = ", or more"
FARTHER = "another end time alone does it"
"""Where balls come to the next balanced position, if not to -180 deg."""


def ratio_claims() -> list[Claim]:
    """What the text says at a factor of 2."""
    made = Ratios()
    again = [f"{made.runs[number].peak[0]:.1f}" for number in ("4.24", "4.25")]
    return [
        Claim("4.24, 4.25", "reference data: 4.1 and 4.7 again", f"peak W/e {', '.join(again)}",
              None, BY_CONSTRUCTION),
        *_mass_claims(made), *_spring_claims(made), *_start_claims(made), *_radius_claims(made),
        *_damper_claims(made), *_eccentricity_claims(made), *_ball_claims(made),
        *force_claims(made),
    ]  # fmt: skip


def _mass_claims(made: Ratios) -> list[Claim]:
    peak, force = made.peak, made.force
    return [
        _given("4.26 (a), 4.27 (a)", "start time 1.77 s, end time 2.12 s", made.runs["4.27"]),
        value("4.26 (a)", "peak W/e over that of 4.24", 0.5, peak("4.26", "4.24")),
        bound("4.26 (b)", "peak force over that of 4.24", 1 / 3, force("4.26", "4.24"), less=True),
        _by_whirl("4.26", "as a result of the whirl the force is quite small", made),
        value("4.27 (a)", "peak W/e over that of 4.25", 2 / 3, peak("4.27", "4.25")),
        value(
            "4.27 (b)",
            "peak force over that of 4.25 (the English: 2/3)",
            1 / 3,
            force("4.27", "4.25"),
        ),
        angle("4.27 (c)", "end position", -100.0, made.end("4.27")),
        Claim(
            "4.27",
            "the balance effect is missing",
            degrees(made.runs["4.27"].angles),
            not opposite(made.runs["4.27"].angles).any(),
        ),
        _not_by_time(
            "4.27", "m must be increased: the end time alone does not do it", CASES["4.27"][0]
        ),
        _driven("4.28", "4.27", "m = 2 g increases the driving force", made),
        _effect("4.28", "with m = 2 g the balance effect is there", made),
        _cancels("4.28", made),
        optimum_claim("4.27", "1/sqrt(M)", CASES["4.27"][0]),
        optimum_claim("4.28", "1/sqrt(M), m with it", CASES["4.28"][0]),
    ]


def _spring_claims(made: Ratios) -> list[Claim]:
    damping = "with c also scaled by sqrt 2, the printed values result: see the next table"
    rows = [
        bound(f"{figure} ({part})", what.removesuffix(OR_MORE), printed, ours, less=False)
        if what.endswith(OR_MORE) else
        value(f"{figure} ({part})", what, printed, ours, why=damping)
        for figure, part, what, printed, ours, unit in spring_values(made, "") if not unit
    ]  # fmt: skip
    return [
        _given("4.29 (a), 4.30 (a)", "start time 3.54 s, end time 4.24 s", made.runs["4.30"]),
        *rows[:2],
        _by_whirl("4.29", "as a result of the whirl the force is quite large", made),
        *rows[2:],
        farther_claim("4.30", "as a result of the force they go farther than in 4.25",
                      made.runs["4.30"], ("4.25", made.runs["4.25"])),
        angle("4.30 (c)", "end position", -300.0, made.end("4.30"), damping),
        Claim("4.30 (c)", "beyond -180 deg (the English: greatly)",
              f"by {-180.0 - made.end('4.30'):.0f} deg", made.end("4.30") < -180.0 - READ),
        _not_by_time("4.30", "m must be reduced: not by the end time alone", CASES["4.30"][0]),
        _nor_farther("4.30", CASES["4.30"][0]),
        _driven("4.31", "4.30", "m = 0.5 g decreases the driving force", made),
        _effect("4.31", "with m = 0.5 g the effect is suppressed to the right one", made),
        optimum_claim("4.30", "sqrt(k)", CASES["4.30"][0]),
        optimum_claim("4.31", "sqrt(k), m against it", CASES["4.31"][0]),
    ]  # fmt: skip


def spring_values(made: Ratios, kind: str) -> tuple[tuple[str, str, str, float, float, str], ...]:
    """Figure, part, what, printed, ours and its unit; of runs whose names end so."""
    free, held = f"4.29{kind}", f"4.30{kind}"
    force = "peak force over that of"
    return (
        ("4.29", "a", "peak W/e over that of 4.24", 1.1, made.peak(free, "4.24"), ""),
        ("4.29", "b", f"{force} 4.24{OR_MORE}", 1.8, made.force(free, "4.24"), ""),
        ("4.30", "a", "peak W/e over that of 4.25", 1.0, made.peak(held, "4.25"), ""),
        ("4.30", "b", f"{force} 4.25", 1.5, made.force(held, "4.25"), ""),
        ("4.30", "c", "end position", -300.0, made.end(held), " deg"),
    )


def damped_table() -> Table:
    """The spring's figures again, with the damping scaled, too; not the thesis' statement."""
    made, p = Ratios(), THESIS._replace(k=2e3, c=ROOT_2 * THESIS.c)
    cases = [(p, None), (p, period_of(p))]
    made.runs |= dict(zip(("4.29 damped", "4.30 damped"), start_ups(cases), strict=True))
    both = zip(spring_values(made, ""), spring_values(made, " damped"), strict=True)
    rows: list[tuple[Cell, ...]] = [
        (f"{figure} ({part})", what + unit, printed, plain, ours)
        for (figure, part, what, printed, plain, unit), (*_, ours, _unit) in both
    ]
    return Table(
        "Ours: is it the damping? k = 2000 N/m with c as printed, and with c scaled by sqrt 2",
        ("figure", "what", "printed", "c = 0.2 N s/m", "c = 0.283 N s/m"),
        tuple(rows),
        3,
    )


def _start_claims(made: Ratios) -> list[Claim]:
    numbers = [number for number in CASES if number >= "4.32"]
    starts = {f"{period_of(CASES[number][0]).start:.2f}" for number in numbers}
    return [
        Claim("4.32 to 4.45", "the start time depends on M and k only",
              f"{', '.join(sorted(starts))} s", None, BY_CONSTRUCTION),
        *start_claims(best_starts()),
    ]  # fmt: skip


def _radius_claims(made: Ratios) -> list[Claim]:
    shares = [1.0 + one.parameters.carried for one in (made.runs["4.24"], made.runs["4.32"])]
    less = (
        "only the balls' share of the unbalance grows with R: "
        f"1 + 2 m R / (M0 e) grows {shares[1] / shares[0]:.2f} times"
    )
    return [
        value("4.32", "whirl in proportion to R: W/e over that of 4.24", 2.0,
              made.peak("4.32", "4.24"), why=less),
        _force_by_radius(made.force("4.32", "4.24"), less),
        *(as_far_claim(figure, made) for figure in ("4.32", "4.33")),
        _not_much("4.32 (c)", "the balls' phase does not change much", made, ("4.32", "4.24")),
        _not_much("4.33", "the end position does not change much: the end time stays", made,
                  ("4.33", "4.25")),
        _effect("4.33", "the balance effect stays", made),
    ]  # fmt: skip


def _force_by_radius(ours: float, less: str) -> Claim:
    """That the force grows as R does, for which no number is printed."""
    claim = value("4.32", "force in proportion to R", 2.0, ours, why=less)
    if abs(ours / 2.0 - 1.0) > ABOUT + NEARLY:
        return claim
    return claim if claim.holds else claim._replace(
        holds=None,
        why=f"{UNDECIDED}: {claim.why}; so it is not by {ABOUT:.0%}, but by {ABOUT + NEARLY:.0%}, "
        "and no number is printed (the Japanese has the whirl, to which the force goes, almost "
        "in proportion)",
    )  # fmt: skip


def _damper_claims(made: Ratios) -> list[Claim]:
    p = THESIS
    dampers = (0.2, 0.3, 0.4)
    best = [nearest(p._replace(c=c)) for c in dampers]
    rates = [duration / c for c, (duration, _) in zip(dampers, best, strict=True)]
    return [
        Claim("4.34", "peak W/e is a little smaller", f"{made.runs['4.34'].peak[0]:.1f}, in 4.24 "
              f"{made.runs['4.24'].peak[0]:.1f} (ours: by "
              f"{SUPPRESSED:.0%} to {MORE_THAN_A_LITTLE:.0%})",
              1.0 - MORE_THAN_A_LITTLE <= made.peak("4.34", "4.24") <= 1.0 - SUPPRESSED),
        _effect("4.35", "the same effect to some extent", made),
        Claim("4.35", "the end time is not simply in proportion to c",
              "nearest to -180 deg with holds of "
              + ", ".join(f"{duration:g}" for duration, _ in best)
              + f" s at c = 0.2, 0.3, 0.4 N s/m: hold over c differs by "
              f"{max(rates) / min(rates) - 1:.0%} (ours: more than {ABOUT:.0%})",
              max(rates) > (1.0 + ABOUT) * min(rates)),
        adjusted_claim("4.35", "the end time or m finely adjusted (the English: and m increased)",
                       CASES["4.35"][0]),
    ]  # fmt: skip


def _eccentricity_claims(made: Ratios) -> list[Claim]:
    farther = {pair: made.end(pair[0]) - made.end(pair[1]) for pair in
               (("4.24", "4.36"), ("4.25", "4.37"))}  # fmt: skip
    plain, held = farther.values()
    drive = CASES["4.37"][0]
    slight = f"(ours: {SLIGHTLY[0]:g} to {SLIGHTLY[1]:g} deg)"
    return [
        Claim("4.36 (a)", "peak W/e is decreased", f"{made.runs['4.36'].peak[0]:.1f}, in 4.24 "
              f"{made.runs['4.24'].peak[0]:.1f} (ours: by {SUPPRESSED:.0%})",
              made.peak("4.36", "4.24") <= 1.0 - SUPPRESSED),
        value("4.36 (a)", "... to", 33.0, made.runs["4.36"].peak[0]),
        value("4.36 (a)", "whirl over that of 4.24", 1.3, 2.0 * made.peak("4.36", "4.24")),
        value("4.36 (b)", "largest force over that of 4.24", 1.3, made.force("4.36", "4.24")),
        _by_whirl("4.36", "as a result of the whirl the force is larger", made),
        value("4.36 (b)", "largest force", 0.08, made.runs["4.36"].forward_peak[0], " N"),
        Claim("4.36 (c)", "the balls go slightly farther than in 4.24",
              f"by {plain:.0f} deg, to {made.end('4.36'):.0f} deg {slight}",
              SLIGHTLY[0] < plain < SLIGHTLY[1]),
        Claim("4.37", "the balance effect is slightly excessive",
              f"{made.end('4.37'):.0f} deg, by {held:.0f} deg farther than in 4.25 {slight}",
              SLIGHTLY[0] < held < SLIGHTLY[1], f"{abs(held):.0f} deg cannot be read"),
        adjusted_claim("4.37", "the end time or m finely adjusted (the English: and m decreased)",
                       drive),
    ]  # fmt: skip


def _ball_claims(made: Ratios) -> list[Claim]:
    twice = "twice the mass times twice the whirl are four times the force by (2-15)"
    heavy, runs = THESIS._replace(m=2e-3), made.runs
    return [
        _unchanged("4.38, 4.39", "a of the ball has no influence", made,
                   ("4.38", "4.24"), ("4.39", "4.25")),
        value("4.40 (a)", "peak W/e over that of 4.24", 2.0, made.peak("4.40", "4.24")),
        value("4.40 (b)", "largest force over that of 4.24", 2.0,
              made.force("4.40", "4.24"), why=twice),
        angle("4.40 (c)", "end position", -600.0, made.end("4.40")),
        farther_claim("4.40", "as a result of the force they go there", runs["4.40"],
                      ("4.24", runs["4.24"])),
        _not_by_time("4.40", "m = 2 g: difficult with the end time alone", heavy),
        _nor_farther("4.40", heavy),
        _effect("4.41", "with c_b = 4 the same effect at the same times", made),
        _friction(made),
        _unchanged("4.42, 4.43", "the influence of beta_b is small", made,
                   ("4.42", "4.24"), ("4.43", "4.25")),
        Claim("4.44", "the viscous drag hinders: the effect is insufficient",
              f"{degrees(runs['4.44'].angles)}, in 4.24 {degrees(runs['4.24'].angles)}",
              made.end("4.44") > made.end("4.24") and not opposite(runs["4.44"].angles).any()),
        _not_by_time("4.44", "c_b = 2: difficult with the end time alone",
                     THESIS._replace(c_b=2.0)),
        _effect("4.45", "about 1.3 times m has the same effect", made, "4.45, m = 1.3 g"),
        own("4.45", "does m = 2 g of the caption?", degrees(runs["4.45, m = 2 g"].angles),
            "it does" if opposite(runs["4.45, m = 2 g"].angles).all() else "it does not"),
    ]  # fmt: skip


def _by_whirl(figure: str, printed: str, made: Ratios) -> Claim:
    """Beside 4.24; the whirl itself, which is W/e times e."""
    whirl = made.peak(figure, "4.24") * CASES[figure][0].e / THESIS.e
    return force_by_whirl_claim(f"{figure} (b)", printed, made.force(figure, "4.24"), whirl)


def _not_much(figure: str, printed: str, made: Ratios, pair: tuple[str, str]) -> Claim:
    """That the balls end about where they do beside it."""
    run, reference = (made.runs[number] for number in pair)
    return Claim(
        figure, printed, f"{degrees(run.angles)}, in {pair[1]} {degrees(reference.angles)} (ours: "
        f"by {FAR:g} deg)", abs(made.end(pair[0]) - made.end(pair[1])) <= FAR,
    )  # fmt: skip


def _given(figure: str, printed: str, run: StartUp) -> Claim:
    assert run.period is not None
    start, end = run.period.start, run.period.start + run.period.duration
    return Claim(figure, printed, f"{start:.2f} s, {end:.2f} s", None, BY_CONSTRUCTION)


def _effect(figure: str, printed: str, made: Ratios, number: str = "") -> Claim:
    """That both balls are where the thesis calls the balance effect there."""
    angles = made.runs[number or figure].angles
    return Claim(figure, printed, degrees(angles), bool(opposite(angles).all()))


def _cancels(figure: str, made: Ratios) -> Claim:
    """That the balance effect, as the thesis defines it at this figure, is there."""
    run = made.runs[figure]
    return Claim(
        f"4.27, {figure}", "balance effect: the balls cancel the unbalance",
        f"{run.residual:.2f} of it left, in 4.25 {made.runs['4.25'].residual:.2f} (ours: "
        f"{BALANCED:g} at most)", run.residual <= BALANCED,
        f"2 m R is {run.parameters.carried:.2f} M0 e, and both balls are at one place",
    )  # fmt: skip


def left_table() -> Table:
    """What is left of the unbalance where the thesis has the same effect; not its statement."""
    made = Ratios()
    rows: list[tuple[Cell, ...]] = [
        (number, degrees(made.runs[number].angles), made.runs[number].parameters.carried,
         made.runs[number].residual)
        for number in EFFECTIVE
    ]  # fmt: skip
    return Table(
        "Ours: what is left of the unbalance where the effect is said to be there",
        ("figure", "both balls at", "2 m R over M0 e", "left [of the disc's unbalance]"),
        tuple(rows),
        3,
    )


def _not_by_time(figure: str, printed: str, p: Parameters) -> Claim:
    """That no end of the hold brings both balls to -180 deg, 2.5 s after it."""
    runs = holds_of(p)
    found = _holds_where([bool(opposite(run.angles).all()) for run in runs], runs)
    ends = [float(run.angles.mean()) for run in runs]
    span = f"{max(ends):.0f} to {min(ends):.0f} deg 2.5 s after holds of 0.05 to 1.5 s"
    return Claim(
        figure, printed, f"{span}; near -180 deg: {found or 'none'}", not found,
        "another end time alone does it",
    )  # fmt: skip


def _nor_farther(figure: str, p: Parameters) -> Claim:
    """Whether some end brings them to the next balanced position, as chapter 5 has it."""
    runs = holds_of(p)
    found = _holds_where([_stays_farther(run) for run in runs], runs)
    return own(
        figure, "to -540 or -900 deg, which chapter 5 calls balanced, too?",
        f"there 2.5 s after the critical speed, and after the hold: {found or 'none'}",
        FARTHER if found else "no end time does it",
    )  # fmt: skip


def _stays_farther(run: StartUp) -> bool:
    """Whether both balls are at -540 or -900 deg 2.5 s after the critical speed, and at the end."""
    before = np.degrees(
        at_time(run.trajectory.ball_angles, run, run.parameters.critical_time + AFTER)
    )
    each = [at_odd(angles) & ~opposite(angles) for angles in (before, run.angles)]
    return bool(np.all(each))


def _holds_where(good: list[bool], runs: list[StartUp]) -> str:
    """Each stretch of holds that are good, and where its shortest and its longest end."""
    words = [f"{d:g} s ({run.angles.mean():.0f} deg)"
             for d, run in zip(DURATIONS, runs, strict=True)]  # fmt: skip
    return ", ".join(
        f"{words[first]} to {words[last]}" if last > first else words[first]
        for first, last in stretches(DURATIONS, np.array(good))
    )


def _driven(figure: str, beside: str, printed: str, made: Ratios) -> Claim:
    """That another m gives the other force that is asked for."""
    ratio, heavier = made.force(figure, beside), CASES[figure][0].m > CASES[beside][0].m
    return Claim(
        figure, printed, f"{ratio:.2f} times that of {beside}", (ratio > 1.0) is heavier
    )  # fmt: skip


def _friction(made: Ratios) -> Claim:
    """That friction hinders the balls; how much of it makes the effect insufficient."""
    drives = [THESIS._replace(beta_b=factor * THESIS.beta_b) for factor in FRICTIONS]
    runs = start_ups([(p, period_of(p)) for p in drives], every=10)
    ends = [made.end("4.25"), *(float(run.angles.mean()) for run in runs)]
    return Claim(
        "4.43", "friction hinders the balls: the balance effect is insufficient",
        ", ".join(f"{end:.1f}" for end in ends) + " deg with the hold at 1, "
        + ", ".join(f"{factor:g}" for factor in FRICTIONS) + " times beta_b (ours: less far each "
        f"time, and at last not within {OPPOSITE:g} deg)",
        bool(np.all(np.diff(ends) > 0.0)) and not opposite(runs[-1].angles).any(),
    )  # fmt: skip


def _unchanged(figure: str, printed: str, made: Ratios, *pairs: tuple[str, str]) -> Claim:
    ends = [(made.end(one), made.end(other)) for one, other in pairs]
    ours = "; ".join(f"{one:.1f} deg in place of {other:.1f}" for one, other in ends)
    return Claim(
        figure, printed, f"{ours} (ours: {READ:g} deg)", all(abs(a - b) <= READ for a, b in ends)
    )
