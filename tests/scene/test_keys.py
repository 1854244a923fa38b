"""What `ab-sim keys` says of a scene's keys is what the models enforce."""

import math
import re
from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

import pytest
import yaml

import ab_sim
from ab_sim.base.errors import InputError, SceneError
from ab_sim.engine.integrate.registry import stepper_named, steppers
from ab_sim.scene import check_scene, find_scene, scene_names
from ab_sim.scene.keys import SceneKey, scene_keys
from ab_sim.scene.load import read_mapping
from ab_sim.scene.registry import effect_classes, register
from tests.conftest import THESIS, merge

KEYS = scene_keys()
LEAVES = [row for row in KEYS if row.range != "-" and not row.range.startswith("list of 1 to")]
CHOICES = [row for row in LEAVES if re.fullmatch(r"[^:;]* or [^:;]*", row.range)]
NUMBERS = [row for row in LEAVES if row.unit != "-" and row not in CHOICES]
UNTIL = {"vibration_rms_below": 1.0, "over": 0.1, "at_most": 1.0}
ADAPTIVE = {"kind": "adaptive", "acceleration": 40.0, "target_speed": 400.0, "sensor": "other"}
IN_SPACE: dict[str, Any] = {
    "rotor": {"eccentric_mass": 0.01, "inertia": [1e-5, 1e-5, 1e-5]},
    "deck": {"inertia": [1e-4, 1e-4, 1e-4]},
    "mounts": [{"position": [0.1, 0.0, 0.0], "stiffness": 1e3, "damping": 1.0}],
}


def keys_of(value: Any, key: str = "") -> Iterator[str]:
    """Every key of nested mappings and lists, dotted."""
    inner = value.items() if isinstance(value, dict) else enumerate(value)
    for name, below in inner:
        yield (whole := f"{key}.{name}" if key else str(name))
        if isinstance(below, dict) or (isinstance(below, list) and isinstance(below[0], dict)):
            yield from keys_of(below, whole)


@cache
def listed(key: str) -> str:
    """The first row of a key that some scene has; scenes have many keys in common."""
    return scene_keys(key)[0].key


@pytest.mark.parametrize("name", scene_names())
def test_every_key_of_every_scene_is_listed(name: str) -> None:
    raw = read_mapping(find_scene(name))
    for key in keys_of(raw):
        if not key.split(".")[-1].isdecimal():  # the entry of a list
            assert listed(key).count(".") == key.count("."), key


@pytest.mark.parametrize("row", KEYS, ids=lambda row: row.key)
def test_every_key_has_a_unit_and_a_meaning(row: SceneKey) -> None:
    assert row.unit
    assert row.range and row.default
    assert len(row.meaning.split()) > 1, row
    assert not re.search(r"\[(m|s|rad|kg)\]", row.meaning), "the unit stands in its own column"


def test_a_key_comes_once() -> None:
    """But for what several steppers are told, each of them something else."""
    others = [row.key for row in KEYS if not row.key.startswith("solver.parameters.")]
    assert len(set(others)) == len(others)
    assert len({(row.key, row.meaning) for row in KEYS}) == len(KEYS)


def test_names_are_those_of_the_registries() -> None:
    effects = {row.key for row in KEYS if re.fullmatch(r"effects\.\w+", row.key)}
    assert effects == {f"effects.{name}" for name in effect_classes()}
    (stepper,) = scene_keys("solver.stepper")
    assert set(re.split(", | or ", stepper.range)) == {"auto", *steppers()}


def surroundings(key: str) -> dict[str, Any]:
    """Changes to the thesis' scene that give a key its section."""
    top, *inner = key.split(".")
    if top == "effects" and inner:
        effect = next(row for row in KEYS if row.key == f"effects.{inner[0]}")
        others = {"suspension": None} if inner[0] == "unequal_suspension" else {}
        return {"effects": {**others, inner[0]: inside(effect.key)}}
    if top in ("deck", "mounts") or key in ("rotor.height", "rotor.inertia", "race.height"):
        return merge(IN_SPACE, {"effects": {"suspension": None}})
    if key == "balls.race" or "tilt" in key or key.endswith(".NAME.position"):
        section = "probes" if key.startswith("probes") else "sensors"
        return merge(IN_SPACE, {"effects": {"suspension": None}, section: {"other": {}}})
    if key.startswith("profile.segments.N.until."):
        return {"profile": {"kind": "segments", "segments": [{"until": UNTIL}]}}
    if key.startswith("profile.segments."):
        return {"profile": {"kind": "segments", "segments": [{"acceleration": 1.0}]}}
    if key in ("profile.sensor", "profile.command_period"):
        return {"profile": ADAPTIVE, "sensors": {"other": {}}}
    if key in ("profile.start_time", "profile.duration", "profile.to_speed"):
        change = {"start_time": 0.0, "duration": 1.0, "to_speed": 1.0}
        return {"profile": {"kind": "speed_change", **change}}
    if key.startswith("profile.variable_speed_period."):
        period = {"start_speed": 10.0, "duration": 0.1}
        return {"profile": {**THESIS["profile"], "variable_speed_period": period}}
    if top == "balanced":
        return {"balanced": {}}
    return {"solver": None} if top == "accuracy" else {}


