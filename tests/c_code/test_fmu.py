"""The FMU: what is in it, what its descriptions say, and how it runs, with the bits of a Drive."""

import io
import re
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from ab_sim.base.errors import InputError
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import tilt_of
from ab_sim.export.c_code import fmu as made_by
from ab_sim.export.c_code.fmu import Fmu, base_units, fmu_of, identifier_of
from ab_sim.export.c_code.sources import sources_of
from ab_sim.scene import load_scene
from ab_sim.scene.model import Solver
from tests.c_code.compiled import STRICT, needs_compiler
from tests.c_code.importer import ERROR, OK, WARNING, Importer
from tests.c_code.test_files import METACHARACTERS, tokens_of_c

SCHEMA = Path(__file__).with_name("fmi3_schema")
PLANE = load_scene("thesis-hold", ["effects.rolling_friction=", "sensors.front.noise_density=0"])
SPACE = load_scene("couple-unbalance", ["start.deck.tilt=[0.02, -0.01, 0.03]"])


@pytest.fixture(scope="module")
def plane() -> Fmu:
    return fmu_of(sources_of(PLANE), "drive")


@pytest.fixture(scope="module")
def space() -> Fmu:
    return fmu_of(sources_of(SPACE), "wobbling_drive")


def names(content: bytes) -> list[str]:
    return zipfile.ZipFile(io.BytesIO(content)).namelist()


def part(fmu: Fmu, name: str) -> str:
    return zipfile.ZipFile(io.BytesIO(fmu.content)).read(name).decode()


def test_descriptions_fit_the_schemas_of_fmi(plane: Fmu, space: Fmu) -> None:
    xmlschema = pytest.importorskip("xmlschema", reason="needs xmlschema, see setup.py")
    for name, file in (
        ("modelDescription.xml", "fmi3ModelDescription.xsd"),
        ("sources/buildDescription.xml", "fmi3BuildDescription.xsd"),
    ):
        schema = xmlschema.XMLSchema(str(SCHEMA / file))
        for fmu in (plane, space):
            schema.validate(part(fmu, name))


@pytest.mark.parametrize("which", ["plane", "space"])
def test_the_description_is_what_the_source_has(which: str, request: pytest.FixtureRequest) -> None:
    """Value references are places in the table; units are defined; outputs are in the structure."""
    fmu: Fmu = request.getfixturevalue(which)
    root = Xml.fromstring(part(fmu, "modelDescription.xml"))
    (listed,) = root.iter("ModelVariables")
    table = re.findall(r"\{(\d+), \d, AT\(.*?\), \S+\}, /\* (.*) \*/", part(fmu, "sources/fmu.c"))
    described = [(each.attrib["valueReference"], each.attrib["name"]) for each in listed]
    assert described == table and len({name for _, name in table}) == len(table) > 25
    assert [int(reference) for reference, _ in table] == list(range(len(table)))
    defined = {unit.attrib["name"] for unit in root.iter("Unit")}
    assert {each.attrib["unit"] for each in listed if "unit" in each.attrib} == defined
    outputs = [v.attrib["valueReference"] for v in listed if v.attrib["causality"] == "output"]
    for what in ("Output", "InitialUnknown"):
        assert [each.attrib["valueReference"] for each in root.iter(what)] == outputs


def test_units_in_base_units() -> None:
    assert base_units("N s/m") == {"kg": 1, "s": -1}
    assert base_units("rad/s^2") == {"rad": 1, "s": -2}
    assert base_units("kg m^2") == {"kg": 1, "m": 2}
    assert base_units("1") == {}
    assert base_units("Pa") is base_units("(m/s^2)/sqrt(Hz)") is base_units("m/s/s") is None


