"""The thesis page: each verdict, and the values behind it; the whole page is written by hand.

Source: Yoshida (2014), chapters 4 to 6. Of the thousand starts of section 6.2 ten are run here.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ab_sim.papers.page import Table
from ab_sim.papers.thesis import LEFT_OUT, _in_short
from ab_sim.papers.thesis import rotation as chapter_5
from ab_sim.papers.thesis.claims import BY_CONSTRUCTION, Claim, opposite, value
from ab_sim.papers.thesis.drive import HOLD, THESIS, Period, start_ups
from ab_sim.papers.thesis.five_balls import Bar, Case, bars_of, base, changes_of, starts
from ab_sim.papers.thesis.judged import LINE, PRINTED, judged
from ab_sim.papers.thesis.many import ends
from ab_sim.papers.thesis.measured import SPEEDS, measured_claims
from ab_sim.papers.thesis.measures import closest, course_apart
from ab_sim.papers.thesis.other_drives import period_of
from ab_sim.papers.thesis.pictures import FORCES, histories
from ab_sim.papers.thesis.ratios import damped_table, ratio_claims
from ab_sim.papers.thesis.rotation_claims import hold_claims as hold_claims_5
from ab_sim.papers.thesis.rotation_claims import without_claims as without_claims_5
from ab_sim.papers.thesis.rules import (
    FACTORS,
    RULES,
    where,
    word_of,
)
from ab_sim.papers.thesis.settling import settling_claims
from ab_sim.papers.thesis.settling import starts_claims as settling_starts_claims
from ab_sim.papers.thesis.with_period import (
    acceleration_claims,
    all_runs,
    hold_claims,
    matched_table,
)
from ab_sim.papers.thesis.without_period import STARTS, starts_claims, starts_runs, without_claims
from ab_sim.scene.load import changed_scene
from tests.cli.tool import PNG


def quiet(*_: Any) -> None:
    """Tells nobody."""


def fails(claims: list[Claim]) -> list[str]:
    """Figures and statements that do not hold."""
    return [f"{claim.figure}: {claim.printed}" for claim in claims if claim.holds is False]


def test_section_4_1() -> None:
    runs = start_ups([(THESIS._replace(starts=start), None) for start in STARTS.values()])
    claims = without_claims(dict(zip(STARTS, runs, strict=True)))
    assert len(claims) == 15
    assert fails(claims) == ["4.5 (c), 4.6: one ball in the vicinity of -180 deg, the other not"]
    np.testing.assert_allclose(runs[2].angles, [-138.8, 50.2], atol=0.3)
    # The thesis' own example of balls that are not in the vicinity is none to us, either.
    assert not opposite(runs[0].angles).any()


def test_the_starts_of_table_4_1() -> None:
    claims = starts_claims(starts_runs())
    assert [claim.holds for claim in claims] == [False, False]
    assert claims[0].ours.startswith("4 of 16") and claims[1].ours.startswith("7 of 16")


def test_sections_4_2_and_4_3() -> None:
    runs = all_runs()
    claims = hold_claims(runs)
    gone = "residual unbalance is eliminated"
    assert fails(claims) == [f"4.7, 4.8: {gone}", f"4.9, 4.10: {gone}", f"4.11, 4.12: {gone}"]
    assert fails(acceleration_claims(runs)) == [
        "4.3: the acceleration in the period controls how far the balls go",
        "4.15-4.17 (b): the largest force hardly changes ...",
    ]
    assert runs["4.7"].residual == pytest.approx(1.14, abs=0.01)
    assert course_apart(runs["4.7"], runs["4.1"]) > 0.2 > course_apart(runs["4.9"], runs["4.7"])


def test_balls_that_match_the_disc_leave_little_with_the_hold() -> None:
    """The thesis' own two leave as much as they take; it is the same with and without a period."""
    rows = matched_table(quiet).rows
    residuals, whirls = np.array([row[-2:] for row in rows], float).T
    np.testing.assert_allclose(residuals, [1.23, 1.14, 0.95, 0.18], atol=0.01)
    np.testing.assert_allclose(whirls, [1.365, 1.367, 0.117, 0.058], atol=0.002)


