"""What maps are drawn over, and what is refused before anything is computed."""

import numpy as np
import pytest

from ab_sim.analysis.maps.plane import COUNT, Plane, axes_of, axis
from ab_sim.base.errors import AbSimError, InputError
from ab_sim.scene import load_scene


def plane(text: str, *changes: str) -> Plane:
    return Plane(load_scene("nsc-case-1", changes), 7.0, *axes_of(text))


def test_points_are_scenes_with_both_values() -> None:
    found = plane("speed=50:300:6,effects.suspension.damping=1:4:4")
    assert found.shape == (4, 6)
    scene, speed = found.at(2, 5)
    assert speed == 300.0 and scene.effects["suspension"].damping == 3.0
    assert found.titles == ("spindle speed [rad/s]", "effects.suspension.damping [N s/m]")
    assert scene.balls == found.scene.balls


def test_either_axis_may_be_the_speed_or_none_and_fall() -> None:
    scene, speed = plane("balls.mass=1e-3:1e-4:10,speed=9:3:3").at(1, 0)
    assert speed == 6.0 and scene.balls.mass == 1e-3
    scene, speed = plane("race.radius=0.01:0.02:3,rotor.eccentricity=1e-4:3e-4:3").at(0, 1)
    assert speed == 7.0 and scene.race.radius == pytest.approx(0.015)


def test_counts_take_whole_numbers() -> None:
    found = plane("balls.count=1:4:4,speed=1:2:2", "start.ball_angles=")
    assert [found.at(0, k)[0].balls.count for k in range(4)] == [1, 2, 3, 4]


def test_there_are_200_values_unless_told() -> None:
    across, up = axes_of(" speed=0:1 , a.b=3:2:7")
    assert len(across.values) == COUNT and up.key == "a.b" and len(up.values) == 7
    np.testing.assert_allclose(np.diff(up.values), -1 / 6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("speed=1:2", "must be two of KEY=FROM:TO"),
        ("speed=1:2,a=1:2,b=1:2", "must be two of KEY=FROM:TO"),
        ("speed,a=1:2", "must be KEY=FROM:TO or"),
        ("=1:2,a=1:2", "must be KEY=FROM:TO or"),
        ("speed=1,a=1:2", "must be KEY=FROM:TO or"),
        ("speed=1:x,a=1:2", "with numbers"),
        ("speed=1:2:2.5,a=1:2", "with numbers"),
        ("speed=nan:2,a=1:2", "from nan to 2.0: must be finite"),
        ("speed=1:inf,a=1:2", "must be finite numbers"),
        ("speed=2:2,a=1:2", "speed: from 2 to 2: "),
        ("speed=1:2:1,a=1:2", "speed: 1 values: "),
        ("speed=1:2:1000000,a=1:2", "must be from 2 to 2000"),
        ("speed=1:2e5,a=1:2", "speed = 200000 rad/s: must be within +-100000"),
        ("a=1:2,a=1:3", "a is named twice"),
    ],
)
def test_axes_that_are_none(text: str, words: str) -> None:
    with pytest.raises(InputError) as error:
        axes_of(text)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("balls.masss=1e-4:2e-4,speed=1:2", "did you mean 'mass'?"),
        ("balls.mass=-1e-4:2e-4,speed=1:2", "balls.mass = -0.0001"),
        ("balls.mass=1e-4:1e9,speed=1:2", "map, at balls.mass = 1000000000"),
        ("effects.suspensio.damping=1:2,speed=1:2", "did you mean 'suspension'?"),
        ("balls=1:2,speed=1:2", "balls = 1: must be a section"),
        ("name=1:2,speed=1:2", "name = 1: must be a text"),
        ("rotor.total_mass=0.1:0.2,speed=1:2", "give exactly one of total_mass"),
    ],
)
def test_corners_that_are_no_scenes(text: str, words: str) -> None:
    with pytest.raises(AbSimError) as error:
        plane(text).check()
    assert words in str(error.value)


def test_an_axis_by_hand() -> None:
    assert axis("x", 1.0, 2.0, 3).values == (1.0, 1.5, 2.0)
