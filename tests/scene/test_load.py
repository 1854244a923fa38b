"""Scenes: found, read, changed, checked, and refused with a message that helps."""

import math
import re
from pathlib import Path
from typing import Any

import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.scene import Scene, check_scene, find_scene, load_scene, scene_names
from ab_sim.scene.changes import REMOVED, Change, apply
from ab_sim.scene.load import changed_scene

EXPECTED = {
    "thesis-baseline",
    "thesis-hold",
    "thesis-half-acceleration",
    "one-ball",
    "no-ball",
    "five-balls-8000-rpm",
    "nsc-case-1",
    "nsc-case-2",
    "nsc-case-3",
}


def test_the_scenes_are_there() -> None:
    assert set(scene_names()) >= EXPECTED


@pytest.mark.parametrize("name", scene_names())
def test_every_scene_makes_a_drive_and_survives_a_round_trip(name: str) -> None:
    scene = load_scene(name)
    assert scene.name == name
    assert scene.description and scene.source
    Drive(scene)
    assert check_scene(scene.as_mapping(), "again") == scene


def test_a_file_serves_as_well_as_a_name(tmp_path: Path) -> None:
    copy = tmp_path / "mine.yaml"
    copy.write_text(find_scene("thesis-hold").read_text())
    mine = load_scene(copy)
    assert mine.name == "mine"
    assert mine.model_copy(update={"name": "thesis-hold"}) == load_scene("thesis-hold")


def test_changes() -> None:
    scene = load_scene(
        "thesis-hold",
        ["balls.mass=0.002", "effects.viscous_drag.coefficient=2e0", "effects.rolling_friction="],
    )
    assert scene.balls.mass == 0.002
    assert scene.effects["viscous_drag"].coefficient == 2.0
    assert "rolling_friction" not in scene.effects
    assert scene.total_mass == 0.1, "the thesis' M includes the balls"
    assert load_scene("nsc-case-1", ["balls.mass=0.002"]).total_mass == pytest.approx(0.22)


def test_the_start_is_at_rest_at_zero_unless_told_otherwise() -> None:
    assert load_scene("thesis-hold").start.angle == 0.0
    far = load_scene("thesis-hold", ["start.angle=-1.0e+10", "start.ball_angles=[1.0e+10, 0]"])
    assert far.start.angle == -1e10
    assert far.start.ball_angles == (1e10, 0.0)


def test_the_stepper_is_chosen_for_the_scene_unless_it_names_one(scene: Any) -> None:
    assert scene(solver=None).solver.stepper == "auto"
    assert {load_scene(name).solver.stepper for name in EXPECTED} == {"auto"}
    assert load_scene("thesis-hold", ["solver.stepper=rk4"]).solver.stepper == "rk4"