def test_section_4_4() -> None:
    lines = {
        a: judged("section 4.4, duration", [Period(2.5, float(d), a) for d in LINE], quiet)
        for a in PRINTED
    }
    (touching,) = start_ups([(THESIS, Period(2.5, 0.4, 20.0))])
    assert fails(settling_claims(lines, touching)) == [
        "4.21: half the acceleration for 0.4 s: settled in 0.88 s",
        "4.4: half the acceleration: 0.5 s is soonest of 0.4, 0.5, 0.6 s",
        "4.23: half the acceleration: 0.5 s is soonest of 0.4, 0.5, 0.6, 0.7 s",
    ]
    short, when = closest(touching, 3.38, 0.1)
    assert 0.0 < short < 2.0 and 3.38 < when < 3.45
    # All are later than printed.
    for acceleration, printed in PRINTED.items():
        for duration, published in printed.items():
            ours = lines[acceleration][int(np.argmin(np.abs(LINE - duration)))].settling
            assert ours is not None and ours > published


def test_the_best_duration_depends_on_the_start() -> None:
    claims = settling_starts_claims()
    assert [claim.holds for claim in claims] == [False, False]
    assert "0.4 s for 4, 0.5 s for 3" in claims[0].ours and "none for 14" in claims[1].ours


def test_the_final_whirl_is_one_state_with_any_period_or_none() -> None:
    few = [None, HOLD, Period(2.0), Period(3.0), Period(2.35, 0.5, 20.0)]
    final = [one.end.final_whirl for one in judged("a few", few, quiet)]
    assert max(final) / min(final) < 1.01


def test_section_4_5() -> None:
    claims = ratio_claims()
    left = "balance effect: it cancels the unbalance (ours: 0.1 at most)"
    assert fails(claims) == [
        "4.26 (b): peak force over that of 4.24: about 0.333",
        "4.27 (b): peak force over that of 4.25: about 0.667",
        "4.27: m must be increased: not by the end time alone",
        f"4.28: {left}",
        "4.29 (a): peak W/e over that of 4.24: about 1.1",
        "4.29 (b): peak force over that of 4.24: about 1.8",
        "4.30 (a): peak W/e over that of 4.25: about 1",
        "4.30 (b): peak force over that of 4.25: about 1.5",
        "4.30 (c): end position: about -300 deg",
        "4.30: m must be reduced: not by the end time alone",
        f"4.31: {left}",
        "4.32-4.44: the start time depends on M and k only",
        "4.32: whirl in proportion to R: W/e over that of 4.24 (ours: to 10 %): about 2",
        "4.32: force in proportion to R (ours: to 10 %): about 2",
        f"4.33: {left}",
        f"4.35: {left}",
        "4.35: strictly, m must be increased, too",
        "4.37: the balance effect is slightly excessive",
        "4.37: m must be decreased, not only the end time adjusted",
        "4.40 (b): largest force over that of 4.24: about 2",
        "4.40: m = 2 g: not by the end time alone",
        f"4.41: {left}",
        "4.44: c_b = 2: not by the end time alone",
        f"4.45, m = 1.3 g: {left}",
        "4.45: m = 2 g does (caption)",
        f"4.45, m = 2 g: {left}",
    ]
    # The two times that are given, not found.
    assert [claim.holds for claim in claims].count(None) == 2


def test_the_spring_comes_out_as_printed_where_the_damping_is_scaled() -> None:
    printed, plain, damped = np.array([row[2:] for row in damped_table().rows], float).T
    np.testing.assert_allclose(damped, printed, rtol=0.15)
    assert (np.abs(plain / printed - 1.0) > 0.2).all()


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.what)
def test_each_rule_at_half_and_triple(rule: Any) -> None:
    """What the page's table says of a rule, at the ends of its range and at factor 2."""
    drives = [rule.changed(factor) for factor in (0.5, 2.0, 3.0)]
    found = ends("rules", [(p, period_of(p)) for p in drives], quiet)
    good = opposite(np.array([end.angle for end in found])).tolist()
    expected = {
        "M": [False, False, False],
        "k": [False, False, False],
        "k, m against it": [False, True, True],
        "c": [False, True, True],
        "c_b, m 1.3 times for its double": [False, True, True],
    }
    assert good == expected.get(rule.what, [True, True, True])


