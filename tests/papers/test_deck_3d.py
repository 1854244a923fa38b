"""The deck-3d page: its deck, its verdicts, its borders; the whole page is written by hand."""

import math
from pathlib import Path

import numpy as np
import pytest
from gallery.deck_3d.case import PUBLISHED, DeckParameters, deck_of, least_radius
from gallery.deck_3d.maps import balanced_moduli
from gallery.deck_3d.responses import response, started
from gallery.deck_3d.verdicts import least_dampings, verdict_section

from ab_sim.analysis.floquet import STARTS, TurnMap
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.scene import load_scene


def test_the_paper_s_own_parameters_are_those_of_the_scene() -> None:
    ours, scene = system_of(deck_of(DeckParameters())), system_of(load_scene("feeding-deck"))
    for one, other in zip(ours.deck_model, scene.deck_model, strict=True):
        np.testing.assert_allclose(np.array(one), np.array(other), rtol=1e-14, atol=1e-20)
    for one, other in zip(ours.effects, scene.effects, strict=True):
        assert tuple(one) == pytest.approx(tuple(other), rel=1e-14)
    np.testing.assert_allclose(ours.balls[:, :6], scene.balls[:, :6], rtol=1e-14)


def test_the_spindle_is_moved_and_the_plate_stays() -> None:
    """With d the mounts keep their places about the plate's centre, and the disc its inertia."""
    near, far = deck_of(DeckParameters(d=0.01)), deck_of(DeckParameters(d=0.05))
    for scene in (near, far):
        assert scene.deck is not None
        places = [np.subtract(m.position, scene.deck.center) for m in scene.mounts]
        np.testing.assert_allclose(np.abs(places), [[0.06, 0.06, 0.0]] * 4, atol=1e-15)
    assert near.rotor.inertia == far.rotor.inertia
    assert deck_of(DeckParameters(R=0.06)).rotor.inertia == pytest.approx((2.7e-5, 2.7e-5, 5.4e-5))
    assert deck_of(DeckParameters(n=4)).balls.total_mass == pytest.approx(4e-4)


def test_every_published_verdict_frequency_and_angle_is_reached(tmp_path: Path) -> None:
    section = verdict_section(tmp_path, lambda *_: None)
    frequencies, verdicts = section.tables
    for published, ours in frequencies.rows:
        assert isinstance(published, float) and ours == pytest.approx(published, abs=0.45)
    assert [row[0] for row in verdicts.rows] == [*PUBLISHED]
    assert all(row[1] == row[2] for row in verdicts.rows)
    assert "+-142.2999 deg" in section.text[0]


def test_below_the_least_radius_nothing_balances() -> None:
    for factor, balances in ((0.99, False), (1.01, True)):
        turn = TurnMap(deck_of(DeckParameters(R=factor * least_radius())), 300.0)
        orbit = turn.shoot(STARTS["balanced"](turn))
        assert orbit is not None
        still = np.abs(orbit.start[:3]).max() < 1e-12
        assert still == balances


def test_a_row_of_a_map_is_on_the_right_side_of_1() -> None:
    found = balanced_moduli(deck_of(DeckParameters()), [*PUBLISHED])["largest"]
    assert [largest < 1.0 for largest in found] == [*PUBLISHED.values()]


def test_rotation_about_the_shaft_matters_below_some_damping() -> None:
    (least,) = least_dampings(deck_of(DeckParameters()), [335.0])["c"]
    assert least == pytest.approx(0.1086, abs=5e-4)


def test_time_responses_end_as_published() -> None:
    settled = response(started(335.0))
    assert settled.final < 1e-9
    ends = np.degrees(settled.angles[-1]) % 360.0
    np.testing.assert_allclose(np.sort(ends), [142.3, 217.7], atol=0.01)
    gathered = response(started(130.0))
    assert gathered.final > 1e-4
    assert abs(math.remainder(gathered.angles[-1] @ [1, -1], 2 * math.pi)) < 0.01