def test_case_2_is_exactly_degenerate() -> None:
    scene = load_scene("nsc-case-2")
    balls = scene.balls.total_mass * scene.race.radius
    assert balls == pytest.approx(scene.eccentric_mass * scene.rotor.eccentricity, rel=1e-15)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("rotor.total_mas=1", ["rotor.total_mas = 1", "did you mean 'total_mass'", "allowed here"]),
        ("effects.viscus_drag.coefficient=1", ["viscus_drag", "did you mean 'viscous_drag'"]),
        ("effects.suspension.stifness=1", ["effects.suspension.stifness", "'stiffness'"]),
        ("effects.viscous_drag.stiffness=1", ["a parameter of an effect", "effects.suspension"]),
        ("rotor.stiffness=1", ["rotor.stiffness", "effects.suspension.stiffness"]),
        ("rotor.eccentricity=-1", ["rotor.eccentricity = -1", "at least 0", "[m]"]),
        ("rotor.eccentricity=.nan", ["rotor.eccentricity = nan", "finite"]),
        ("rotor.eccentricity=.inf", ["rotor.eccentricity = inf"]),
        ("rotor.eccentricity=yes", ["rotor.eccentricity", "a number is needed"]),
        ("rotor.eccentricity=wide", ["rotor.eccentricity = 'wide'", "must be a number"]),
        (f"rotor.eccentricity=1{'0' * 400}", ["a number of more than 100 digits", "shorter"]),
        (f"rotor.eccentricity=1{'0' * 50}", ["at most 1", "[m]"]),
        ("race.radius=1e9", ["race.radius", "at most 10"]),
        ("race.radius=", ["race.radius: is missing", "[m]"]),
        ("balls.count=65", ["balls.count = 65", "at most 64"]),
        ("balls.count=2.5", ["balls.count = 2.5", "a whole number"]),
        ("balls.count=3", ["start.ball_angles", "has 2 angles for 3 balls"]),
        ("balls.mass=0.06", ["rotor.total_mass", "must be more than"]),
        ("balls.radius=0.02", ["balls.radius", "less than race.radius"]),
        ("balls.radius=", ["balls.radius: is needed by the effect ball_spin"]),
        ("effects.suspension.damping=-1", ["effects.suspension.damping = -1", "[N s/m]"]),
        ("effects.suspension.damping=", ["effects.suspension.damping: is missing"]),
        ("effects.ball_spin.mass=1", ["effects.ball_spin.mass", "takes no parameters"]),
        ("spindle.max_speed=150", ["profile.target_speed = 200", "spindle.max_speed"]),
        ("profile.kind=startup", ["profile.kind", "start_up"]),
        ("profile.variable_speed_period.start_time=2", ["exactly one of start_speed"]),
        ("profile.variable_speed_period.duration=-1", ["duration = -1", "at least 1e-06"]),
        (
            "profile.variable_speed_period.start_speed=500",
            ["start_speed = 500", "must lie between"],
        ),
        ("solver.step=1e-10", ["whole number of nanoseconds"]),
        ("effects=[friction]", ["effects", "no such effect", "rolling_friction"]),
        ("effects.rolling_fricton=", ["no 'rolling_fricton'", "did you mean 'rolling_friction'?"]),
        ("effects.rolling_fricton.arm=", ["no 'rolling_fricton'", "'rolling_friction'"]),
        ("balls.mas=", ["balls has no 'mas' to remove"]),
        ("bals.mass=", ["scene has no 'bals' to remove"]),
        ("balls.mass.0=", ["mass is a value"]),
        ("solver", ["must be key=value"]),
        ("solver.step.size=1", ["solver.step", "has no keys"]),
        ("a..b=1", ["must be key=value"]),
        ("start_up=1", ["start_up = 1: not known here"]),
        ("effects.start_up=1", ["effects.start_up"]),
        ("profile.start_up=1", ["profile.start_up = 1: not known here"]),
        ("profile.to_speed=1", ["a key of speed_change"]),
        ("profile.sensor=a", ["a key of adaptive"]),
        ("duration=2020-02-30", ["not valid YAML"]),
        ("duration=" + "[" * 3000, ["more than 30 levels"]),
        ("duration=[1]", ["duration = [1]: must be a number"]),
        ("balls.mass=1e-320", ["balls.mass", "must be at least 1e-12"]),
        ("rotor.eccentricity=1e-320", ["rotor.eccentricity", "0 or at least 1e-12"]),
        ("start.ball_angles=0.5", ["start.ball_angles = 0.5: must be a list"]),
        ("start.ball_angles=[1e300, 0]", ["start.ball_angles.0", "at most 1e+10", "[rad]"]),
        ("start.angle=-1.1e10", ["start.angle = '-1.1e10': must be at least -1e+10", "[rad]"]),
        ("start.angle=.inf", ["start.angle = inf: "]),
        ("start.angle=[1]", ["start.angle = [1]: must be a number; psi"]),
        ("name=5", ["name = 5: must be a text"]),
        ("effects.suspension=[1000, 0.2]", ["effects.suspension = [1000, 0.2]"]),
        ("effects.suspension=3", ["effects.suspension = 3"]),
        ("effects=null", ["effects = None: must be a list of names"]),
        ("rotor=3", ["rotor = 3: must be a section"]),
        ("rotor=", ["rotor: is missing"]),
        ("balls=", ["balls: is missing", "balls: {count: 0}"]),
        ("race=", ["race: is missing", "the balls need one"]),
        ("start.motor_integral=1", ["start.motor_integral = 1 rad", "name the effect motor"]),
        ("profile.target_speed=np.float64(200.0)", ["NumPy's notation of a number; write 200.0"]),
        (
            "start.ball_angles=[np.float32(1.5),0]",
            ["ball_angles.0 = 'np.float32(1.5)'", "write 1.5"],
        ),
        ("balls.count=np.int64(2)", ["balls.count = 'np.int64(2)'", "write 2"]),
        ("profile.variable_speed_period.acceleration=-1000", ["must lie between"]),
        ("profile.acceleration=60", ["profile.acceleration", "spindle.max_acceleration"]),
        ("profile.acceleration=1e-300", ["profile.acceleration", "at least 1e-06"]),
        ("profile={kind: speed_change, start_time: 1e20, duration: 1, to_speed: 3}", ["at most"]),
    ],
)
def test_bad_input_is_named(change: str, words: list[str]) -> None:
    with pytest.raises(SceneError) as caught:
        load_scene("thesis-hold", [change])
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("digits", [400, 5000])
@pytest.mark.parametrize(
    ("key", "allowed"),
    [
        ("rotor.eccentricity", "must be within +-1.8e+308; e, distance"),
        ("effects.suspension.damping", "must be within +-1.8e+308; c, "),
        ("balls.count", "must be at most 64"),
    ],
)
def test_an_int_beyond_all_floats_is_refused_shortly(key: str, allowed: str, digits: int) -> None:
    with pytest.raises(SceneError, match=re.escape(allowed)) as caught:
        changed_scene(load_scene("thesis-hold"), {key: 10**digits}, "these")
    assert f"these: {key} = " in str(caught.value) and len(str(caught.value)) < 400


