"""The deck in space against Lagrange's equations on ground axes: each effect, and all of them."""

from typing import NamedTuple

import numpy as np
import pytest

from ab_sim.drive import Drive
from tests.deck.coordinates import coordinates
from tests.deck.scenes import ODD, Changes, odd
from tests.overlap import assert_apart
from tests.reference import simulate_deck
from tests.reference.of_scene import deck_of

GRAVITY: Changes = {"gravity": {"tilt": 0.6, "direction": 0.7, "acceleration": 9.80665}}
HARDENING: Changes = {"hardening_suspension": {"cubic_stiffness": 1e9}}
OFFSET = {"offset_1": 1e-4, "offset_2": -5e-5}
OVAL: Changes = {"race_runout": {**OFFSET, "lobe": 2e-4, "lobe_angle": 0.7}}
RUBBING: Changes = {"rolling_friction": {"arm": 4e-5}, "race_friction": {"coefficient": 0.1}}
SMOOTH = {**GRAVITY, **HARDENING, **OVAL}
RAMP = {"profile": {"kind": "start_up", "acceleration": 400.0, "target_speed": 130.0}}
SLOW = {"start": {"speed": 40.0}}
CLOSE = {"start": {"speed": 40.0, "ball_angles": [0.5, 0.64]}}
PUSHED = {"profile": {"kind": "start_up", "acceleration": 100.0, "target_speed": 45.0}}
STOPS = frozenset({"stick", "release", "reverse"})
LIFTS = frozenset({"load", "unload"})


class Case(NamedTuple):
    """A scene; which events the reference has to meet there, and how many in all."""

    company: str
    effects: Changes = {}
    others: Changes = {}
    kinds: frozenset[str] = frozenset()
    events: int = 0


CASES = {
    "two races, couple unbalance": Case("plain"),
    "all that is smooth": Case("smooth", SMOOTH, RAMP),
    "friction and gravity": Case(
        "rubbing", {"race_friction": {"coefficient": 0.2}, **GRAVITY}, SLOW, STOPS, 8
    ),
    "friction, and all that is smooth": Case(
        "rubbing", {**RUBBING, **SMOOTH}, SLOW, STOPS | LIFTS, 15
    ),
    "contact": Case("touching", {}, CLOSE, frozenset({"impact"}), 1),
    "contact, and all but a motor": Case(
        "touching", {**RUBBING, **SMOOTH}, {**CLOSE, **PUSHED}, STOPS | LIFTS | {"impact"}, 20
    ),
    "motor": Case("all", {}, {"start": {"ball_angles": [0.5, 2.6]}}, frozenset({"motor"}), 2),
    "everything": Case(
        "all",
        {**RUBBING, **SMOOTH, "motor": {"torque_limit": 3e-3}},
        {**CLOSE, **PUSHED},
        STOPS | LIFTS | {"impact", "motor"},
        30,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_same_motion_as_the_reference(name: str) -> None:
    """To what the reference is good for, and steps on hardening mounts."""
    case, time = CASES[name], 0.06
    scene = odd(case.company, {"effects": case.effects, "solver": {"step": 2.5e-4}}, case.others)
    start, times = scene.start, np.linspace(0.0, time, 7)[1:]
    # Events may come and go within the long steps that the reference could take.
    longest = 2e-3 if case.kinds else np.inf
    want = simulate_deck(
        deck_of(scene),
        [*start.deck.position, *start.deck.tilt, *start.ball_angles],
        [*start.deck.velocity, *start.deck.tilt_rate, *start.ball_rates],
        times,
        rtol=1e-11,
        max_step=longest,
    )
    kinds = {event.kind for event in want.events}
    assert case.kinds <= kinds and len(want.events) >= case.events, want.events
    assert np.ptp(want.deck, axis=0).min() > 1e-5, "all coordinates move"
    drive = Drive(scene, energy_balance=True)
    got = drive.advance(round(time / drive.step))
    assert drive.steps_with_unresolved_events == 0
    assert_apart(drive, got)
    at = np.rint(times / drive.step).astype(int) - 1
    places, rates = (part[at] for part in coordinates(got))
    assert np.abs(places[:, :3] - want.deck[:, :3]).max() < 5e-13
    assert np.abs(places[:, 3:] - np.hstack([want.deck[:, 3:], want.theta])).max() < 5e-11
    assert np.abs(rates[:, :3] - want.deck_rates[:, :3]).max() < 5e-10
    assert np.abs(rates[:, 3:] - np.hstack([want.deck_rates[:, 3:], want.theta_rate])).max() < 2e-8
    assert np.abs(got["angle"][at] - want.psi).max() < 1e-11
    assert np.abs(got["speed"][at] - want.w).max() < 5e-9
    energy, held = drive.energy(), want.energy()
    scale = 2e-10 * np.abs(held).max()
    assert abs(energy.stored - held[-1]) < scale
    assert abs(energy.motor_work - want.work[-1]) < scale
    assert abs(energy.dissipated - want.losses[-1].sum()) < scale


def test_the_scene_has_no_symmetry() -> None:
    """Else what is left out of an equation could vanish here."""
    rotor, deck, mounts = ODD["rotor"], ODD["deck"], ODD["mounts"]
    for inertia in (rotor["inertia"], deck["inertia"]):
        assert len(inertia) == 6 and 0.0 not in inertia and len(set(inertia)) == 6
    assert 0.0 not in deck["center"] and rotor["height"] != 0.0
    assert 0.0 not in ODD["race"]["height"] and len(set(ODD["race"]["height"])) == 2
    assert sum("turned" in mount for mount in mounts) == 2
