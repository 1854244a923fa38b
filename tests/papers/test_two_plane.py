"""The two-plane page: Rodrigues et al. (2008, 2010), printed values beside ours."""

import math

import numpy as np
import pytest
from gallery.two_plane.against_printed import difference
from gallery.two_plane.borders import (
    CHARTS,
    borders_at_3,
    least_ball_mass,
    linear_borders_at_3,
    lowest_stable,
    second_border,
)
from gallery.two_plane.frequencies import CASES, critical_speeds
from gallery.two_plane.long_rotor import (
    DYNAMIC,
    MEASURED_AT,
    OPPOSITE,
    bearings,
    long_rotor,
    long_scene,
)
from gallery.two_plane.printed import printed_turn
from gallery.two_plane.rig import BEARINGS_AT, RPM, TABLE_2, rig
from gallery.two_plane.rig_balls import FIGURE_14
from gallery.two_plane.rig_frequencies import (
    MEASURED,
    SIMULATED,
    rig_critical_speeds,
    washer_plane,
)
from gallery.two_plane.rig_identified import identified, misfits
from gallery.two_plane.rig_levels import balanced, plain, together
from gallery.two_plane.rig_plain import PRINTED
from gallery.two_plane.rotor import balanced_alphas, vibration
from gallery.two_plane.runs import RUNS, lags, moved_runs

from ab_sim.analysis import run_scene
from ab_sim.analysis.floquet import solutions_of
from ab_sim.model.dynamics.assemble import linearised, system_of


def test_the_mounts_have_the_printed_stiffness_and_inertia() -> None:
    """K = (1, 3, 3, 45), ENOC (6), and J_t, J_p, M in the linear equations."""
    p = long_rotor(bearings=bearings((9.0, -3.0)))
    about = linearised(system_of(long_scene(p, 1.0, 1.0, ())))
    across = [0, 4]  # X and the tilt about y
    np.testing.assert_allclose(about.stiffness[np.ix_(across, across)], [[1, 3], [3, 45]])
    np.testing.assert_allclose(about.mass[np.ix_(across, across)], [[1, 0], [0, 3.25]], atol=2e-4)
    assert about.gyroscopic[3, 4] == pytest.approx(0.5, abs=2e-4)


def test_printed_critical_speeds() -> None:
    for _, bearing, printed in CASES[:2]:
        found = critical_speeds(long_rotor(bearings=bearing), 10.0)
        assert found == pytest.approx(printed, abs=0.006)
    # Of bearings of unequal stiffness (7) prints what circular whirl would have.
    found = critical_speeds(long_rotor(bearings=CASES[2][1]), 10.0)
    squares = np.roots([3.25**2 - 0.5**2, -3.25 * (9 + 45), 9 * 45])
    assert found == pytest.approx(np.sort([1.0, math.sqrt(5.0), *np.sqrt(squares)]), rel=1e-4)


def test_the_papers_equations_are_the_limit_of_small_unbalance() -> None:
    """What they leave out is the moment of the balls' lever."""
    large, small = (difference(scale, OPPOSITE) for scale in (0.1, 0.01))
    assert small < 1e-3
    assert large / small == pytest.approx(10.0, rel=0.15)


def test_least_ball_masses() -> None:
    for chart in CHARTS:
        assert least_ball_mass(chart.unbalance) == pytest.approx(chart.least_mass, abs=6e-6)


def test_printed_borders() -> None:
    """Read from the figures' curves; the heaviest balls are left to the page."""
    static, dynamic = CHARTS
    assert borders_at_3(static) == pytest.approx(static.at_3, abs=1e-5)
    mass, speed = dynamic.above[1]
    assert lowest_stable(dynamic, mass) == pytest.approx(speed, abs=2e-3)


def test_borders_of_the_papers_later_equations() -> None:
    """Those of light balls are ours; heavier ones' levers count."""
    static = CHARTS[0]
    later = linear_borders_at_3(static)
    assert later[:2] == pytest.approx(static.at_3[:2], abs=1e-5)
    assert later[2] > static.at_3[2] + 5e-5


def test_the_printed_border_of_the_heaviest_balls_is_that_of_a_second_pair() -> None:
    dynamic = CHARTS[1]
    mass, printed = dynamic.above[-1]
    assert second_border(dynamic, mass, (printed - 0.1, printed + 0.1)) == pytest.approx(
        printed, abs=2e-3
    )