def test_a_variation_cannot_remove_what_is_not_there() -> None:
    scene = load_scene("thesis-hold")
    with pytest.raises(SceneError, match="run 3: effects.rolling_fricton: "):
        changed_scene(scene, {"effects.rolling_fricton": None}, "run 3")
    assert changed_scene(scene, {"balls": scene.as_mapping()["balls"]}, "same") == scene


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"balls.mass": 0.0011},
        {"balls.mass": -1.0, "rotor.eccentricity": "much"},
        {"balls.mass": [0.001, 0.002], "start.ball_angles": [0.0, 1.0]},
        {"balls.count": 3},
        {"balls.radius": 0.02},
        {"balls": {"count": 0}, "effects": ["suspension"]},
        {"effects.suspension.stiffness": 900, "effects.rolling_friction": None},
        {"effects.ball_contact.restitution_coefficient": 0.5},
        {"effects.suspension.stiffness": -1, "balls.mass": 1e9},
        {"effects": None},
        {"effects": 3},
        {"profile": None, "start.speed": 100.0},
        {"profile.target_speed": 1e4},
        {"profile.variable_speed_period.duration": 0.6},
        {"profile.variable_speed_period": None},
        {"sensors.pickup.bandwidth": 100.0, "solver.step": 0.003},
        {"sensors.pickup": None},
        {"accuracy.angle": 1e-6},
        {"accuracy.angle": 1e-6, "solver.step": 0.001},
        {"start.deck.tilt": [0.1, 0.0, 0.0]},
        {"start.deck.position": [1e-5, 0.0], "duration": 7},
        {"rotor.mass": 0.2},
        {"race": 3, "balls.mass": None},
        {"name": "another", "no.such.key": 1},
    ],
)
@pytest.mark.parametrize("name", ["thesis-hold", "on-edge", "feeding-deck"])
def test_a_changed_scene_is_what_a_check_of_the_whole_makes_of_it(name: str, changes: Any) -> None:
    """Though only those of its sections are looked at again that a change goes into."""
    scene, found = load_scene(name), []

    def whole() -> Scene:
        raw = scene.as_mapping()
        apply(
            raw,
            [Change(k, REMOVED if v is None else v, f"it: {k}") for k, v in changes.items()],
        )
        return check_scene(raw, "it")

    for made in (whole, lambda: changed_scene(scene, changes, "it")):
        try:
            found.append(made())
        except SceneError as error:
            found.append(str(error))
    assert found[0] == found[1]
    if isinstance(found[0], Scene):
        assert found[0].as_mapping() == found[1].as_mapping()


