"""Numbers of a scene by their keys."""

from math import pi

import pytest

from ab_sim.base.errors import InputError, SceneError
from ab_sim.design.differences import moved, real_key, real_keys
from ab_sim.scene.load import load_scene

HOLD = load_scene("thesis-hold", ["start.ball_angles=[0.3, 3.1415]"])


def test_a_key_has_value_and_unit() -> None:
    assert real_key(HOLD, "effects.suspension.stiffness") == (
        "effects.suspension.stiffness", 1000.0, "N/m",
    )  # fmt: skip
    assert real_key(HOLD, "balls.mass.1") == ("balls.mass.1", 1e-3, "kg")
    assert real_key(HOLD, "start.ball_angles.0") == ("start.ball_angles.0", 0.3, "rad")
    assert real_key(load_scene("nsc-case-1"), "start.ball_angles.1")[1:] == (pi, "rad")
    mounts = load_scene("couple-unbalance")
    assert real_key(mounts, "mounts.1.damping.2") == ("mounts.1.damping.2", 0.6, "N s/m")
    assert real_key(HOLD, "profile.variable_speed_period.duration").unit == "s"


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("balls.mas", "no such number; did you mean 'balls.mass'?"),
        ("balls.mass.2", "no such number"),
        ("balls.count", "is not a real number"),
        ("start.ball_angles", "has 2 numbers; name one, e.g. start.ball_angles.0"),
        ("rotor.eccentric_mass", "not given in"),
        ("rotor", "is not a real number"),
        ("solver.step", "solver does not act"),
        ("duration", "duration does not act"),
        ("", "no such number"),
        ("effects.suspension.__class__", "no such number"),
        ("balls.masses.0", "no such number"),
    ],
)
def test_what_is_no_number_of_the_scene_is_refused(key: str, said: str) -> None:
    with pytest.raises(InputError, match="key ") as refused:
        real_key(HOLD, key)
    assert said in str(refused.value)


def test_keys_are_all_numbers_that_act() -> None:
    keys = [real.key for real in real_keys(HOLD)]
    assert len(set(keys)) == len(keys) == 18
    assert {"rotor.total_mass", "balls.mass", "start.angle", "profile.acceleration"} < {*keys}
    assert not {"rotor.height", "race.height", "duration", "solver.step"} & {*keys}
    assert all(real_key(HOLD, key).key == key for key in keys)


def test_a_moved_scene_is_checked() -> None:
    with pytest.raises(SceneError, match="balls.mass"):
        moved(HOLD, {"balls.mass.1": -1e-3})


def test_a_moved_scene_has_the_other_value_and_nothing_else() -> None:
    there = moved(HOLD, {"balls.mass.1": 2e-3})
    assert there.balls.masses == (1e-3, 2e-3) and HOLD.balls.masses == (1e-3, 1e-3)
    assert there.effects == HOLD.effects
    assert there.start == HOLD.start
    assert moved(HOLD, {"effects.suspension.damping": 0.3}).effects["suspension"].damping == 0.3
