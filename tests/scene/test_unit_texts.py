"""Scenes whose numbers have their unit are those with the numbers in SI."""

import copy
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

import ab_sim
from ab_sim.base.errors import SceneError
from ab_sim.scene import check_scene, find_scene, load_scene, scene_names
from ab_sim.scene.keys import ENTRY, NAME, scene_keys, unit_at, without_units
from ab_sim.scene.load import changed_scene, load_profile, read_mapping
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register
from ab_sim.scene.schema import scene_schema
from ab_sim.scene.units import NO_UNIT
from tests.conftest import THESIS, merge
from tests.waiting import PATIENCE

Place = tuple[str | int, ...]

DESIGNERS: dict[str, Any] = {
    "rotor": {"total_mass": "100 g", "eccentricity": "0.1 mm"},
    "race": {"radius": "1 cm"},
    "balls": {"count": 2, "mass": ["1 g", 1e-3], "radius": "1 mm"},
    "effects": {
        "suspension": {"stiffness": "1 N/mm", "damping": "0.2 N s/m"},
        "viscous_drag": {"coefficient": 1.0},
        "spindle_acceleration": {},
        "ball_spin": {},
    },
    "start": {"speed": "0 rpm", "ball_angles": ["90 deg", 0.0]},
    "spindle": {"max_speed": "1e-3 krad/ms", "max_acceleration": "100 rad/s^2"},
    "profile": {"kind": "start_up", "acceleration": "40 rad/s²", "target_speed": "3000 rpm"},
    "solver": {"stepper": "rk8", "step": "1 ms"},
    "duration": "0.1 min",
}
"""The thesis' scene as a designer may write it."""
IN_SI = merge(
    THESIS,
    {
        "balls": {"mass": [1e-3, 1e-3]},
        "start": {"ball_angles": [math.pi / 2, 0.0]},
        "spindle": {"max_speed": 1000.0},
        "profile": {**THESIS["profile"], "target_speed": 100 * math.pi},
    },
)
"""The same in SI."""


def numbers(value: Any, path: Place = ()) -> list[tuple[Place, float]]:
    """The numbers of a scene whose keys have units, each with its place."""
    if isinstance(value, dict | list):
        inner = value.items() if isinstance(value, dict) else enumerate(value)
        return [found for name, below in inner for found in numbers(below, (*path, name))]
    if isinstance(value, bool | str | None) or unit_at(tuple(map(str, path))) in NO_UNIT:
        return []
    return [(path, value)]


def put(raw: Any, path: Place, value: Any) -> None:
    for part in path[:-1]:
        raw = raw[part]
    raw[path[-1]] = value


@pytest.mark.parametrize("name", scene_names())
@given(data=st.data())
@settings(max_examples=5)
def test_scenes_with_units_are_those_in_si_to_the_bit(name: str, data: st.DataObject) -> None:
    raw = read_mapping(find_scene(name))
    there = numbers(raw)
    assert len(there) > 5
    units = copy.deepcopy(raw)
    for path, number in data.draw(st.lists(st.sampled_from(there), min_size=1)):
        put(units, path, f"{number!r} {unit_at(tuple(map(str, path)))}")
    assert check_scene(units, "test") == check_scene(raw, "test")


def test_a_designers_scene_is_the_same_however_it_is_given(tmp_path: Path) -> None:
    wanted = check_scene({**IN_SI, "name": "mine"}, "test")
    before = copy.deepcopy(DESIGNERS)
    assert check_scene({**DESIGNERS, "name": "mine"}, "test") == wanted
    assert before == DESIGNERS, "what was given is not changed"
    listed = [{name: parameters} for name, parameters in DESIGNERS["effects"].items()]
    for effects in (DESIGNERS["effects"], listed):
        file = tmp_path / "mine.yaml"
        file.write_text(yaml.safe_dump({**DESIGNERS, "effects": effects}, allow_unicode=True))
        assert load_scene(file) == wanted
    again = tmp_path / "again.yaml"
    again.write_text(yaml.safe_dump(wanted.as_mapping()))
    assert load_scene(again) == wanted
    assert not {type(value) for _, value in numbers(yaml.safe_load(again.read_text()))} - {float}


