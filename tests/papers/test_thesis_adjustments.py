"""The thesis page: scaled drives, fine adjustments, what the hold brings about in chapter 5."""

import pytest
from gallery.thesis import rotation as chapter_5
from gallery.thesis.accelerated import acceleration_claims
from gallery.thesis.adjustments import (
    adjusted_claim,
    as_far_claim,
    best_starts,
    start_claims,
)
from gallery.thesis.causes import necessary_claim
from gallery.thesis.drive import HOLD, THESIS, StartUp, start_ups
from gallery.thesis.other_drives import CASES, Ratios
from gallery.thesis.rotation_causes import (
    promoted_claims,
    quick_claim,
    reduced_claim,
    serves,
    width_claim,
)
from gallery.thesis.rotation_claims import HELD, PAIRS
from gallery.thesis.settling import positioned_claim
from gallery.thesis.with_period import all_runs, hold_claims


@pytest.fixture(scope="module")
def runs() -> dict[str, StartUp]:
    return chapter_5.histories_of()


def test_the_best_start_is_beyond_the_critical_speed_and_not_the_same_for_all() -> None:
    best = best_starts()
    assert best["the thesis' set"] == 106.0
    assert [best[f"twice {name}"] for name in ("c", "e", "R", "m", "c_b")] == [
        106.0, 110.0, 106.0, 114.0, None
    ]  # fmt: skip
    assert best["half c_b"] == 116.0 and best["half m"] is None
    assert [claim.holds for claim in start_claims(best)] == [False, False]
    assert [claim.holds for claim in start_claims({"a": 102.0, "b": 106.0, "c": None})] == [
        True, True
    ]  # fmt: skip


def test_a_balls_mass_or_the_end_time_serves_finely_where_c_is_doubled_but_not_e() -> None:
    damped, eccentric = (adjusted_claim(n, "x", CASES[n][0]) for n in ("4.35", "4.37"))
    assert damped.holds and "hold of 0.6 s -180, -180 deg, with m = 1.05 g" in damped.ours
    assert (
        eccentric.holds is False
        and "hold of 0.05 s -182, -182 deg, with m = 0.7 g" in eccentric.ours
    )
    assert eccentric.verdict.endswith("that is no fine adjustment")
    # No such m takes balls there that drag holds.
    assert adjusted_claim("x", "x", THESIS._replace(c_b=4.0)).holds is False


def test_the_force_grows_as_the_race_with_the_hold_alone() -> None:
    made = Ratios()
    free, held = (as_far_claim(number, made) for number in ("4.32", "4.33"))
    assert free.holds is False and "1.49 times that in 4.24" in free.ours
    assert held.holds and "1.94 times that in 4.25" in held.ours


def test_forces_and_ways_of_sections_4_1_to_4_4() -> None:
    runs = all_runs()
    assert runs["4.3"].forward_each == pytest.approx([0.0459, 0.0592], abs=1e-4)
    assert runs["4.5"].forward_each == pytest.approx([0.0576, 0.0436], abs=1e-4)
    assert necessary_claim().holds is False and "+-119.3 deg" in necessary_claim().ours
    assert positioned_claim().holds is False and "3.12, 1.14, 0.44" in positioned_claim().ours
    held = {(claim.figure, claim.printed): claim for claim in hold_claims(runs)}
    there = "the balls do not reach the vicinity of -180 deg"
    assert held["4.13 (c)", there].ours.startswith("first there never")
    assert held["4.14 (c)", there].ours.startswith("first there 4.86 s")
    *_, encouraged, _, inhibited = acceleration_claims(runs)
    assert encouraged.holds is False and "-118, -137, -138 deg" in encouraged.ours
    assert inhibited.holds and "101 deg of 111 in 4.18, 139 deg of 153 in 4.1" in inhibited.ours
    assert inhibited.ours.endswith("-0.019 N at 3.0 s, which drives them back from -49 to -19 deg")


def test_promotion_makes_settling_sooner_up_to_a_point() -> None:
    sooner, later, unbalanced = promoted_claims()
    assert [one.holds for one in (sooner, later, unbalanced)] == [False, True, True]
    assert "after 1.29, 0.96, 0.85, 0.67, 0.76, 0.85 s" in sooner.ours
    assert sooner.verdict == "does not hold: true up to -185 deg, 0.3 s; farther is later"
    assert "-205, -225, -247, -263, -282, -294 deg" in unbalanced.ours


def test_the_hold_does_not_reduce_the_lag(runs: dict[str, StartUp]) -> None:
    held, without = [runs[HELD[n]] for n in PAIRS], [runs[n] for n in PAIRS]
    claim = reduced_claim(held, without)
    assert claim.holds is None and "6.3, 20.4, 9.3 rad/s" in claim.ours
    assert claim.ours.count("5.4, 19.6, 8.8") == 1
    assert claim.ours.endswith("it is not reduced")
    assert reduced_claim(without, held).ours.endswith("it is reduced")


def test_over_which_width_the_hold_serves(runs: dict[str, StartUp]) -> None:
    claim = width_claim()
    assert claim.holds and "0.919 to 1.58 N s/m" in claim.ours and "0.783 to 1.04 g" in claim.ours
    assert quick_claim(runs["5.7"], runs["5.1"]).holds
    # Not where they lag extremely, nor where they settle no sooner.
    assert not serves(runs["5.8"], runs["5.2"]) and not serves(runs["5.7"], runs["5.7"])
    edge = THESIS._replace(c_b=1.7)
    with_it, without = start_ups([(edge, HOLD), (edge, None)])
    assert not serves(with_it, without)
