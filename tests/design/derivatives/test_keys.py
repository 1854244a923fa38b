"""Numbers of a scene by their keys, and what a change of them makes of constants."""

from math import cos, pi, sin

import numpy as np
import pytest
from ab_sim.analysis.sensitivity import real_keys
from ab_sim.analysis.sensitivity.changes import SceneChange, changes_by
from ab_sim.analysis.sensitivity.keys import moved, real_key

from ab_sim.dynamics.assemble import system_of
from ab_sim.dynamics.layout import layout_of
from ab_sim.errors import InputError
from ab_sim.kernels.constants import flattened
from ab_sim.scene.load import load_scene
from ab_sim.scene.model import Scene

HOLD = load_scene("thesis-hold", ["start.ball_angles=[0.3, 3.1415]"])


def change(scene: Scene, key: str) -> SceneChange:
    return changes_by(scene, real_key(scene, key), layout_of(system_of(scene)))


def by_name(scene: Scene, key: str) -> dict[str, float]:
    """Derivatives of the deck's constants."""
    names = [name for name, _ in flattened((system_of(scene).deck_model, ()), "")]
    return dict(zip(names, change(scene, key).constants, strict=False))


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
        ("balls.count", "is no real number"),
        ("start.ball_angles", "has 2 numbers; name one, e.g. start.ball_angles.0"),
        ("rotor.eccentric_mass", "is not given in this scene"),
        ("rotor", "is no real number"),
        ("solver.step", "solver does not act on the motion, or has no derivative"),
        ("duration", "duration does not act on the motion"),
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


def test_a_moved_scene_has_the_other_value_and_nothing_else() -> None:
    there = moved(HOLD, "balls.mass.1", 2e-3)
    assert there.balls.masses == (1e-3, 2e-3) and HOLD.balls.masses == (1e-3, 1e-3)
    assert there.effects is HOLD.effects and there.start == HOLD.start
    assert moved(HOLD, "effects.suspension.damping", 0.3).effects["suspension"].damping == 0.3


def test_constants_change_as_their_formulas_say() -> None:
    # M0 = M - n m: the unbalance M0 e.
    by_e = by_name(HOLD, "rotor.eccentricity")
    assert by_e[".0.unbalance"] == pytest.approx(0.098, rel=1e-12)
    assert by_e[".0.eccentricity"] == pytest.approx(1.0, rel=1e-12)
    by_mass = by_name(HOLD, "balls.mass")
    assert by_mass[".0.unbalance"] == pytest.approx(-2e-4, rel=1e-11)
    assert by_mass[".0.total_mass"] == 0.0
    mass = change(HOLD, "balls.mass")
    # Balls that roll have 7/5 of their mass, and a mobility of 1 over that.
    assert np.isclose(mass.constants, 1.4, rtol=1e-12).sum() == 2
    assert np.isclose(mass.constants, -1.0 / 1.4e-6, rtol=1e-12).sum() == 2


def test_start_and_profile_change_too() -> None:
    turned = change(load_scene("thesis-hold", ["start.deck.position=[1e-3, 0.0]"]), "start.angle")
    assert turned.start[:2] == pytest.approx([-1e-3 * sin(0.0), -1e-3 * cos(0.0)], abs=1e-14)
    # An angle just below pi goes on beyond it, not to -pi.
    angle = change(HOLD, "start.ball_angles.1").start
    assert angle[layout_of(system_of(HOLD)).angles] == pytest.approx([0.0, 1.0], rel=1e-12)
    start, end, *_ = change(HOLD, "profile.acceleration").segments[1]
    assert start == pytest.approx(-100.0 / 40.0**2, rel=1e-12)
    assert end == pytest.approx(-100.0 / 40.0**2, rel=1e-12)
    assert change(HOLD, "profile.variable_speed_period.duration").segments[2][0] == pytest.approx(1)


def test_where_a_deck_hangs_moves_with_its_weight() -> None:
    scene = load_scene("couple-unbalance", ["effects.gravity={tilt: 0.0}"])
    by = change(scene, "effects.gravity.acceleration").start
    # It hangs lower by M g / sum of stiffnesses, and the other way by what that is of g.
    stiffness = float(np.sum([mount.stiffness for mount in scene.mounts]))
    assert by[2] == pytest.approx(-scene.total_mass / stiffness, rel=1e-6)
