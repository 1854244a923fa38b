"""Runs of a deck in space are judged from where it hangs, tilt and couple included."""

import math

import numpy as np
import pytest

from ab_sim.analysis import Compared, compare_run, run_scene, without_balls
from ab_sim.analysis.rest import from_rest, rest_of
from ab_sim.drive import Drive
from ab_sim.scene import Scene, load_scene

GRAVITY = 9.80665
"""m/s^2, the effect's default."""
ON_EDGE = [f"effects.gravity={{tilt: {math.pi / 2}}}"]
LIFTED = ["rotor.height=0.004", "race.height=[0.006, -0.003]", "balls.race=[0, 1]"]


def deck(*changes: str) -> Scene:
    return load_scene("feeding-deck", changes)


def test_a_deck_on_edge_hangs_by_its_weight_over_its_springs() -> None:
    """Along -y, between its mounts; masses level with them do not tilt it."""
    scene = deck(*ON_EDGE, "deck.center=[0, 0.0, 0]", "mounts=" + str(SQUARE))
    rest = rest_of(scene)
    stiffness = 4 * 1000.0
    sag = scene.total_mass * GRAVITY / stiffness
    np.testing.assert_allclose(rest.place, [0.0, -sag, 0.0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(rest.tilt, 0.0, atol=1e-12)


SQUARE = [
    {"position": [x, y, 0.0], "stiffness": 1000.0, "damping": 0.6}
    for x in (-0.06, 0.06)
    for y in (-0.06, 0.06)
]


def test_what_hangs_still_neither_whirls_nor_tilts() -> None:
    """Though it has sagged, and lifted masses have tilted it."""
    scene = deck(*ON_EDGE, *LIFTED, "start.speed=0", "rotor.eccentricity=0", "duration=0.2")
    run, share = Drive(scene).advance(200), scene.balls.total_mass / scene.total_mass
    # The balls are free to fall along the race: for a moment the deck misses some of their weight,
    # and springs up by at most twice that part of its sag.
    assert from_rest(run, scene).whirl.max() < 2 * share * run.whirl.max()
    level = rest_of(deck()).tilt_from(run)
    assert rest_of(scene).tilt_from(run).max() < 0.01 * level.max()
    assert level.max() == pytest.approx(abs(rest_of(scene).tilt[0]), rel=0.01)


def test_without_gravity_a_run_counts_from_the_relaxed_mounts() -> None:
    scene = deck()
    run = Drive(scene).advance(5)
    assert from_rest(run, scene) is run


def test_tilt_is_the_angle_of_the_shaft() -> None:
    """Turned by gamma about the shaft itself it does not tilt; by alpha it does."""
    spun = deck("start.deck.tilt=[0, 0, 0.2]")
    leant = deck("start.deck.tilt=[0.01, 0, 0.2]")
    assert rest_of(spun).tilt_from(Drive(spun).present()) == pytest.approx([0.0], abs=1e-15)
    assert rest_of(leant).tilt_from(Drive(leant).present()) == pytest.approx([0.01], rel=1e-12)


def test_metrics_of_a_deck() -> None:
    """Two balls that balance the force, each in a race of its own, leave part of the couple."""
    level = run_scene(deck("duration=2"))
    assert level.metrics.peak_tilt == level.metrics.final_tilt == 0.0, "all at one height"
    assert level.metrics.residual_couple is None and level.metrics.residual_unbalance < 1e-3
    run = run_scene(deck(*LIFTED, "duration=1"))
    metrics, scene = run.metrics, run.scene
    assert metrics.peak_tilt is not None and metrics.final_tilt is not None
    assert 0 < metrics.final_tilt < metrics.peak_tilt < 0.01
    unbalance = 0.03 * 3.16489e-4
    heights = np.array([0.006, -0.003])
    last = run.trajectory.ball_angles[-100:]
    couple = unbalance * 0.004 + 2e-4 * 0.03 * np.exp(1j * last) @ heights
    expected = math.sqrt(np.mean(np.abs(couple) ** 2)) / (unbalance * 0.004)
    assert metrics.residual_couple == pytest.approx(expected, rel=1e-12)
    report = metrics.report(scene.rotor.eccentricity)
    assert report["residual_couple"] == metrics.residual_couple
    assert report["final_tilt"] == metrics.final_tilt


def test_couple_unbalance_counts_as_a_product_of_inertia() -> None:
    """xz is minus the integral of x z dm."""
    scene = deck("rotor.inertia=[9.0e-6, 9.0e-6, 1.35e-5, 0, -1.0e-7, 2.0e-8]", *LIFTED)
    expected = 0.03 * 3.16489e-4 * 0.004 + 1e-7 - 2e-8j
    assert scene.couple_unbalance == pytest.approx(expected, rel=1e-12)
    assert load_scene("thesis-hold").couple_unbalance == 0


def test_without_balls_disc_and_rotor_stay_as_they_are() -> None:
    scene = deck(*LIFTED, "start.ball_rates=[1, -1]", "duration=0.1")
    alone = without_balls(scene)
    assert alone.balls.count == 0
    assert alone.total_mass == pytest.approx(scene.total_mass - 4e-4, rel=1e-12)
    assert alone.rotor.inertia == scene.rotor.inertia and alone.rotor.height == 0.004
    beside = compare_run(run_scene(scene)).without_balls
    assert isinstance(beside, Compared) and beside.metrics.final_tilt is not None


def test_samples_have_all_of_the_motion() -> None:
    scene = deck(*LIFTED, "duration=0.1")
    (sample,) = run_scene(scene, [0.1]).report()["samples"]
    last = Drive(scene).advance(100)
    for key in ("x", "y", "z", "vx", "vy", "vz"):
        assert sample[key] == last[key][-1], key
    assert sample["tilt"] == last.tilt[-1].tolist()
    assert sample["angular_velocity"] == last.angular_velocity[-1].tolist()
