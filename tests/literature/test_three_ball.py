"""The three-ball paper's thresholds and claims, with the parameters that it leaves out."""

import math

import numpy as np
import pytest
from gallery.three_ball.drive import ECCENTRICITY, MU, MU_OVER_DELTA, drive
from gallery.three_ball.growth import BEST, SETS, WORST, threshold
from gallery.three_ball.responses import TOTAL, ZETA, ZETA_B, point_b
from gallery.three_ball.settled import STARTS, at_rest_on_rotor, runs, settled

from ab_sim.analysis.equilibria import equilibria_of


def test_the_scene_has_the_papers_numbers() -> None:
    scene = drive(0.4, 3, 0.02, 0.1)
    d, e, m = scene.race.radius, scene.rotor.eccentricity, scene.balls.masses[0]
    assert m * d / (scene.eccentric_mass * e) == pytest.approx(0.4, rel=1e-14)
    assert scene.eccentric_mass / scene.total_mass / (d / e) == pytest.approx(MU_OVER_DELTA)
    assert scene.critical_speed == 1.0 and e == ECCENTRICITY
    assert scene.effects["suspension"].damping / 2.0 == 0.02
    assert scene.effects["viscous_drag"].coefficient / (2.0 * m) == pytest.approx(0.1)
    assert scene.eccentric_mass == MU


def test_threshold_of_figure_2() -> None:
    """Ours by an independent computation, EQUATIONS.md 2. Figure 5: test_rest_oracle.py."""
    zeta, zeta_b, published, _ = SETS[0]
    found = threshold(drive(0.4, 3, zeta, zeta_b))
    assert found == pytest.approx(1.515, abs=3e-4)
    assert found == pytest.approx(published, abs=6e-3)


def test_radii_are_the_papers_closed_forms() -> None:
    """(14)-(24) in dimensionless numbers; negative radii are the other pattern's."""
    eta, zeta, mu = 0.4, 0.05, MU
    for w in (0.4, 0.9, 1.2, 2.5):
        states = equilibria_of(drive(eta, 3, zeta), w).branches
        ours = sorted(s.W / ECCENTRICITY for s in states if s.W > 0.0)
        square = 1.0 - w * w
        factor = mu * w * w / (square**2 + 4.0 * zeta**2 * w * w)
        theirs = []
        for each in (3.0 * eta, eta):
            under = square**2 + 4.0 * (1.0 - each**2) * zeta**2 * w * w
            theirs += [factor * (each * square + sign * math.sqrt(under)) for sign in (1, -1)]
        assert ours == pytest.approx(sorted(map(abs, theirs)), rel=1e-12)


def test_both_starts_of_figure_6_end_balanced_at_different_places() -> None:
    scene = drive(0.4, 3, 0.05, 0.1)
    ends = [settled(run, scene) for run in runs(scene, [at_rest_on_rotor(s, 2.0) for s in STARTS])]
    angles = []
    for end in ends:
        assert end is not None and end[0] < 1e-6
        turned = np.exp(1j * np.array(end[1]))
        assert abs(1.0 + 0.4 * turned.sum()) < 1e-6
        angles.append(np.sort(np.angle(turned) % (2.0 * math.pi)))
    assert np.abs(angles[0] - angles[1]).max() > 0.2


def test_three_balls_hold_the_balance_at_point_b_and_two_do_not() -> None:
    speed = point_b()
    for balls, stable in ((3, True), (2, False)):
        states = equilibria_of(drive(TOTAL / balls, balls, ZETA, ZETA_B), speed).branches
        balanced = [state.stable for state in states if state.label.startswith("balanced")]
        assert balanced and {*balanced} == {stable}


def test_where_the_advantage_of_three_balls_vanishes() -> None:
    """At little damping two balls of the same total are stable from a lower speed."""
    two, best = threshold(drive(0.6, 2, 0.02)), threshold(drive(0.4, 3, 0.02), BEST)
    assert two < best
    two, worst = threshold(drive(0.6, 2, 0.3)), threshold(drive(0.4, 3, 0.3), WORST)
    assert worst < two
    two, worst = threshold(drive(1.2, 2, 0.3)), threshold(drive(0.8, 3, 0.3), WORST)
    assert two < worst
