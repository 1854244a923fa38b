"""What a deck in space keeps: its energy balance; free, its momentum and angular momentum."""

from typing import NamedTuple

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import Scene
from tests.conftest import merge
from tests.deck.coordinates import absolute
from tests.deck.scenes import ODD, Changes, odd
from tests.deck.test_against_reference import CLOSE, OVAL, PUSHED, RAMP, RUBBING, SLOW, SMOOTH
from tests.effects.parts import Run, closes, run
from tests.reference.deck_model import DeckModel
from tests.reference.of_scene import deck_of
from tests.reference.plant import Array

FINE: Changes = {"solver": {"step": 1.25e-4}}
UNDAMPED: Changes = {
    "mounts": [{**mount, "damping": 0.0} for mount in ODD["mounts"]],
    "effects": {"viscous_drag": {"coefficient": 0.0}},
}
FREE: Changes = {"mounts": []}


def watched(company: str, *changes: Changes) -> Run:
    """A tenth of a second."""
    return run(odd(company, FINE, *changes), 800)


@pytest.mark.parametrize(
    ("company", "changes", "events"),
    [
        ("plain", RAMP, 0),
        ("smooth", merge({"effects": SMOOTH}, RAMP), 0),
        ("rubbing", merge({"effects": {**SMOOTH, **RUBBING}}, SLOW), 15),
        ("touching", merge({"effects": {**SMOOTH, **RUBBING}, **PUSHED}, CLOSE), 15),
        ("all", merge({"effects": {**SMOOTH, **RUBBING}, **PUSHED}, CLOSE), 15),
    ],
)
def test_energy_balance(company: str, changes: Changes, events: int) -> None:
    """With all losses there are, and the motor's work, to 1e-11 of what goes to and fro."""
    seen = watched(company, changes)
    assert seen.drive.events >= events and seen.drive.steps_with_unresolved_events == 0
    last = seen.energies[-1]
    assert last.dissipated > 1e-3 and abs(last.motor_work) > 1e-4
    closes(seen, 1e-11)


def test_nothing_is_lost_without_losses() -> None:
    """Impacts of full restitution take nothing either."""
    elastic: Changes = {"effects": {**SMOOTH, "ball_contact": {"restitution_coefficient": 1.0}}}
    seen = watched("all", UNDAMPED, elastic, CLOSE, {"effects": {"motor": {"back_emf_slope": 0.0}}})
    assert seen.drive.events > 3
    moved = abs(seen.energies[-1].motor_work)
    assert moved > 1e-4
    assert abs(seen.energies[-1].dissipated) < 1e-12 * moved
    closes(seen)


class Kept(NamedTuple):
    """Of a run, a row for each sample."""

    momentum: Array
    turning: Array
    """Angular momentum about the centre of mass."""
    centre: Array
    """Of all mass, on the ground's axes."""


def kept_of(scene: Scene, samples: Trajectory) -> Kept:
    """From places and rates alone, by the reference's bodies."""
    model, found = DeckModel(deck_of(scene)), []
    for q, rates in zip(*absolute(samples), strict=True):
        bodies = model.poses(q, rates).bodies
        moment = np.einsum("bij,bj->i", bodies.value, model.inertias[:, :, 3])
        momentum, turning = model.momentum(q, rates)
        centre = moment[:3] / moment[3]
        found.append((momentum, turning - np.cross(centre, momentum), centre))
    return Kept(*(np.array(column) for column in zip(*found, strict=True)))


def test_a_free_deck_keeps_momentum_and_angular_momentum() -> None:
    """Motor, drag, friction and impacts act within it."""
    scene = odd("all", FINE, FREE, {"effects": {**OVAL, **RUBBING}}, CLOSE, RAMP)
    drive = Drive(scene, energy_balance=True)
    start, taken = drive.present(), drive.advance(800)
    assert drive.events > 3 and drive.steps_with_unresolved_events == 0
    assert np.abs(np.diff(taken.ball_rates, axis=0)).max() > 1.0, "balls hit each other"
    momentum, turning, _ = kept_of(scene, Trajectory.join([start, taken.decimated(40)]))
    assert np.ptp(taken["speed"]) > 5.0
    for axis in "xyz":
        assert np.ptp(taken["v" + axis]) > 1e-3 and np.ptp(taken["w" + axis]) > 0.1
    for vector in (momentum, turning):
        assert np.linalg.norm(vector - vector[0], axis=1).max() < 1e-12 * np.linalg.norm(vector[0])


def test_a_falling_deck_keeps_its_angular_momentum() -> None:
    """And its centre of mass goes along a parabola."""
    scene = odd(
        "smooth",
        FINE,
        FREE,
        {"effects": {**OVAL, "gravity": {"tilt": 0.6, "acceleration": 9.8}}},
        RAMP,
    )
    drive = Drive(scene, energy_balance=True)
    taken = drive.advance(800)
    samples = Trajectory.join([Drive(scene, energy_balance=True).present(), taken.decimated(40)])
    momentum, turning, centre = kept_of(scene, samples)
    time, mass = samples["time"][:, None], scene.total_mass
    down = 9.8 * np.array([0.0, -np.sin(0.6), -np.cos(0.6)])
    assert np.linalg.norm(mass * down) * 0.1 > 0.05 * np.linalg.norm(momentum[0])
    np.testing.assert_allclose(momentum, momentum[0] + mass * down * time, rtol=0.0, atol=1e-14)
    fallen = centre[0] + momentum[0] / mass * time + 0.5 * down * time**2
    np.testing.assert_allclose(centre, fallen, rtol=0.0, atol=1e-14)
    scale = np.linalg.norm(turning[0])
    assert np.linalg.norm(turning - turning[0], axis=1).max() < 1e-12 * scale
    energy = drive.energy()
    balance = energy.stored - energy.at_start - energy.motor_work + energy.dissipated
    assert abs(balance) < 1e-10 * abs(energy.motor_work)