def inside(section: str) -> dict[str, float]:
    """Values of the required numbers in a section."""
    needed = (row for row in scene_keys(section) if row.default == "required")
    return {row.key.rpartition(".")[2]: limits(row).low or 0.5 for row in needed}


class Limits(NamedTuple):
    """What a range says in words."""

    low: float
    high: float
    open_low: bool
    open_high: bool


def limits(row: SceneKey) -> Limits:
    """The interval that a row's range names."""
    text = re.sub(r"^whole(, )?|^.* of: |; one or a list$", "", row.range)
    if between := re.fullmatch(r"(\S+) to (\S+)", text):
        return Limits(float(between[1]), float(between[2]), False, False)
    low, high, open_low, open_high = -math.inf, math.inf, False, False
    for sign, number in re.findall(r"([<>]=?) ([^,\s]+)", text):
        if sign[0] == ">":
            low, open_low = float(number), sign == ">"
        else:
            high, open_high = float(number), sign == "<"
    assert not math.isinf(low) or not math.isinf(high) or text in ("", "finite"), row
    return Limits(low, high, open_low, open_high)


def place_of(key: str) -> tuple[dict[str, Any], Any, str]:
    """Return the thesis' scene with all that a key needs, the section of the key, and its name."""
    raw = merge(THESIS, surroundings(key))
    here: Any = raw
    *sections, last = key.split(".")
    for section in sections:
        if isinstance(here, list):
            here[0] = here = dict(here[0])
        else:
            name = "other" if section == "NAME" else section
            here[name] = here = _copied(here.get(name))
    return raw, here, last


def trouble_with(row: SceneKey, value: Any) -> str:
    """What is said of the thesis' scene with that value; empty if it is taken."""
    if row.key.startswith("solver.parameters."):
        stepper = row.meaning.rpartition("of the stepper ")[2]
        try:
            stepper_named(stepper, {row.key.rpartition(".")[2]: value})
        except SceneError as error:
            return str(error)
        return ""
    if count := re.match(r"(\d+)( or \d+)? of:", row.range):
        value = [value] * int(count[1])
    elif row.range.startswith("list of:"):
        value = [value] * 2
    raw, section, last = place_of(row.key)
    section[last] = value
    try:
        check_scene(raw, "test")
    except SceneError as error:
        return str(error)
    return ""


def _copied(value: Any) -> Any:
    return list(value) if isinstance(value, list) else dict(value or {})


def shown_key(row: SceneKey) -> str:
    """A row's key, as errors of ``trouble_with`` call it."""
    return row.key.replace(".N.", ".0.").replace("NAME", "other")


def out_of_bounds(row: SceneKey) -> Iterator[tuple[float, str]]:
    """Values beyond each bound that a row shows, and what has to be said of them."""
    low, high, open_low, open_high = limits(row)
    whole = row.range.startswith("whole")
    if not math.isinf(low):
        below = low if open_low else low - 1 if whole else math.nextafter(low, -math.inf)
        yield below, r"must be (more than|at least|within)"
    if not math.isinf(high):
        above = high if open_high else high + 1 if whole else math.nextafter(high, math.inf)
        yield above, r"must be (less than|at most|within)"


@pytest.mark.parametrize("row", NUMBERS, ids=lambda row: row.key)
def test_a_value_beyond_a_bound_is_refused(row: SceneKey) -> None:
    for value, words in out_of_bounds(row):
        assert re.search(rf"{re.escape(shown_key(row))}\S* = .*{words}", trouble_with(row, value))
    said = trouble_with(row, math.inf)
    assert re.search(r"must be (a finite number|a whole number|within)", said)