def test_changes_and_variations_take_units() -> None:
    changes = ["balls.mass=2 g", "start.ball_angles=[0 deg, 180 deg]", "solver.step=0.5 ms"]
    scene = load_scene("thesis-hold", changes)
    assert scene.balls.mass == 0.002
    assert scene.start.ball_angles == (0.0, math.pi)
    assert scene.solver.step == 0.0005
    varied = changed_scene(
        scene, {"balls.mass": "1 g", "effects.suspension.stiffness": "2 N/mm"}, "test"
    )
    assert (varied.balls.mass, varied.effects["suspension"].stiffness) == (0.001, 2000.0)
    short = load_scene("nsc-case-1", ["duration=10 ms"])
    by_units = ab_sim.simulate_batch(short, [{"balls.mass": "1 g"}, {"balls.mass": ["2 g"] * 2}])
    in_si = ab_sim.simulate_batch(short, [{"balls.mass": 1e-3}, {"balls.mass": [2e-3] * 2}])
    for ours, theirs in zip(by_units.runs, in_si.runs, strict=True):
        assert ours.scene == theirs.scene
        assert (ours.trajectory.whirl == theirs.trajectory.whirl).all()


def test_parameters_of_steppers_and_sensors_take_units() -> None:
    scene = load_scene(
        "thesis-hold",
        [
            "solver.stepper=taylor",
            "solver.parameters={tolerance: 1e-6 deg, order: 8}",
            "sensors={top: {bandwidth: 0.2 kHz, range: 16 g_0, axis_angle: 90 deg}}",
        ],
    )
    assert scene.solver.parameters == {"tolerance": math.radians(1e-6), "order": 8.0}
    top = scene.sensors["top"]
    assert (top.bandwidth, top.range, top.axis_angle) == (200.0, 156.9064, math.pi / 2)


def test_profiles_take_units(tmp_path: Path) -> None:
    text = "{kind: segments, segments: [{to: 60 rpm, acceleration: 2 rad/s^2}, {hold: 500 ms}]}"
    (tmp_path / "mine.yaml").write_text(text.strip("{}").replace(", segments", "\nsegments"))
    for source in (text, str(tmp_path / "mine.yaml")):
        profile: Any = load_profile(source).profile
        assert [each.to for each in profile.segments] == [2 * math.pi, None]
        assert profile.segments[1].hold == 0.5
    with pytest.raises(SceneError) as caught:
        load_profile(text.replace("60 rpm", "1 Hz"))
    assert "profile.segments.0.to = '1 Hz': is a frequency [Hz], must be an angular" in str(
        caught.value
    )
    start_up = "{kind: start_up, acceleration: 40, target_speed: 200}"
    asked: Any = load_profile(start_up, ["profile.target_speed=30 rpm"]).profile
    assert asked.target_speed == math.pi


REFUSED = [
    (
        "balls.mass=12 mm",
        "balls.mass = '12 mm': is a length [m], must be a mass [kg], e.g. 1 g; m,",
    ),
    ("balls.mass=[1 g, 2 m]", "balls.mass.1 = '2 m': is a length"),
    ("balls.mass=12 mmm", "'mmm' is not a known unit"),
    ("balls.count=2 g", "balls.count = '2 g': must be a whole number"),
    ("accuracy.whirl=1 deg", "accuracy.whirl = '1 deg': must be a number without unit"),
    ("spindle.max_speed=42 Hz", "Hz may mean turns or radians: write rev/s, rpm or rad/s"),
    ("sensors.a.bandwidth=60 rpm", "sensors.a.bandwidth = '60 rpm': is an angular speed [rad/s]"),
    ("effects.suspension.stiffness=1 N", "effects.suspension.stiffness = '1 N': is a force [N]"),
    ("effects.ball_spin.x=1 m", "effects.ball_spin.x = '1 m': not known here"),
    ("solver.parameters.tolerance=1 m", "solver.parameters.tolerance = '1 m': is a length"),
    ("solver.stepper=1 m", "solver.stepper = '1 m'"),
    ("rotor=1 m", "rotor = '1 m': must be a section"),
    ("duration=1e400 s", "duration = '1e400 s': is too large for a float; must be a time [s]"),
    ("duration=nan s", "duration = 'nan s': must be a number, in s or with a unit, e.g. 500 ms"),
    ("duration=-1 ms", "duration = -0.001: must be more than 0"),
    ("profile.kind=1 m", "profile.kind = '1 m': must be one of"),
    ("start.ball_angles=45 deg", "start.ball_angles = 0.7853981633974483: must be a list"),
]