def test_balls_in_two_planes_stop_the_rotor_above_both_critical_speeds() -> None:
    """Static and couple unbalance at once; the last of the printed runs that balance."""
    each = RUNS[4]
    run = run_scene(long_scene(each.rotor, each.speed, 700.0, each.starts)).trajectory
    bare = run_scene(long_scene(each.rotor, each.speed, 700.0, ())).trajectory
    end = run["time"] > 650.0
    levels = [float(vibration(one, MEASURED_AT)[end].mean()) for one in (run, bare)]
    assert levels[1] == pytest.approx(0.0084, abs=1e-4)
    assert levels[0] < 0.05 * levels[1]
    (found,) = solutions_of(long_scene(each.rotor, each.speed, 1.0), each.speed, "balanced")
    assert found.stable and found.balanced and found.structural == 0
    place = np.exp(1j * (found.angles + each.rotor.phase))
    want = np.exp(1j * balanced_alphas(each.rotor))
    apart = np.abs(place[:, None] - want)
    assert apart[:2, :2].min(axis=1).max() < 1e-6 and apart[2:, 2:].min(axis=1).max() < 1e-6


def test_one_plane_with_the_same_balls_does_not() -> None:
    p = long_rotor(**DYNAMIC, ball_mass=0.005, planes=(0.0,) * 4)
    (found,) = solutions_of(long_scene(p, 3.5, 1.0), 3.5, "balanced")
    assert not found.balanced
    assert found.whirl[1] < 1e-2 * p.eccentricity, "it stops C, and the rotor tilts"


def test_balls_that_do_not_balance_lag_by_half_the_speed() -> None:
    each = RUNS[5]
    run = run_scene(long_scene(each.rotor, each.speed, each.duration, each.starts)).trajectory
    lagging = lags(each, run)
    left = lagging[np.abs(lagging) > 0.2]
    assert 1 <= len(left) < 4
    np.testing.assert_allclose(left, -0.5, atol=0.03)
    assert moved_runs(each._replace(starts=OPPOSITE), 2)[0][0] == 0


def test_the_rig_has_its_printed_peaks_with_twice_the_printed_stiffness() -> None:
    doubled = rig_critical_speeds(2.0)
    np.testing.assert_allclose(doubled, SIMULATED, rtol=2.1e-3)
    np.testing.assert_allclose(doubled, MEASURED, rtol=0.031)
    np.testing.assert_allclose(rig_critical_speeds(1.0), np.array(doubled) / 2**0.5, rtol=2e-3)


def test_table_2_says_where_the_washers_are() -> None:
    own, plane = washer_plane()
    assert plane == pytest.approx(-0.030, abs=3e-4)
    assert abs(own) == pytest.approx(6.1e-5, abs=0.05e-5)


def test_the_rig_s_level_without_balls() -> None:
    for rpm, printed in PRINTED.items():
        assert 1e3 * plain(TABLE_2[3], rpm).of_mean == pytest.approx(printed, rel=0.012)
    between = plain(TABLE_2[3], 2000.0)
    assert between.of_maxima > 1.2 * between.of_mean, "(3) is another measure"


def test_the_rig_s_level_with_balls() -> None:
    for held in FIGURE_14:
        found = (together if held.together else balanced)(TABLE_2[2], held.rpm)
        assert found is not None and found.stable
        assert 1e3 * found.of_mean == pytest.approx(held.level, rel=0.026)


def test_figure_14_has_another_unbalance_than_table_2() -> None:
    """Fitted to the curve without balls it gives the balls' angles."""
    fitted = identified()
    assert np.abs(misfits(TABLE_2[2])).max() > 0.1
    assert np.abs(misfits(fitted)).max() < 0.012
    for held in FIGURE_14[1:]:
        found = (together if held.together else balanced)(fitted, held.rpm)
        assert found is not None
        np.testing.assert_allclose(np.degrees(found.angles), held.angles, atol=0.35)


def test_a_turn_of_the_papers_equations_is_ours() -> None:
    """Without balls they are linear, and the rig's whirl is small."""
    turns = [printed_turn(rig(TABLE_2[3]), 2000.0 * RPM, at) for at in BEARINGS_AT]
    ours = plain(TABLE_2[3], 2000.0)
    assert np.mean([np.abs(one).max() for one in turns]) == pytest.approx(ours.of_maxima, rel=2e-3)
