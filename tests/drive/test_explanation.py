"""What a description says for pictures to explain a run by."""

import json

import numpy as np
import pytest

from ab_sim.analysis.comparison import without_balls
from ab_sim.analysis.equilibria.patterns import radii
from ab_sim.analysis.equilibria.resting import base_rotor_of
from ab_sim.drive.closed_forms import RotorWithoutBalls
from ab_sim.drive.description import describe, explain
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.scene import load_scene, scene_names


@pytest.mark.parametrize("speed", [3.0, 99.9, 100.0, 251.0, -80.0])
def test_whirl_without_balls_is_that_of_the_resting_states(speed: float) -> None:
    """Of the same scene without its balls, by the roots of the equilibria's polynomial."""
    scene = load_scene("thesis-hold")
    alone = RotorWithoutBalls(**explain(scene)["without_balls"])
    rotor = base_rotor_of(system_of(without_balls(scene)))
    (expected,) = {round(radius, 15) for radius in radii(rotor, 0.0, speed)}
    assert float(alone.whirl(np.array(speed))) == pytest.approx(expected, rel=1e-9)


def test_whirl_without_balls_at_its_limits() -> None:
    free = RotorWithoutBalls(0.1, 1e-5, 0.0, 0.0)
    np.testing.assert_allclose(free.whirl(np.array([0.0, 1.0, 1e4])), [0.0, 1e-4, 1e-4])
    undamped = RotorWithoutBalls(0.1, 1e-5, 1000.0, 0.0)
    assert undamped.whirl(np.array([100.0]))[0] > 1e3 * 1e-4
    balanced = RotorWithoutBalls(0.1, 0.0, 1000.0, 0.0)
    assert balanced.whirl(np.array([0.0, 100.0])).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("name", scene_names())
def test_every_scene_is_explained_in_json(name: str) -> None:
    told = describe(load_scene(name))
    assert json.loads(json.dumps(told)) == told
    assert told["motion"] > 0 and len(told["moments"]) == told["balls"]


@pytest.mark.parametrize(
    ("name", "part", "why"),
    [
        ("feeding-deck", "without_balls", "the deck moves in space"),
        ("on-edge", "without_balls", "the scene has the effect gravity"),
        ("couple-unbalance", "balance", "the balls run in several planes"),
        ("everything", "balance", "the race has a runout"),
    ],
)
def test_what_has_no_closed_form_is_left_out_with_a_reason(name: str, part: str, why: str) -> None:
    assert explain(load_scene(name))[part] == {"left_out": why}


def test_the_period_of_variable_speed() -> None:
    hold = explain(load_scene("thesis-hold"))["variable_speed_period"]
    assert hold == {"start_speed": 100, "end_speed": 100, "acceleration": 0, "around": 40}
    half = explain(load_scene("thesis-half-acceleration"))["variable_speed_period"]
    assert half == {"start_speed": 100, "end_speed": 110, "acceleration": 20, "around": 40}
    assert explain(load_scene("thesis-baseline"))["variable_speed_period"] is None