@pytest.mark.parametrize(("change", "said"), REFUSED)
def test_what_does_not_fit_is_refused_in_a_line(change: str, said: str) -> None:
    with pytest.raises(SceneError) as caught:
        ab_sim.Drive(load_scene("thesis-hold", [change]))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_all_that_is_wrong_is_told_together() -> None:
    raw = merge(DESIGNERS, {"race": {"radius": "1 g"}, "effects": {"viscous_drag": {}}})
    raw["effects"] = {**raw["effects"], "viscous_drag": {"coefficient": "1 kg"}}
    with pytest.raises(SceneError) as caught:
        check_scene(raw, "test")
    drag, radius = str(caught.value).splitlines()
    assert drag.startswith("test: effects.viscous_drag.coefficient = '1 kg': is a mass [kg], must")
    assert radius.startswith("test: race.radius = '1 g': is a mass [kg], must be a length [m]")


def test_an_effect_of_ones_own_takes_its_units() -> None:
    assert unit_at(("effects", "heater", "power")) == "-"

    class Heater(NamedTuple):
        """Heats."""

        power: Annotated[Number, quantity("how much", "W")]
        wobble: Annotated[Number, quantity("in a unit of its own", "wobble")] = 0.0

    with ab_sim.temporary_registrations():
        register("heater", equation="P = P", source="nowhere")(Heater)
        raw = merge(THESIS, {"effects": {"heater": {"power": "5 mW"}}})
        assert check_scene(raw, "test").effects["heater"] == Heater(0.005)
        for parameters, said in (
            ({"power": "5 g"}, "power = '5 g': is a mass [kg], must be in [W], e.g. 0.5 W; how"),
            ({"power": 1, "wobble": "1 wobble"}, "must be a number in wobble, written without"),
        ):
            with pytest.raises(SceneError) as caught:
                check_scene(merge(THESIS, {"effects": {"heater": parameters}}), "test")
            assert said in str(caught.value)


def test_texts_that_are_no_numbers_stay() -> None:
    scene = load_scene("thesis-hold", ["name=3 m", "description=2 g", "source=1 s"])
    assert (scene.name, scene.description, scene.source) == ("3 m", "2 g", "1 s")
    assert load_scene("thesis-hold", ["balls.mass=1e-3"]).balls.mass == 1e-3, "a text in YAML"


def test_what_contains_itself_comes_to_an_end() -> None:
    raw: dict[str, Any] = copy.deepcopy(THESIS)
    raw["rotor"]["self"] = raw["rotor"]
    assert without_units(raw)["balls"] == raw["balls"]
    with pytest.raises(SceneError, match=r"rotor\.self"):
        check_scene(raw, "test")


def test_no_key_lies_deeper_than_is_looked() -> None:
    for row in scene_keys():
        parts = [{ENTRY: "0", NAME: "top"}.get(part, part) for part in row.key.split(".")]
        assert len(parts) < 7
        assert unit_at(tuple(parts)) == row.unit


def test_the_schema_takes_texts_where_there_is_a_unit() -> None:
    validator = Draft202012Validator(scene_schema())
    assert list(validator.iter_errors(DESIGNERS)) == []
    for change in (
        {"duration": "long"},
        {"duration": "12"},
        {"balls": {"count": "2 g"}},
        {"accuracy": {"whirl": "1 deg"}, "solver": None},
        {"balls": {"mass": ["1 g", "heavy"]}},
        {"effects": {"suspension": {"stiffness": "stiff"}}},
    ):
        assert list(validator.iter_errors(merge(DESIGNERS, change))) != [], change


def in_a_process(program: str) -> list[str]:
    """What a program prints that has imported nothing yet."""
    environment = {**os.environ, "PYTHONPATH": str(Path(ab_sim.__file__).parents[1])}
    return subprocess.run(
        [sys.executable, "-c", program],
        env=environment, check=True, capture_output=True, text=True, timeout=PATIENCE,
    ).stdout.splitlines()  # fmt: skip


def test_pint_is_imported_for_numbers_with_a_unit_only() -> None:
    program = """
import sys, ab_sim
from ab_sim.scene.schema import scene_schema
ab_sim.Drive(ab_sim.load_scene("thesis-hold", ["description=3 m"])).advance(2)
scene_schema()
try: ab_sim.load_scene("thesis-hold", ["duration=long"])
except ab_sim.SceneError: print("pint" in sys.modules)
ab_sim.load_scene("thesis-hold", ["duration=1 min"])
print("pint" in sys.modules)
"""
    assert in_a_process(program) == ["False", "True"]


def test_without_pint_it_is_said_what_to_do() -> None:
    program = """
import sys, ab_sim
sys.modules["pint"] = None
try: ab_sim.load_scene("thesis-hold", ["balls.mass=1 g"])
except ab_sim.SceneError as error: print(error)
"""
    (said,) = in_a_process(program)
    assert "pip install 'pint>=0.24', or give the number in kg" in said
