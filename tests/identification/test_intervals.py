"""Intervals of fits: from the curvature, along profiles, at bounds; and per-ball numbers."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ab_sim.identification.intervals import CURVATURE, HELD, PROFILE, intervals_of
from ab_sim.identification.parameters import fitted_parameters
from ab_sim.identification.problem import Problem
from ab_sim.identification.stages import minimise
from ab_sim.scene.load import changed_scene
from ab_sim.show.identification import QUANTILE
from tests.identification import drives

DECK = ["effects.suspension.stiffness", "effects.suspension.damping", "rotor.eccentricity"]


def quiet(*_: object) -> None:
    """Nobody watches."""


def problem(stiffness: float, bounds: dict[str, tuple[float, float]]) -> Problem:
    """A drive without balls of this stiffness, fitted by a scene with 1000 N/m."""
    measured = drives.measured(drives.scene({DECK[0]: stiffness}), balls=False)
    common = fitted_parameters(drives.scene(), DECK, bounds)
    noise = 0.01 * float(np.sqrt(np.mean(measured.signals**2)))
    return Problem(drives.scene(), common, [measured], [noise])


def test_half_an_interval_is_two_standard_deviations() -> None:
    own = problem(1000.0, {})
    free = [0, 1, 2]
    fit = minimise(own, own.start, free, 30, last=True)
    found = intervals_of(own, fit.values, free, quiet)
    assert 2.0 * fit.cost / 4000 == pytest.approx(1.0, abs=0.1)
    for each in found.estimates:
        assert each.how == CURVATURE and not each.at_bound
        assert each.high - each.low == pytest.approx(2 * 1.96 * each.deviation, rel=1e-3)
        assert abs(each.value - each.start) < 4.0 * each.deviation
    assert np.diag(found.correlation) == pytest.approx(np.ones(3))


def test_at_its_bound_a_value_has_the_interval_of_its_profile() -> None:
    """What fits best lies one standard deviation beyond the bound."""
    free, true = [0, 1, 2], 1003.0
    own = problem(true, {})
    best = minimise(own, own.start, free, 30, last=True).values
    deviation = intervals_of(own, best, free, quiet, profiles=False).estimates[0].deviation
    bound = float(best[0]) - deviation
    bounded = problem(true, {DECK[0]: (900.0, bound)})
    fit = minimise(bounded, bounded.start, free, 30, last=True)
    found = intervals_of(bounded, fit.values, free, quiet)
    stiffness = found.estimates[0]
    assert stiffness.at_bound and stiffness.how == PROFILE
    assert stiffness.high == bound and stiffness.value == pytest.approx(bound, abs=1e-6)
    # From the unbounded best value the rise to the lower end is 1 + 3.84 noise variances.
    assert stiffness.low == pytest.approx(best[0] - math.sqrt(1.0 + 3.84) * deviation, rel=1e-5)
    assert [each.name for each in found.profiles] == [DECK[0]]


def test_skew_start_angles_have_the_intervals_of_their_profiles() -> None:
    """Noise as large as the signals leaves what a start angle does far from straight."""
    drive = drives.scene()
    measured = drives.measured(drive)
    common = fitted_parameters(drive, ["balls.mass"], {})
    own = Problem(drive, common, [measured], [float(np.sqrt(np.mean(measured.signals**2)))])
    fit = minimise(own, np.array([5.5e-4, 0.7, -2.0]), [0, 1, 2], 30, last=True)
    found = intervals_of(own, fit.values, [0, 1, 2], quiet)
    angle = found.estimates[1]
    assert (
        angle.per_recording
        and angle.how == PROFILE
        and angle.name in [p.name for p in found.profiles]
    )
    assert angle.value - angle.low > 1.2 * (angle.high - angle.value)
    for end in (angle.low, angle.high):
        values = fit.values.copy()
        values[1] = end
        rise = 2.0 * (minimise(own, values, [0, 2], 30, last=True).cost - fit.cost)
        assert rise == pytest.approx(1.96**2, rel=0.05)
        assert rise == pytest.approx(QUANTILE, rel=0.05), "the page's line of 95 %"


def test_balls_that_start_together_leave_the_other_intervals() -> None:
    """Equal balls may be exchanged: next to each other, their distance has no curvature."""
    drive = drives.scene({"start.ball_angles": [0.7, 0.703]})
    measured = drives.measured(drive)
    common = fitted_parameters(drive, [DECK[0], "balls.mass"], {})
    own = Problem(drive, common, [measured], [0.01 * measured.rms])
    start, free = np.array([1000.0, 5.5e-4, 0.7015, 0.7015]), range(4)
    fit = minimise(own, start, free, 60, last=True)
    found = intervals_of(own, fit.values, free, quiet).estimates
    # With the start of one of the balls known.
    regular = intervals_of(own, fit.values, range(3), quiet, profiles=False).estimates
    for each, other in zip(found[:2], regular[:2], strict=True):
        assert each.low < other.value < each.high
        assert each.high - each.low == pytest.approx(other.high - other.low, rel=0.2), each.name


def test_a_gain_at_its_bound_has_the_interval_of_its_profile() -> None:
    own = problem(1000.0, {})
    (bare,) = own.recordings
    louder = replace(bare, signals=2.1 * bare.signals, free=("gain",))
    scaled = Problem(drives.scene(), own.common, [louder], own.noise)
    fit = minimise(scaled, scaled.start, [3], 30, last=True)
    gain = intervals_of(scaled, fit.values, [3], quiet).estimates[3]
    assert gain.at_bound and gain.how == PROFILE
    assert gain.high == 1.95 and 1.94 < gain.low < 1.95


def test_what_is_held_has_an_infinite_interval() -> None:
    own = problem(1000.0, {})
    found = intervals_of(own, own.start, [0, 1], quiet, profiles=False).estimates[2]
    assert found.how == HELD and (found.low, found.high) == (-math.inf, math.inf)


def test_a_ball_s_own_mass_is_a_parameter() -> None:
    scene = drives.scene({"balls.mass": [5e-4, 6e-4]})
    (parameter,) = fitted_parameters(scene, ["balls.mass.1"], {})
    assert parameter.start == 6e-4 and parameter.key == "balls.mass.1"
    assert changed_scene(scene, {parameter.key: 7e-4}, "test").balls.masses == (5e-4, 7e-4)


def test_no_interval_goes_below_what_the_scene_takes() -> None:
    """Under noise far above the signals a damping is known to be 0 at least, and no more."""
    own = problem(1000.0, {})
    loud = own.with_noise([30.0 * own.recordings[0].rms])
    found = intervals_of(loud, own.start, [0, 1, 2], quiet)
    damping = found.estimates[1]
    assert damping.low == 0.0 and damping.high == math.inf and not damping.bounded
    assert all(each.low >= 0.0 for each in found.estimates)
