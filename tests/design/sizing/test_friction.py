"""Friction in a sizing: where balls stick is stated, and more time is not what helps then."""

import math

import numpy as np
import pytest

import ab_sim
from ab_sim.design.sizing.claims import scene_of
from ab_sim.design.sizing.closed_forms import balls_of, drive_of_balls, stuck
from ab_sim.design.sizing.size import sizing_failure
from ab_sim.drive import Drive
from ab_sim.scene.load import changed_scene
from tests.design.sizing.wanted import DRIVE, wanted


@pytest.mark.parametrize(("factor", "stays"), [(0.9, True), (1.15, False)])
def test_balls_stick_up_to_the_whirl_that_is_stated(factor: float, stays: bool) -> None:
    """Four balls that balance each other, a disc with so much of the unbalance that they hold."""
    asked = wanted(friction_arm="0.3 um")
    balls, speed = balls_of(4, 6e-5, asked), asked.speed
    whirl, left = stuck(balls, asked)
    assert whirl == pytest.approx(balls.path_radius * 3e-7 / balls.radius)
    drive = drive_of_balls(balls, asked, 0.0)
    unbalance = factor * left
    resistance = complex(drive.stiffness - drive.mass * speed**2, drive.damping * speed)
    z = unbalance * speed**2 / resistance
    assert abs(z) == pytest.approx(factor * whirl)
    changes = {
        "rotor.eccentricity": unbalance / asked.mass,
        "profile": None,
        "start.speed": speed,
        # Two of them lie across the whirl's direction.
        "start.ball_angles": [float(np.angle(z) + k * math.pi / 2) for k in range(4)],
        "start.deck.position": [z.real, z.imag],
        "start.deck.velocity": [-speed * z.imag, speed * z.real],
        "duration": 1.0,
    }
    scene = changed_scene(scene_of(balls, asked, 1e-3), changes, "test")
    angles = Drive(scene).advance(round(0.5 / scene.solver.step)).ball_angles
    assert bool((np.ptp(angles, axis=0) < 1e-3).all()) == stays


def test_what_friction_leaves_is_stated_and_not_more_time() -> None:
    found = ab_sim.size(**DRIVE, friction_arm="2 um", balls=[5], runs=40)
    assert not found.found
    said = sizing_failure(found)
    assert "W = R arm / a" in said and "lower the friction" in said
    assert "allow more time" not in said
    assert "(5 balls: " in said.partition("however long drives settle ")[2], (
        "of the numbers that were tried"
    )
    ((count, runs),) = found.tried
    assert (count, runs.share.runs) == (5, 20), "as few runs as tell"