@pytest.mark.parametrize("row", NUMBERS, ids=lambda row: row.key)
def test_a_value_at_a_bound_is_not_refused_for_it(row: SceneKey) -> None:
    """What else is wrong with it (a mass of 1000 kg in balls) is another matter."""
    low, high, open_low, open_high = limits(row)
    whole = row.range.startswith("whole")
    for value, is_open, inwards in ((low, open_low, math.inf), (high, open_high, -math.inf)):
        if not math.isinf(value):
            inner = math.nextafter(value, inwards) if is_open else value
            said = trouble_with(row, int(inner) if whole else inner)
            assert re.split("; of (the stepper|kind)", row.meaning)[0] not in said


@pytest.mark.parametrize("row", CHOICES, ids=lambda row: row.key)
def test_what_is_not_among_the_named_is_refused(row: SceneKey) -> None:
    if row.key == "solver.stepper":
        with pytest.raises(SceneError, match="no such stepper"):
            stepper_named("word")
    elif row.unit == "1":
        assert f"{row.key} = 4.5: must be {row.range}; " in trouble_with(row, 4.5)
    else:
        assert f"{shown_key(row)} = 'word': " in trouble_with(row, "word")


def test_defaults_are_what_a_scene_without_the_key_gets() -> None:
    optional = [row for row in LEAVES if row.default not in ("-", "required")]
    assert len(optional) > 15
    for row in optional:
        if row.key.startswith("solver.parameters."):
            continue
        raw = merge(THESIS, {"solver": None, **surroundings(row.key)})
        if row.key.startswith(("sensors.", "probes.")):
            raw[row.key.partition(".")[0]] = {"other": {}}
        value: Any = check_scene(raw, "test")
        for part in row.key.split("."):
            value = _part(value, part)
        assert _read(row.default) == _plain(value), row


def _read(default: str) -> Any:
    try:
        return float(default)
    except ValueError:
        return yaml.safe_load(default)


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _part(value: Any, part: str) -> Any:
    if part == "N":
        return value[0]
    if isinstance(value, dict):
        return value["other" if part == "NAME" else part]
    return getattr(value, part)


def test_what_is_required_is_missed() -> None:
    """A key that is said to be required, taken out of a scene that has it."""
    required = [row for row in KEYS if row.default == "required"]
    assert len(required) > 20
    for row in required:
        raw, section, last = place_of(row.key)
        if row.key == "profile.segments":
            raw["profile"] = section = {"kind": "segments"}
        section.pop(last, None)
        with pytest.raises(SceneError, match=rf"{re.escape(shown_key(row))}\b.*(missing|None)"):
            check_scene(raw, "test")


def test_defaults_of_steppers_are_theirs() -> None:
    for row in scene_keys("solver.parameters")[1:]:
        name, stepper = row.key.rpartition(".")[2], row.meaning.rpartition("of the stepper ")[2]
        assert stepper_named(stepper, {name: float(row.default)}) == stepper_named(stepper)


@pytest.mark.parametrize(
    ("section", "first", "count"),
    [
        ("rotor", "rotor", 7),
        ("rotor.mass", "rotor.mass", 1),
        ("effects.motor", "effects.motor", 6),
        ("solver.parameters", "solver.parameters", 5),
        ("mounts.3.stiffness", "mounts.N.stiffness", 1),
        ("sensors.on_top.seed", "sensors.NAME.seed", 1),
        ("profile.segments.0.until", "profile.segments.N.until", 6),
    ],
)
def test_a_section_is_chosen_by_how_keys_begin(section: str, first: str, count: int) -> None:
    chosen = scene_keys(section)
    assert (chosen[0].key, len(chosen)) == (first, count)


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("rotr", "'rotr': a scene has no such key; did you mean 'rotor'?"),
        ("mass", "did you mean 'rotor.mass' or 'balls.mass'?"),
        ("effects.motr", "did you mean 'effects.motor'?"),
        ("quite_different", "its sections are: name, description, source, assumed, rotor, deck"),
        ("rotor.mass.more", "'rotor.mass.more': "),
    ],
)
def test_a_section_that_is_none_gets_close_matches(section: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        scene_keys(section)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_effect_of_ones_own_is_listed() -> None:
    class Hum(NamedTuple):
        """Hums along."""

    with ab_sim.temporary_registrations():
        register("hum", equation="F = 0", source="nowhere")(Hum)
        assert scene_keys("effects.hum") == [SceneKey("effects.hum", "-", "-", "-", "Hums along.")]


def test_the_schema_is_read_once() -> None:
    """Reading it takes 40 ms, and a sweep asks for the unit of each value."""
    first, second = scene_keys("rotor"), scene_keys("rotor")
    assert all(one is other for one, other in zip(first, second, strict=True))
