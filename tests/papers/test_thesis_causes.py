"""The thesis page: what is given as a cause, scaled end times, what has settled and where to."""

from typing import Any

import numpy as np
import pytest
from gallery.thesis import rotation as chapter_5
from gallery.thesis.adjustments import force_claims
from gallery.thesis.causes import (
    alike_claim,
    by_force,
    farther_claim,
    force_by_whirl_claim,
    joined_claim,
    moved,
    parted_claim,
    remains_claim,
    sooner_claim,
    with_mean_force,
)
from gallery.thesis.drive import HOLD, THESIS, StartUp, start_ups
from gallery.thesis.matched import suppressed_claim, whirl_without_balls
from gallery.thesis.optimum import optimum_claim, scaled_holds, turns
from gallery.thesis.other_drives import CASES, Ratios
from gallery.thesis.rotation_ranges import DRAGS, ECCENTRICITIES, MASSES
from gallery.thesis.rotation_settled import (
    Swept,
    over_drag,
    over_eccentricity,
    place_claims,
    settled_claim,
    stretch_near,
    trend_claim,
)
from gallery.thesis.with_period import all_runs


def quiet(*_: Any) -> None:
    """Tells nobody."""


@pytest.fixture(scope="module")
def runs() -> dict[str, StartUp]:
    return all_runs()


def test_a_balls_way_is_that_of_its_force(runs: dict[str, StartUp]) -> None:
    """But for what the rotor's acceleration leaves behind: m alpha t / c_b, 9 deg by 4.5 s."""
    behind = np.degrees(THESIS.m * 40.0 * 4.5 / THESIS.c_b)
    np.testing.assert_allclose(moved(runs["4.7"]) - by_force(runs["4.7"]), behind, atol=1.5)
    np.testing.assert_allclose(by_force(runs["4.3"]), [77.8, 131.1], atol=0.3)
    np.testing.assert_allclose(moved(runs["4.3"]), [93.9, 145.1], atol=0.3)
    # The mean of two like forces changes nothing.
    np.testing.assert_allclose(with_mean_force(runs["4.7"]), runs["4.7"].angles, atol=1e-6)


def test_different_forces_do_not_make_one_ball_stay(runs: dict[str, StartUp]) -> None:
    np.testing.assert_allclose(with_mean_force(runs["4.3"]), [-75.6, -163.4], atol=0.5)
    first, second = (parted_claim(number, runs[number]) for number in ("4.3", "4.5"))
    assert (first.holds, second.holds) == (False, False)
    assert "start at different places" in first.verdict and "45 to 189 deg" in second.verdict


def test_what_remains_would_with_both_balls_there(runs: dict[str, StartUp]) -> None:
    claim = remains_claim([runs[number] for number in ("4.1", "4.3", "4.5")])
    assert claim.holds is False and claim.ours.startswith("1.23, 0.89, 0.89 of")
    assert "1.04 if both were" in claim.ours


def test_like_forces_bring_both_balls_there(runs: dict[str, StartUp]) -> None:
    split, other, hold = runs["4.9"], runs["4.11"], runs["4.7"]
    assert joined_claim(split).holds and alike_claim(other, hold).holds
    assert "from 90 to 15 deg apart" in joined_claim(split).ours
    np.testing.assert_allclose(with_mean_force(split), [-151.4, -241.9], atol=0.5)
    # Not so where the forces are no larger, or the balls do not get there.
    assert alike_claim(other, other).holds is False and joined_claim(runs["4.3"]).holds is False
    half = sooner_claim(runs["4.15"], hold)
    assert half.holds and "167 deg of 161, in 4.7 by 87 of 90" in half.ours
    assert sooner_claim(hold, hold).holds is False


def test_the_force_is_not_the_whirls_alone() -> None:
    made = Ratios()
    few = made.force("4.26", "4.24"), made.peak("4.26", "4.24")
    assert few == pytest.approx((0.262, 0.553), abs=0.002)
    assert force_by_whirl_claim("4.26", "x", *few).holds is False
    assert force_by_whirl_claim("4.36", "x", 1.305, 1.249).holds
    heavy, plain = made.runs["4.40"], made.runs["4.24"]
    assert farther_claim("4.40", "x", heavy, ("4.24", plain)).holds
    assert farther_claim("4.24", "x", plain, ("4.40", heavy)).holds is False


