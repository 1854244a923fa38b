"""Balls that are all equal, and balls that each have a mass and a radius of their own."""

import json
import math
from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.drive.overlap import overlaps_at_start
from ab_sim.scene import check_scene, load_scene


def test_one_number_is_for_all_balls(scene: Any) -> None:
    balls = scene(balls={"count": 3}).balls
    assert balls.masses == (1e-3,) * 3
    assert balls.radii == (1e-3,) * 3


def test_a_list_gives_each_ball_its_own() -> None:
    scene = load_scene("thesis-hold", ["balls.mass=[0.001, 2e-3]", "balls.radius=[1.0e-3, 0.002]"])
    assert scene.balls.masses == (0.001, 0.002)
    assert scene.balls.radii == (0.001, 0.002)
    assert scene.balls.total_mass == 0.003
    assert scene.eccentric_mass == pytest.approx(0.097)
    without_balls = load_scene("nsc-case-1", ["balls.mass=[0.001, 0.002]"])
    assert without_balls.total_mass == pytest.approx(0.216 + 0.003)


def test_lists_survive_a_round_trip_as_json(scene: Any) -> None:
    one = scene(balls={"mass": [0.001, 0.002], "radius": [1e-3, 2e-3]}, start={"angle": 0.3})
    mapping = json.loads(json.dumps(one.as_mapping()))
    assert mapping["balls"]["mass"] == [0.001, 0.002]
    assert check_scene(mapping, "again") == one


def test_radii_that_are_not_given_are_not_a_number() -> None:
    radii = load_scene("nsc-case-1").balls.radii
    assert len(radii) == 2 and all(math.isnan(radius) for radius in radii)


@pytest.mark.parametrize("mass", [1e-4, 6.6e-5, 0.00027272727272727274])
@pytest.mark.parametrize("count", [1, 3, 5, 7, 64])
def test_equal_balls_weigh_what_they_weighed_to_the_last_bit(
    scene: Any, count: int, mass: float
) -> None:
    balls = scene(balls={"count": count, "mass": mass}).balls
    assert balls.total_mass == count * mass
    assert scene(balls={"count": count, "mass": [mass] * count}).balls.total_mass == count * mass


def test_no_balls(scene: Any) -> None:
    balls = scene(balls={"count": 0, "mass": None, "radius": None}).balls
    assert (balls.masses, balls.radii, balls.total_mass) == ((), (), 0.0)
    balls = scene(balls={"count": 0, "mass": [], "radius": []}).balls
    assert (balls.masses, balls.radii) == ((), ())


def test_as_many_as_there_may_be(scene: Any) -> None:
    masses = [1e-4 + 1e-6 * ball for ball in range(64)]
    assert scene(balls={"count": 64, "mass": masses}).balls.masses == tuple(masses)
    with pytest.raises(SceneError, match="at most 64"):
        scene(balls={"count": 65, "mass": [1e-4] * 65})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            "balls.mass=[1e-3, 1e-3, 1e-3]",
            "balls.mass: has 3 masses for 2 balls",
        ),
        ("balls.mass=[]", "balls.mass: has 0 masses for 2 balls"),
        ("balls.radius=[1e-3]", "balls.radius: has 1 radii for 2 balls"),
        ("balls.mass=[0.001, -1]", "balls.mass.1 = -1: must be at least 1e-12; m, mass of a ball"),
        ("balls.mass=[0.001, 1001]", "balls.mass.1 = 1001: must be at most 1000"),
        (
            "balls.mass=[0.001, heavy]",
            "balls.mass.1 = 'heavy': must be a number, in kg or with a unit, e.g. 1 g",
        ),
        ("balls.mass=[.nan, 0.001]", "balls.mass.0 = nan: "),
        ("balls.mass=[0.001, yes]", "balls.mass.1 = True: "),
        ("balls.mass=[0.001, null]", "balls.mass.1 = None: must be a number"),
        ("balls.mass=[[0.001], 0.001]", "balls.mass.0 = [0.001]: must be a number"),
        ("balls.mass={first: 1}", "balls.mass = {'first': 1}: "),
        (
            "balls.mass=heavy",
            "balls.mass = 'heavy': must be a number, in kg or with a unit, e.g. 1 g; m",
        ),
        ("balls.mass=yes", "balls.mass = True: "),
        ("balls.mass=-1", "balls.mass = -1: must be at least 1e-12"),
        ("balls.radius=[0, 0.001]", "balls.radius.0 = 0: must be more than 0"),
        ("balls.radius=[0.001, 0.02]", "balls.radius.1 = 0.02 m: must be less than race.radius ="),
        ("balls.radius=0.02", "balls.radius = 0.02 m: must be less than race.radius = 0.01 m"),
        ("balls.mass=[0.05, 0.06]", "must be more than the 2 balls' 0.11 kg that it includes"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(change: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        load_scene("thesis-hold", [change])
    assert words in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_radii_that_no_effect_uses_tell_where_balls_overlap() -> None:
    changes = ["balls.radius=1 mm", "start.ball_angles=[0, 0.1]", "solver={step: 0.001}"]
    scene = load_scene("nsc-case-1", changes)
    assert not [effect for effect in scene.effects.values() if effect.uses_ball_radius]
    assert overlaps_at_start(scene).startswith("balls 0 and 1, first at 0 s")
    assert overlaps_at_start(load_scene("nsc-case-1", changes[1:])) == ""
    one, other = (
        Drive(each).advance(50) for each in (scene, load_scene("nsc-case-1", changes[1:]))
    )
    np.testing.assert_array_equal(one.ball_angles, other.ball_angles)


def test_crowded_balls_are_counted_by_their_key() -> None:
    changes = ["effects.ball_contact={restitution_coefficient: 0.5}", "balls.radius=1 mm"]
    with pytest.raises(SceneError, match=r"balls\.count = 40: with ball_contact"):
        load_scene("thesis-hold", [*changes, "balls.count=40", "start.ball_angles="])