@needs_compiler
def test_its_archive_has_what_it_takes_to_build_it(space: Fmu, tmp_path: Path) -> None:
    """Without a warning; its internal functions have its name, so that several can be linked."""
    zipfile.ZipFile(io.BytesIO(space.content)).extractall(tmp_path)
    page = (tmp_path / "documentation" / "index.html").read_text()
    assert "sources/drive.c sources/fmu.c" in page
    assert space.binary is not None and f"binaries/{space.binary}/wobbling_drive.so" in page
    words = ["cc", *STRICT, "-shared", "-fPIC", "-Iextra/org.fmi-standard"]
    sources = ["sources/drive.c", "sources/fmu.c", "-o", "other.so", "-lm"]
    made = subprocess.run([*words, *sources], cwd=tmp_path, capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    seen = subprocess.run(["nm", "-D", "--defined-only", tmp_path / "other.so"],
                          capture_output=True, text=True, check=True).stdout  # fmt: skip
    found = set(re.findall(r" T (\w+)", seen))
    header = (tmp_path / "extra" / "org.fmi-standard" / "fmi3Functions.h").read_text()
    assert set(re.findall(r"^FMI3_Export \w+ +(fmi3\w+);", header, re.MULTILINE)) <= found
    others = {name for name in found if not name.startswith("fmi3")}
    assert others and all(name.startswith("wobbling_drive_") for name in others)


@needs_compiler
def test_words_of_a_scene_stay_words_in_every_file(
    plane: Fmu, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = {"description": METACHARACTERS, "name": METACHARACTERS, "source": METACHARACTERS}
    with monkeypatch.context() as without_compiler:  # the binary is not looked at
        without_compiler.setenv("PATH", "")
        evil = fmu_of(sources_of(PLANE.model_copy(update=words)), "drive")
    root = Xml.fromstring(part(evil, "modelDescription.xml"))
    assert "<script>" in root.attrib["modelName"] and "\\x01" in root.attrib["description"]
    html, plain = (part(each, "documentation/index.html") for each in (evil, plane))
    assert html.splitlines()[2:] == plain.splitlines()[2:]
    first = html.splitlines()[1]
    assert first.startswith("<!-- ") and first.endswith(" -->")
    assert first.count("<") == first.count(">") == 1
    for name in ("drive.c", "drive.h"):
        found, expected = (tokens_of_c(part(each, f"sources/{name}")) for each in (evil, plane))
        assert found == expected


@needs_compiler
def test_the_same_scene_makes_the_same_file(plane: Fmu) -> None:
    assert fmu_of(sources_of(PLANE), "drive").content == plane.content


@needs_compiler
def test_without_a_compiler_it_has_its_sources(plane: Fmu, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    found = fmu_of(sources_of(PLANE), "drive")
    assert found.binary is None
    assert names(found.content) == [n for n in names(plane.content) if "binaries" not in n]


@needs_compiler
def test_a_compiler_that_fails_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(made_by, "FLAGS", ("--no-such-flag",))
    with pytest.raises(InputError, match="FMU's binary: .*no-such-flag"):
        fmu_of(sources_of(PLANE), "drive")


def test_a_file_s_name_becomes_a_name_in_c() -> None:
    assert [identifier_of(name) for name in ("drive", "my-drive 2", "5balls")] == [
        "drive", "my_drive_2", "drive_5balls",
    ]  # fmt: skip


@needs_compiler
def test_it_follows_commands_with_the_bits_of_a_drive(plane: Fmu, tmp_path: Path) -> None:
    fmu, drive = Importer(plane.content, tmp_path), Drive(PLANE, commanded=True)
    seen = [name for name in drive.channels if name not in ("step", "time")]
    assert fmu.start(speed_command=30.0) == OK
    drive.command(30.0)
    for k in range(60):
        if k in (20, 40):
            assert fmu.set("speed_command", 30.0 + k) == OK
            drive.command(30.0 + k)
        assert fmu.step(0.01 * k, 0.01) == OK and fmu.last.value == 0.01 * k + 0.01
        ours = drive.advance(10)
        assert np.array_equal(fmu.get(*seen), [ours[name][-1] for name in seen])
        assert fmu.get("whirl", "time").tolist() == [ours.whirl[-1], drive.time]
    assert fmu.call("Terminate") == OK


@needs_compiler
def test_it_follows_the_profile_tilts_and_goes_back(space: Fmu, tmp_path: Path) -> None:
    fmu, drive = Importer(space.content, tmp_path), Drive(SPACE)
    assert fmu.start(follow_profile=True) == OK
    assert fmu.step(0.0, 0.5) == OK
    ours = drive.advance(500)
    assert np.array_equal(fmu.get("x", "qy", "ball_3_angle"),
                          [ours[n][-1] for n in ("x", "qy", "ball_3_angle")])  # fmt: skip
    tilt = tilt_of(ours.turn)[-1]
    assert np.abs(tilt).min() > 1e-6
    np.testing.assert_allclose(fmu.get("alpha", "beta", "gamma"), tilt, rtol=0, atol=1e-14)
    kept = fmu.keep()
    assert fmu.step(0.5, 0.2) == OK
    once = fmu.get("x", "z", "angle")
    assert fmu.call("SetFMUState", kept) == OK
    assert fmu.get("time")[0] == 0.5
    assert fmu.step(0.5, 0.2) == OK
    assert np.array_equal(fmu.get("x", "z", "angle"), once)
    assert fmu.call("Reset") == OK
    assert fmu.get("time", "speed").tolist() == [0.0, SPACE.start.speed]


@needs_compiler
def test_parameters_are_set_before_and_while_it_runs(plane: Fmu, tmp_path: Path) -> None:
    fmu = Importer(plane.content, tmp_path)
    starts = {name: float(each["start"]) for name, each in fmu.variables.items()
              if "start" in each and name != "follow_profile"}  # fmt: skip
    assert fmu.get(*starts).tolist() == list(starts.values())
    stiffer = load_scene("thesis-hold", ["effects.rolling_friction=", "sensors.front={}",
                                         "effects.suspension.stiffness=1500"])  # fmt: skip
    drive = Drive(stiffer)
    assert fmu.start(suspension_stiffness=1500.0, follow_profile=True) == OK
    assert fmu.step(0.0, 0.2) == OK
    assert fmu.get("x")[0] == drive.advance(200)["x"][-1]
    assert fmu.get("suspension_stiffness")[0] == 1500.0
    assert fmu.set("suspension_stiffness", 1000.0) == OK
    softer = Drive(PLANE)
    softer.restore(drive.snapshot())
    assert fmu.step(0.2, 0.2) == OK
    assert fmu.get("x")[0] == softer.advance(200)["x"][-1]


@needs_compiler
def test_what_cannot_be_is_refused_and_said(plane: Fmu, tmp_path: Path) -> None:
    fmu = Importer(plane.content, tmp_path)
    assert fmu.step(0.0, 0.001) == ERROR  # not initialized
    assert fmu.set("x", 1.0) == ERROR and fmu.set("total_mass", float("nan")) == ERROR
    assert fmu.start(speed_command=100.0) == OK
    assert fmu.set("follow_profile", True) == ERROR  # not any more
    assert fmu.step(0.0, 0.0) == ERROR and fmu.step(0.0, float("nan")) == ERROR
    assert fmu.step(0.1, 0.001) == ERROR  # it is at 0
    assert fmu.call("EnterEventMode") == ERROR
    words = [
        "fmi3DoStep: must not be called", "cannot be set", "finite", "cannot be set",
        "communicationStepSize = 0 s: must be above 0", "communicationStepSize = nan s",
        "currentCommunicationPoint = 0.1", "fmi3EnterEventMode",
    ]  # fmt: skip
    assert [status for status, _ in fmu.said] == [ERROR] * len(words)
    for (_, text), expected in zip(fmu.said, words, strict=True):
        assert expected in text
    assert fmu.step(0.0, 0.1) == OK
    assert fmu.set("speed_command", 421.0) == OK
    assert fmu.step(0.1, 0.1) == WARNING and "within +-420" in fmu.said[-1][1]
    assert fmu.get("command")[0] == 100.0  # goes on as it was
    assert fmu.set("speed_command", 50.0) == OK and fmu.set("suspension_stiffness", 1e9) == OK
    assert fmu.step(0.2, 0.1) == ERROR and "beyond all bounds" in fmu.said[-1][1]
    assert 0.2 <= fmu.last.value < 0.3


@needs_compiler
def test_another_fmu_s_token_makes_no_instance(plane: Fmu, tmp_path: Path) -> None:
    fmu = Importer(plane.content, tmp_path, token="{of-another}")
    assert fmu.me is None and "instantiationToken" in fmu.said[0][1]


@needs_compiler
def test_a_master_may_add_up_its_step(tmp_path: Path) -> None:
    smooth = load_scene("thesis-hold", ["effects.rolling_friction=", "duration=1"])
    fmu = Importer(fmu_of(sources_of(smooth), "drive").content, tmp_path)
    assert fmu.start(speed_command=20.0) == OK
    assert fmu.step(0.0, 400.0) == OK
    summed = 400.0 + 3e-9  # the sum of 400,000 steps is as far as that from their product
    for k in range(3):
        assert fmu.step(summed + 0.001 * k, 0.001) == OK
    assert [status for status, _ in fmu.said] == [WARNING]
    assert "not as sums" in fmu.said[0][1]
    assert fmu.get("time")[0] == 400.003


@needs_compiler
def test_parameters_have_a_min_that_is_kept(plane: Fmu, tmp_path: Path) -> None:
    fmu = Importer(plane.content, tmp_path)
    for name in ("total_mass", "ball_mass[0]", "race_radius[1]", "suspension_stiffness",
                 "viscous_drag_coefficient"):  # fmt: skip
        assert float(fmu.variables[name]["min"]) == 0.0
        assert fmu.set(name, -1.0) == ERROR and "below its min, 0" in fmu.said[-1][1]
        assert fmu.get(name)[0] >= 0.0
    assert "min" not in fmu.variables["start_ball_angle[0]"]


def test_outputs_depend_on_no_input_at_once(plane: Fmu) -> None:
    root = Xml.fromstring(part(plane, "modelDescription.xml"))
    outputs = list(root.iter("Output"))
    assert outputs and all(each.attrib["dependencies"] == "" for each in outputs)


@pytest.fixture(scope="module")
def reference() -> CubicHermiteSpline:
    """Return x and ball 0's angle over time [s], from steps of 0.1 ms."""
    drive = Drive(PLANE.model_copy(update={"solver": Solver(stepper="rk8", step=1e-4)}),
                  commanded=True)  # fmt: skip
    drive.command(30.0)
    first = drive.advance(4975)
    drive.command(12.0)
    second = drive.advance(5025)
    time, x, vx, angle, rate = (
        np.concatenate([first[name], second[name]])
        for name in ("time", "x", "vx", "ball_0_angle", "ball_0_rate")
    )
    return CubicHermiteSpline(time, np.stack([x, angle], 1), np.stack([vx, rate], 1))


@needs_compiler
@pytest.mark.parametrize("start", [0.0, -1.0, 1e4, 1.7e9])
@pytest.mark.parametrize("master", ["products", "sums"])
def test_a_communication_step_may_have_any_length(
    master: str, start: float, plane: Fmu, reference: CubicHermiteSpline, tmp_path: Path
) -> None:
    for size in (1 / 60, 1 / 120, 1 / 3, 0.0015, 0.0101, 1 / 3000):
        fmu = Importer(plane.content, tmp_path / str(size))
        assert fmu.start(start, speed_command=30.0) == OK
        now, rows, count = start, [], int(0.49 / size)
        for k in range(1, count + 1):
            assert fmu.step(now, size) == OK
            now = now + size if master == "sums" else start + k * size
            assert fmu.last.value == pytest.approx(now, rel=1e-15)
            rows.append(fmu.get("x", "ball_0_angle", "speed"))
        time = size * np.arange(1, count + 1)
        x, angle, speed = np.transpose(rows)
        expected = reference(time)
        np.testing.assert_allclose(x, expected[:, 0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(angle, expected[:, 1], rtol=0, atol=1e-8)
        speeds = np.minimum(30.0, PLANE.spindle.max_acceleration * time)
        np.testing.assert_allclose(speed, speeds, rtol=1e-9)


@needs_compiler
def test_after_a_part_of_a_step_it_comes_back_to_whole_steps(plane: Fmu, tmp_path: Path) -> None:
    """And the state between two steps can be kept."""
    fmu, ours = Importer(plane.content, tmp_path), Drive(PLANE, commanded=True)
    assert fmu.start(speed_command=30.0) == OK
    ours.command(30.0)
    for k in range(2):
        assert fmu.step(k / 60, 1 / 60) == OK
    assert fmu.get("time")[0] == pytest.approx(1 / 30, rel=1e-15)
    kept = fmu.keep()
    assert fmu.step(2 / 60, 1 / 60) == OK
    once = fmu.get("time", "x", "front_1")
    assert fmu.call("SetFMUState", kept) == OK
    assert fmu.step(2 / 60, 1 / 60) == OK
    assert np.array_equal(fmu.get("time", "x", "front_1"), once)
    expected = ours.advance(50)
    assert once[0] == ours.time == 0.05
    np.testing.assert_allclose(once[1:], [expected["x"][-1], expected["front_1"][-1]], rtol=1e-9)


@needs_compiler
def test_a_command_between_two_steps_acts_at_once(
    plane: Fmu, reference: CubicHermiteSpline, tmp_path: Path
) -> None:
    fmu = Importer(plane.content, tmp_path)
    assert fmu.start(speed_command=30.0) == OK
    for k in range(400):
        if k == 199:
            assert fmu.set("speed_command", 12.0) == OK
        assert fmu.step(0.0025 * k, 0.0025) == OK
        x, angle = reference(0.0025 * (k + 1))
        assert fmu.get("x")[0] == pytest.approx(x, abs=1e-12)
        assert fmu.get("ball_0_angle")[0] == pytest.approx(angle, abs=1e-8)