def test_what_becomes_of_a_rule_and_where() -> None:
    enough, not_enough = RULES[1], RULES[0]
    everywhere, nowhere = np.ones(len(FACTORS), bool), np.zeros(len(FACTORS), bool)
    assert word_of(enough, everywhere) == "confirmed"
    assert word_of(enough, nowhere) == "refuted: it is not enough"
    assert word_of(not_enough, everywhere) == "refuted: it is enough"
    assert word_of(enough, FACTORS >= 1.0) == "limited to these factors"
    assert word_of(not_enough, FACTORS < 1.5) == "confirmed: it is not enough"
    assert where(everywhere) == "0.5 to 3" and where(nowhere) == "nowhere"
    assert where((FACTORS == 0.5) | (FACTORS >= 2.0)) == "0.5, 2 to 3"


def test_chapter_5() -> None:
    runs = chapter_5.histories_of()
    drag, eccentricity = chapter_5.over_drag(quiet), chapter_5.over_eccentricity(quiet)
    in_time = "the settling time is not significantly changed by e, m = 1 g"
    assert fails(without_claims_5(runs, drag, eccentricity)) == [
        "5.2 (c): settles near, the next balanced position: about -540 deg",
        "5.2 (c): odd multiples of -180 deg are the balanced positions",
        "5.4: they settle in the vicinity of odd multiples of -180 deg",
        "5.6: e does not change the end position much (ours: by 60 deg)",
        f"5.6: {in_time}",
    ]
    assert fails(hold_claims_5(runs, drag, eccentricity)) == [
        "5.7-5.9: the settling time grows by the period of 0.5 s",
        "5.12: e does not change the end position much, whatever m (ours: by 60 deg)",
        "5.12: it changes less than without the hold",
        f"5.12: {in_time}",
    ]


def test_ten_starts_of_section_6_2() -> None:
    """A share of the page's thousand, the same ones first: less than without balls."""
    assert starts(10) == starts(12)[:10]
    hold, plain = bars_of("ten", [Case(2500.0), Case()], 10, quiet)
    assert hold.each.shape == (10,) and 5.0 < hold.mean < 15.0 and plain.mean != hold.mean
    # What the balls carry is what the whirl lacks: 0.33 g cm at most, against 0.3.
    assert (np.abs(hold.balls) < 0.331).all() and -0.3 < hold.balls.real.mean() < -0.15


def test_verdicts_of_section_6_2() -> None:
    """Of bars as the thesis printed them all hold that are of bars; of even ones none."""
    random = np.random.default_rng(1)
    common = random.normal(0.0, 1.0, 200)

    def bar(mean: float, balls: float) -> Bar:
        each = mean + common + random.normal(0.0, 0.1, 200)
        return Bar(each, np.ones(200), np.full(200, -balls + 0j))

    printed = {"no period": bar(20.0, 0.1), "2500 rpm": bar(10.0, 0.3)}
    printed |= {"2000 rpm": bar(14.0, 0.2), "3000 rpm": bar(12.0, 0.2)}
    even = {name: bar(10.0, 0.2) for name in printed}
    speeds = [(30.0 if rpm >= 2300 else 9.0, bar(10.0, 0.3)) for rpm in SPEEDS]
    eccentric = dict.fromkeys((0.1, 0.25, 0.5), (30.0, bar(10.0, 0.2), bar(10.0, 0.2)))
    verdicts = [
        {claim.printed: claim.holds for claim in measured_claims(
            bars, 30.0, bar(10.0, 0.3), speeds, eccentric, whirls
        )}
        for bars, whirls in ((printed, [2.0, 1.0]), (even, [1.0, 1.0]))
    ]  # fmt: skip
    periods = list(verdicts[0])[:8]
    assert [verdicts[0][one] for one in periods] == [True] * 8
    assert [verdicts[1][one] for one in periods] == [True, False, False, True] + [False] * 4
    assert verdicts[0]["the balls' position is the same for every unbalance"]
    assert not verdicts[0]["at 0.5 g cm it shakes more in all three"]


