"""Chapter 5's reasons: how far balls go for a force, and whether they rest at -180 deg."""

from gallery.thesis.drive import HOLD
from gallery.thesis.rotation_reasons import moved_claims, stable_claim


def test_drag_holds_balls_back_and_mass_makes_nothing_easy() -> None:
    for figure, period in (("5.5", None), ("5.11", HOLD)):
        drag, mass = moved_claims(figure, period)
        assert (drag.holds, mass.holds) == (True, False)
    assert "1.04 times as far" in mass.ours


def test_two_balls_of_1_g_opposite_to_the_unbalance_are_unstable() -> None:
    claim = stable_claim()
    assert claim.holds is False
    assert "grows by 0.54 1/s; stable is +-119.3 deg" in claim.ours
