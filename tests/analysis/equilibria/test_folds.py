"""Folds against a count of radii over speed."""

import numpy as np

from ab_sim.analysis.equilibria.patterns import folds_of, radii
from ab_sim.analysis.equilibria.resting import ClosedFormRotor


def test_between_folds_the_number_of_radii_does_not_change() -> None:
    """At 30 rotors with cubic springs, at 300 speeds; each fold changes it by two."""
    draw, seen = np.random.default_rng(1), 0
    speeds = np.geomspace(5.0, 3000.0, 300)
    for _ in range(30):
        c, k3 = 10.0 ** draw.uniform(-2.5, 0.5), 10.0 ** draw.uniform(5, 12)
        rotor, moment = (
            ClosedFormRotor(0.1, 1e-5, 1000.0, c, k3, (), ()),
            1e-5 * draw.uniform(-3, 3),
        )
        folds = folds_of(rotor, moment)
        counts = np.array([len(radii(rotor, moment, w)) for w in speeds])
        expected = (
            counts[0]
            + np.array(
                [sum(2 if f.kind == "appear" else -2 for f in folds if f.speed < w) for w in speeds]
            )
            - sum(2 if f.kind == "appear" else -2 for f in folds if f.speed < speeds[0])
        )
        np.testing.assert_array_equal(counts, expected)
        seen += len(folds)
        for fold in folds:
            # Two radii that differ by the root of the distance, on one side; none on the other.
            inside = 1e-9 if fold.kind == "appear" else -1e-9
            near = [W for W in radii(rotor, moment, fold.speed * (1.0 + inside))
                    if abs(W / fold.W - 1.0) < 3e-2]  # fmt: skip
            gone = [W for W in radii(rotor, moment, fold.speed * (1.0 - inside))
                    if abs(W / fold.W - 1.0) < 1e-6]  # fmt: skip
            assert len(near) >= 2
            assert not gone
    assert seen > 20


def test_a_small_cubic_spring_moves_them_little() -> None:
    linear = ClosedFormRotor(0.1, 9.8e-6, 1000.0, 0.2, 0.0, (), ())
    for moment in (2e-5, -2e-5):
        (one,), (two,) = (folds_of(r, moment) for r in (linear, linear._replace(cubic_stiffness=1)))
        assert abs(two.speed / one.speed - 1.0) < 1e-7
        assert one.kind == two.kind


def test_none_where_balls_cannot_outdo_the_unbalance() -> None:
    rotor = ClosedFormRotor(0.1, 1e-5, 1000.0, 0.2, 0.0, (), ())
    assert folds_of(rotor, 0.99e-5) == folds_of(rotor, -0.99e-5) == []