def test_the_force_decides_how_far_they_go_in_drives_with_other_parameters() -> None:
    made = Ratios()
    assert all(claim.holds for claim in force_claims(made))
    small, plain = made.runs["4.27"], made.runs["4.25"]
    assert farther_claim("4.27", "x", plain, ("4.27", small), more=False).holds is False
    assert by_force(small).mean() == pytest.approx(76.0, abs=1.0)
    assert moved(small).mean() == pytest.approx(85.0, abs=1.0)
    grown = made.peak("4.33", "4.25"), made.force("4.33", "4.25")
    assert grown == pytest.approx((1.87, 1.82), abs=0.01)


def test_the_best_hold_scales_with_the_spring_and_not_with_the_mass() -> None:
    times = {
        figure: [run.settling for run in scaled_holds(CASES[figure][0])]
        for figure in ("4.27", "4.28", "4.30", "4.31")
    }
    assert times["4.27"] == [None] * 4
    expected = {
        "4.28": [2.430, 1.423, 0.871, 0.907],
        "4.30": [0.798, 0.913, 1.024, 1.128],
        "4.31": [0.967, 1.088, 1.214, 1.344],
    }
    for figure, each in expected.items():
        assert times[figure] == pytest.approx(each, abs=0.002)
    verdicts = [optimum_claim(figure, "x", CASES[figure][0]).holds for figure in times]
    assert verdicts == [False, False, True, True]
    # The reference itself is as in figure 4.23.
    assert optimum_claim("4.23", "x", THESIS).holds
    assert turns(scaled_holds(CASES["4.28"][0])[0]) == pytest.approx(-158.6, abs=0.5)


def test_vibration_is_suppressed_by_balls_that_match_alone() -> None:
    # Of a mass on a spring: 4/3 at twice the critical speed.
    assert whirl_without_balls(200.0) == pytest.approx(4 / 3, rel=1e-3)
    assert suppressed_claim(1.367, 0.058).holds is False and suppressed_claim(0.058, 0.058).holds


def test_what_has_settled() -> None:
    swept = over_drag(False), over_drag(True), over_eccentricity(False), over_eccentricity(True)
    still = [[int((~each).sum()) for each in one.settled.values()] for one in swept]
    assert still == [[0, 1, 13, 27], [0, 3, 19, 32], [0, 0, 0, 0], [0, 0, 4, 16]]
    # All have where c_b is larger, without the hold and with it.
    assert all(each[DRAGS > 0.8].all() for each in swept[0].settled.values())
    assert all(each[DRAGS > 1.02].all() for each in swept[1].settled.values())
    unit = "c_b", 1.0, "N s/m"
    assert settled_claim("5.11", swept[1], unit).ours.endswith("2 g: 0.2 to 0.833, 1 to 1.01")
    everywhere = Swept(ECCENTRICITIES, dict.fromkeys(MASSES, np.ones(len(ECCENTRICITIES), bool)))
    assert "still" not in settled_claim("5.6", everywhere, unit).ours


def test_odd_multiples_beyond_the_first() -> None:
    drag = chapter_5.over_drag(quiet)
    found = {
        (target, held): max(
            high / low if low else 0.0
            for low, high in (stretch_near(target, m, drag, held) for m in MASSES)
        )
        for target in (-540.0, -900.0)
        for held in (0, 1)
    }
    assert list(found.values()) == pytest.approx([1.231, 1.153, 1.06, 1.028], abs=0.004)
    assert stretch_near(-540.0, 0.5e-3, drag, 0) == (0.0, 0.0)


def test_the_hold_moves_balls_farther_as_a_trend() -> None:
    drag = chapter_5.over_drag(quiet)
    claim = trend_claim(drag)
    assert claim.holds and claim.ours.startswith("farther at 275 of 308")
    assert trend_claim({m: (held, without) for m, (without, held) in drag.items()}).holds is False


def test_where_the_balls_of_figure_5_10_are() -> None:
    claims = place_claims()
    assert [claim.holds for claim in claims] == [True, False]
    (run,) = start_ups([(THESIS._replace(m=1.5e-3), HOLD)])
    assert run.residual == pytest.approx(4.0, abs=0.02)
    assert f"{run.residual:.2f} of the disc's" in claims[1].ours and "1 g 1.14" in claims[1].ours