def test_the_drive_of_section_6_2_has_what_is_printed() -> None:
    """0.3 g cm, a critical speed of 2300 rpm, whatever the mass."""
    for case in (Case(2500.0), Case(2500.0, choice="mass", factor=2.0)):
        scene = changed_scene(base(), changes_of(case), "test")
        assert scene.eccentric_mass * scene.rotor.eccentricity == pytest.approx(3e-6)
        assert scene.critical_speed * 30 / np.pi == pytest.approx(2300.0, rel=0.01)


def test_bars_differ_where_their_intervals_do_not_meet() -> None:
    random = np.random.default_rng(0)
    none = np.zeros(1000)
    low, high = (Bar(random.normal(mean, 1.0, 1000), none, none) for mean in (1.0, 1.3))
    assert low.below(high) and not high.below(low) and not low.below(low)
    assert low.first(10).interval > 5 * low.interval
    # Start by start a difference shows that is small beside what the starts do.
    shifted = low._replace(each=low.each + random.normal(0.02, 0.1, 1000))
    assert low.below(shifted) and shifted.mean - low.mean < low.interval


def test_what_is_no_result_is_not_counted() -> None:
    claim = Claim("1", "x", "y", None, BY_CONSTRUCTION)
    assert claim.verdict == BY_CONSTRUCTION


def test_what_is_known_is_not_run_again() -> None:
    told: list[tuple[str, int, int]] = []
    cases = [(THESIS._replace(c_b=1.01), None), (THESIS._replace(c_b=1.01), HOLD)]
    first = ends("two", cases, lambda *what: told.append(what))
    told.clear()
    assert ends("two", cases, lambda *what: told.append(what)) == first
    assert told == [("two", 2, 2)]


def test_a_value_holds_within_its_share() -> None:
    assert value("1", "x", 2.0, 2.29).holds and not value("1", "x", 2.0, 2.31).holds
    assert value("1", "x", 2.0, 3.0, why="because").verdict == "does not hold: +50 %; because"
    assert value("1", "x", -200.0, -205.0, " deg").verdict == "holds"


def test_the_head_counts_the_verdicts() -> None:
    columns = ("figure", "the thesis", "ours", "verdict")
    rows = (("1", "a", "b", "holds"), ("2", "a", "b", "does not hold: c"))
    section = LEFT_OUT._replace(tables=(Table("t", columns, rows),))
    assert _in_short([section, section]).text[0].startswith("1. Of 4 statements 2 hold")


def test_every_figure_has_a_row() -> None:
    """A reader with the thesis open finds each figure of chapters 4 to 6 by its number."""
    page = Path(__file__).parents[2] / "docs" / "papers" / "thesis.md"
    text = page.read_text(encoding="utf-8")
    shown = [f"4.{k}" for k in range(1, 46)] + [f"5.{k}" for k in range(1, 13)]
    shown += [f"6.{k}" for k in range(3, 7)]
    missing = [number for number in shown if number not in _numbers(text)]
    assert missing == []


def _numbers(text: str) -> set[str]:
    """Figure numbers in a text, those within ranges, too."""
    found = set(re.findall(r"\b[456]\.\d+\b", text))
    for first, last in re.findall(r"\b([456]\.\d+)(?:-| to )([456]\.\d+)\b", text):
        chapter, begin = first.split(".")
        found |= {f"{chapter}.{k}" for k in range(int(begin), int(last.split(".")[1]) + 1)}
    return found


def test_a_picture_makes_its_folder(tmp_path: Path) -> None:
    run = start_ups([(THESIS, HOLD)])[0]
    folder = tmp_path / "not" / "there"
    picture = histories(folder, "4.7", {"4.7": run}, FORCES, "Figure 4.7")
    assert (folder / picture.file).read_bytes().startswith(PNG)
