"""The JSON Schema that `ab-sim schema` prints agrees with what reads scenes."""

from typing import Any

import pytest
from jsonschema import Draft202012Validator

from ab_sim.base.errors import SceneError
from ab_sim.base.yaml_files import read_scene_file
from ab_sim.engine.integrate.registry import parameters_of, steppers
from ab_sim.scene import check_scene, find_scene, scene_names
from ab_sim.scene.load import read_mapping
from ab_sim.scene.schema import parts_of, scene_schema
from tests.conftest import THESIS, merge

SCHEMA = scene_schema()
VALIDATOR = Draft202012Validator(SCHEMA)


def errors(scene: Any) -> list[str]:
    return [error.json_path for error in VALIDATOR.iter_errors(scene)]


def test_it_is_a_schema_of_the_draft_that_it_names() -> None:
    assert SCHEMA["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("name", scene_names())
def test_every_scene_that_ships_is_valid(name: str) -> None:
    """As its file has it, its effects in a list, and by name."""
    assert errors(read_scene_file(find_scene(name))) == []
    assert errors(read_mapping(find_scene(name))) == []


@pytest.mark.parametrize("name", scene_names())
def test_what_a_checked_scene_is_written_as_is_valid(name: str) -> None:
    assert errors(check_scene(read_mapping(find_scene(name)), "test").as_mapping()) == []


WRONG: list[tuple[str, dict[str, Any]]] = [
    ("$", {"rotr": {}}),
    ("$.rotor", {"rotor": {"eccentricty": 1e-4}}),
    ("$.rotor.eccentricity", {"rotor": {"eccentricity": -1e-4}}),
    ("$.rotor.total_mass", {"rotor": {"total_mass": 2e3}}),
    ("$.rotor", {"rotor": {"eccentricity": None}}),
    ("$.race.radius", {"race": {"radius": 0}}),
    ("$.balls.count", {"balls": {"count": 65}}),
    ("$.balls.count", {"balls": {"count": 1.5}}),
    ("$.balls.mass", {"balls": {"mass": [1e-3, 0.0]}}),
    ("$.duration", {"duration": "long"}),
    ("$.effects", {"effects": {"suspenson": {}}}),
    ("$.effects", {"effects": {"suspension": {"stifness": 1.0}}}),
    ("$.effects", {"effects": {"suspension": {"stiffness": -1.0}}}),
    ("$.effects", {"effects": {"viscous_drag": {"coefficient": None}}}),
    ("$.sensors", {"sensors": {"Upper": {}}}),
    ("$.sensors", {"sensors": {"ball_1": {}}}),
    ("$.sensors.a", {"sensors": {"a": {"bandwith": 1.0}}}),
    ("$.profile", {"profile": {"kind": "startup", "acceleration": 1.0, "target_speed": 1.0}}),
    ("$.profile", {"profile": {"kind": "segments", "segments": []}}),
    ("$.solver", {"solver": {"stepp": 1e-3}}),
    ("$.solver.step", {"solver": {"step": 0}}),
]
"""Where it is wrong, and the change that makes the thesis' scene so."""


@pytest.mark.parametrize(("where", "change"), WRONG, ids=lambda value: str(value))
def test_what_the_loader_refuses_is_not_valid(where: str, change: dict[str, Any]) -> None:
    assert errors(THESIS) == []
    raw = merge(THESIS, change)
    with pytest.raises(SceneError):
        check_scene(raw, "test")
    assert errors(raw) == [where]


@pytest.mark.parametrize(
    "given",
    [
        {"stepper": "rk9"},
        {"stepper": "taylor", "parameters": {"tolerence": 1e-9}},
        {"stepper": "taylor", "parameters": {"tolerance": 1.0}},
        {"stepper": "taylor", "parameters": {"order": 90}},
        {"stepper": "taylor", "parameters": {"rho_inf": 0.5}},
        {"stepper": "rk8", "parameters": {"tolerance": 1e-9}},
        {"stepper": "auto", "parameters": {"tolerance": 1e-9}},
    ],
    ids=str,
)
def test_a_stepper_takes_its_own_parameters_only(given: dict[str, Any]) -> None:
    assert errors(merge(THESIS, {"solver": given})) != []


def test_no_stepper_is_auto_which_takes_no_parameters() -> None:
    raw = {key: value for key, value in THESIS.items() if key != "solver"}
    assert errors({**raw, "solver": {"step": 1e-3, "parameters": {}}}) == []
    assert errors({**raw, "solver": {"step": 1e-3, "parameters": {"tolerance": 1e-9}}}) != []


def test_a_stepper_takes_its_defaults() -> None:
    for name in steppers():
        defaults = {key: parameter.default for key, parameter in parameters_of(name).items()}
        assert errors(merge(THESIS, {"solver": {"stepper": name, "parameters": defaults}})) == []


@pytest.mark.parametrize(
    "effects",
    [
        [],
        ["spindle_acceleration", {"viscous_drag": {"coefficient": 1.0}}],
        [{"race_runout": None}],
        {"spindle_acceleration": None, "suspension": {"stiffness": 1.0, "damping": 0.0}},
    ],
    ids=str,
)
def test_effects_are_written_as_the_loader_reads_them(effects: Any) -> None:
    raw = {**THESIS, "balls": {"count": 2, "mass": 1e-3}, "effects": effects}
    check_scene(raw, "test")
    assert errors(raw) == []


@pytest.mark.parametrize(
    "entry", ["suspension", "suspenson", {}, {"motor": None}, {"ball_spin": {}, "gravity": {}}, 1]
)
def test_an_entry_that_is_no_effect_is_not_valid(entry: Any) -> None:
    raw = {**THESIS, "effects": [entry]}
    with pytest.raises(SceneError):
        check_scene(raw, "test")
    assert errors(raw) == ["$.effects"]


def test_what_a_key_means_is_said_with_its_unit() -> None:
    rotor = SCHEMA["$defs"]["Rotor"]["properties"]
    assert rotor["eccentricity"]["description"].endswith("from the shaft axis [m]")
    assert "Equation: T = clip" in SCHEMA["$defs"]["Effects"]["properties"]["motor"]["description"]
    for part in parts_of(SCHEMA):
        assert not {"ge", "gt", "le", "lt", "title"} & part.keys() or part is SCHEMA