def test_a_scene_without_balls_needs_no_race() -> None:
    scene = load_scene("no-ball", ["race="])
    assert "race" not in scene.as_mapping() and Drive(scene).advance(1)["speed"][0] > 0.0
    balls = {"balls": {"count": 2, "mass": 1e-3}}
    with pytest.raises(SceneError, match="race: is missing"):
        changed_scene(scene, balls, "with balls")
    assert changed_scene(scene, {**balls, "race.radius": 0.02}, "both").race.radius == 0.02


def test_a_change_leaves_alone_what_it_is_made_of() -> None:
    profile = {"kind": "start_up", "acceleration": 40.0, "target_speed": 200.0}
    made = changed_scene(
        load_scene("thesis-hold"), {"profile": profile, "profile.acceleration": 30.0}, "test"
    )
    assert made.profile is not None and made.profile.acceleration == 30.0
    assert profile["acceleration"] == 40.0


JUST_BEYOND = [
    ("thesis-hold", "spindle.max_speed", 420.0, "profile.target_speed"),
    ("thesis-hold", "spindle.max_speed", 420.0, "start.speed"),
    ("thesis-hold", "spindle.max_acceleration", 50.0, "profile.acceleration"),
    ("thesis-hold", "race.radius", 0.01, "balls.radius"),
    ("on-edge", "sensors.accelerometer.range", 156.9064, "sensors.accelerometer.resolution"),
]


@pytest.mark.parametrize(("name", "limit", "most", "key"), JUST_BEYOND)
def test_a_value_just_beyond_a_limit_does_not_read_like_it(
    name: str, limit: str, most: float, key: str
) -> None:
    beyond = math.nextafter(most, math.inf)
    with pytest.raises(SceneError) as caught:
        load_scene(name, [f"{limit}={most!r}", f"{key}={beyond!r}"])
    assert f"{key} = {beyond!r} " in str(caught.value)
    assert f" {most:.7g} " in str(caught.value)


def test_every_problem_is_told_at_once() -> None:
    with pytest.raises(SceneError) as caught:
        load_scene("thesis-hold", ["rotor.eccentricity=-1", "effects.suspension.damping=-1"])
    assert len(str(caught.value).splitlines()) == 2


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("thesis-hlod", "did you mean 'thesis-hold'"),
        ("nowhere/scene.yaml", "no such scene file"),
        ("missing.yaml", "no such scene file"),
    ],
)
def test_unknown_scenes(name: str, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        load_scene(name)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: [", "not valid YAML"),
        ("a: 1\na: 2", "given twice"),
        ("- 1", "must be a mapping"),
        ("\x00", "not valid YAML"),
        ("a: !!int ''", "YAML: a value is"),
        ("effects: 3", "list of names"),
        ("effects: [suspension, suspension]", "named twice"),
    ],
)
def test_broken_files(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "broken.yaml"
    file.write_text(text)
    with pytest.raises(SceneError, match=words) as caught:
        load_scene(file)
    assert str(file) in str(caught.value)


def test_effects_of_the_same_scene_do_not_depend_on_their_order(scene: Any) -> None:
    mapping = scene().as_mapping()
    turned = {**mapping, "effects": dict(reversed(mapping["effects"].items()))}
    assert list(check_scene(turned, "x").effects) == list(check_scene(mapping, "x").effects)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("start.ball_angles=random", "ab-sim robust --spread start.ball_angles=rand"),
        ("rotor.unbalance=1e-5", "give rotor.eccentricity, e = U / M0"),
        ("effects.suspension.critical_speed=100", "k = M w^2"),
        ("effects.suspension.damping_ratio=0.01", "c = 2 zeta M w"),
    ],
)
def test_what_data_sheets_say_is_answered_with_the_key_to_give(change: str, words: str) -> None:
    with pytest.raises(SceneError, match=re.escape(words)):
        load_scene("thesis-hold", [change])


@pytest.mark.parametrize("changes", ["balls.mass=1", {"balls.mass": 1.0}, [("balls.mass", 1.0)]])
def test_changes_are_a_list_of_texts(changes: Any) -> None:
    with pytest.raises(SceneError, match=r"^changes = .*\['balls.ma"):
        load_scene("thesis-hold", changes)
