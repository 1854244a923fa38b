"""Drive as an FMU of FMI 3.0 for co-simulation: descriptions, sources, binary, and archive."""

import hashlib
import io
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Iterator, Sequence
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as Xml

from ab_sim.base.errors import InputError
from ab_sim.base.files import write_whole
from ab_sim.base.version import __version__
from ab_sim.export.c_code.declarations import OF_BALLS, OF_SENSORS, outputs
from ab_sim.export.c_code.sources import DriveSources
from ab_sim.export.c_code.templates import filled, in_html, one_line
from ab_sim.scene.model import Scene

NEVER, _EARLY, ALWAYS = range(3)
"""Times at which a variable may be set: never, until the FMU is initialized, always."""
_BASE_UNITS = {
    "N": {"kg": 1, "m": 1, "s": -2},
    **{name: {name: 1} for name in ("kg", "m", "s", "rad")},
    "1": {},
}
"""Exponents of FMI's base units by unit."""


class Variable(NamedTuple):
    """Variable of the FMU; its value reference is its index among all variables."""

    name: str
    place: str
    """Member of ``struct fmu_state`` in C."""
    settable: int
    """Phase in which importers may set the variable: ``NEVER``, ``_EARLY`` or ``ALWAYS``."""
    attributes: dict[str, str]
    """Attributes of the variable's XML element in the model description."""
    unit: str = ""
    kind: str = "Float64"


def _variables_of(sources: DriveSources) -> list[Variable]:
    """Return all variables of an FMU, in the order of their value references."""
    return [*_inputs(sources), *_outputs(sources)]


def _inputs(sources: DriveSources) -> Iterator[Variable]:
    """Yield time, command, limit of acceleration, choice of the profile, and all parameters."""
    scene = sources.scene
    top, steepest = scene.spindle.max_speed, scene.spindle.max_acceleration
    independent = {"causality": "independent", "variability": "continuous"}
    yield Variable("time", "time", NEVER, independent, "s")
    yield Variable(
        *("speed_command", "speed_command", ALWAYS),
        {
            "causality": "input",
            "description": "commanded speed, unless follow_profile is true",
            **{"min": repr(-top), "max": repr(top), "start": repr(scene.start.speed)},
        },
        "rad/s",
    )
    tunable = {"causality": "parameter", "variability": "tunable"}
    yield Variable(
        *("acceleration", "acceleration", ALWAYS),
        {
            **tunable,
            "description": "acceleration towards a commanded speed",
            **{"min": "0.0", "max": repr(steepest), "start": repr(steepest)},
        },
        "rad/s^2",
    )
    yield Variable(
        *("follow_profile", "follow_profile", _EARLY),
        {
            **tunable,
            "variability": "fixed",
            "description": "follow the scene's speed profile instead of speed_command",
            "start": "false",
        },
        kind="Boolean",
    )
    for parameter in sources.parameters:
        kind = {**tunable, "variability": "fixed"} if parameter.is_start else tunable
        when = _EARLY if parameter.is_start else ALWAYS
        for place, value, unit in parameter.places:
            about = {"description": one_line(parameter.meaning), "start": repr(value)}
            least = parameter.minimum(unit)
            bound = {} if least is None else {"min": repr(float(least))}
            yield Variable(place, f"drive.p.{place}", when, kind | about | bound, unit)


def _outputs(sources: DriveSources) -> Iterator[Variable]:
    """Yield a variable for each number of ``struct drive_outputs``, whirl and tilt."""
    scene, channels = sources.scene, sources.channels

    def variable(name: str, place: str, unit: str, about: str) -> Variable:
        described = {"causality": "output", "description": about}
        return Variable(name, place, NEVER, described, unit)

    for name, unit, about, shape in outputs(channels, scene.balls.count, scene.sensors):
        place = f"drive.out.{name}"
        if shape == OF_BALLS:
            for i in range(scene.balls.count):
                one = name.replace("ball", f"ball_{i}")
                yield variable(one, f"{place}[{i}]", unit, about)
        elif shape == OF_SENSORS:
            for k, sensor in enumerate(scene.sensors):
                for axis in range(3 if "z" in channels else 2):
                    one, at = f"{sensor}_{axis + 1}", f"{place}[{k}][{axis}]"
                    yield variable(one, at, unit, "reading without noise")
        else:
            yield variable(name, place, unit, about)
    yield variable("whirl", "whirl", "m", "sqrt(x^2 + y^2)")
    if "qw" in channels:
        for k, name in enumerate(("alpha", "beta", "gamma")):
            about = "deck angle in Rz(gamma) Rx(alpha) Ry(beta)"
            yield variable(name, f"tilt[{k}]", "rad", about)


def _model_description(
    scene: Scene, variables: Sequence[Variable], identifier: str, token: str
) -> bytes:
    """Return the content of ``modelDescription.xml``.

    Parameters
    ----------
    scene
        Scene of the drive.
    variables
        Variables in the order of their value references.
    identifier
        Name of the model, a C identifier.
    token
        Instantiation token, which the binary compares with its own.
    """
    root = Xml.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=one_line(scene.name),
        instantiationToken=token,
        description=one_line(scene.description) or "A drive with a ball balancer",
        generationTool=f"ab_sim {__version__}",
    )
    Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
        canHandleVariableCommunicationStepSize="true",
        fixedInternalStepSize=repr(scene.solver.step),
    )
    _units(root, variables)
    categories = Xml.SubElement(root, "LogCategories")
    Xml.SubElement(categories, "Category", name="logStatusError", description="Errors")
    Xml.SubElement(
        root,
        "DefaultExperiment",
        startTime="0.0",
        stopTime=repr(scene.duration),
        stepSize=repr(scene.solver.step),
    )
    listed = Xml.SubElement(root, "ModelVariables")
    structure = Xml.SubElement(root, "ModelStructure")
    outputs = []
    for reference, variable in enumerate(variables):
        first = {"name": variable.name, "valueReference": str(reference)}
        unit = {"unit": variable.unit} if variable.unit else {}
        Xml.SubElement(listed, variable.kind, first | variable.attributes | unit)
        if variable.attributes["causality"] == "output":
            outputs.append(str(reference))
    for output in outputs:  # no dependencies: an input acts from the next step on
        Xml.SubElement(structure, "Output", valueReference=output, dependencies="")
    for output in outputs:
        Xml.SubElement(structure, "InitialUnknown", valueReference=output)
    return _text(root)


def _build_description(identifier: str, files: Sequence[str]) -> bytes:
    """Return the content of ``sources/buildDescription.xml``, which lists the C files."""
    root = Xml.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = Xml.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    built = Xml.SubElement(configuration, "SourceFileSet", language="C99")
    for name in files:
        Xml.SubElement(built, "SourceFile", name=name)
    return _text(root)


def _units(root: Xml.Element, variables: Sequence[Variable]) -> None:
    """Add the definitions of all units to a model description."""
    defined = Xml.SubElement(root, "UnitDefinitions")
    for unit in sorted({variable.unit for variable in variables if variable.unit}):
        unit_element, exponents = Xml.SubElement(defined, "Unit", name=unit), base_units(unit)
        if exponents is not None:
            Xml.SubElement(
                unit_element, "BaseUnit", {base: str(n) for base, n in exponents.items()}
            )


def base_units(unit: str) -> dict[str, int] | None:
    """Return exponents of FMI's base units for a unit such as ``N s/m^2``; None if impossible."""
    exponents: Counter[str] = Counter()
    for sign, part in zip((1, -1, 0), unit.split("/"), strict=False):
        for word in part.split():
            name, _, power = word.partition("^")
            if name not in _BASE_UNITS or sign == 0 or not (power or "1").isdigit():
                return None
            for base, exponent in _BASE_UNITS[name].items():
                exponents[base] += sign * exponent * int(power or 1)
    return {name: power for name, power in exponents.items() if power}


def _text(root: Xml.Element) -> bytes:
    """Return an XML document as indented UTF-8 text."""
    Xml.indent(root)
    return bytes(Xml.tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"


_HEADERS = files("ab_sim.export.c_code") / "fmi_headers"
"""Folder of the standard's headers (2-clause BSD licence)."""
_HEADER_NAMES = ("fmi3PlatformTypes.h", "fmi3FunctionTypes.h", "fmi3Functions.h")
_EXTRA = "extra/org.fmi-standard"
"""Folder of FMI's headers in an FMU; not among the sources, as importers have these headers."""
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden", "-shared", "-fPIC")
_FUNCTION = re.compile(r"typedef\s+fmi3Status\s+(fmi3\w+)TYPE\s*\(([^;]*)\);")
_PRIVATE = re.compile(
    r"\bdrive_(init|reset|follow_profile|command|command_ramp|step|step_part|update|time|whirl|tilt)\b"
)
"""Pattern of the functions of drive.h."""


class Fmu(NamedTuple):
    """Complete FMU."""

    content: bytes
    """Content of the file."""
    binary: str | None
    """Platform of the binary; None if there is no binary."""
    variables: tuple[Variable, ...]


def fmu_of(sources: DriveSources, identifier: str) -> Fmu:
    """Return the FMU of a drive.

    Parameters
    ----------
    sources
        Sources of the drive.
    identifier
        Name of the model, a C identifier.

    Raises
    ------
    InputError
        The C compiler fails.
    """
    variables, machine = _variables_of(sources), _platform_tuple()
    drive = {name: sources.files[name] for name in ("drive.h", "drive.c")}
    token = "{" + hashlib.sha256("".join(drive.values()).encode()).hexdigest()[:32] + "}"
    values = {
        "MADE_BY": sources.made_by,
        "TITLE": sources.title,
        "IDENTIFIER": identifier,
        "TOKEN": token,
        "VARIABLES": "".join(_rows(variables)),
        "FOLLOW_PROFILE": str([variable.name for variable in variables].index("follow_profile")),
        "PLATFORM": machine,
        "LIBRARY": _LIBRARY,
    }
    flags = {"quaternion": "qw" in sources.channels}
    text = filled("fmu.c", {**values, "UNSUPPORTED": ""}, flags)
    values["UNSUPPORTED"] = "\n".join(_unsupported(text))
    renamed = drive | {"fmu.c": filled("fmu.c", values, flags)}
    # Prefixed names, because several FMUs may be linked into one program.
    renamed = {
        name: _PRIVATE.sub(rf"{identifier}_drive_\1", text) for name, text in renamed.items()
    }
    binary = _binary(renamed)
    documentation = filled("fmu.html", values | {"MADE_BY": in_html(values["MADE_BY"])}, flags)
    content = {
        "modelDescription.xml": _model_description(sources.scene, variables, identifier, token),
        "sources/buildDescription.xml": _build_description(identifier, ["drive.c", "fmu.c"]),
        **{f"sources/{name}": text.encode() for name, text in renamed.items()},
        **{f"{_EXTRA}/{name}": (_HEADERS / name).read_bytes() for name in _HEADER_NAMES},
        "documentation/index.html": documentation.encode(),
    }
    if binary is not None:
        content[f"binaries/{machine}/{identifier}{_LIBRARY}"] = binary
    return Fmu(_zipped(content), None if binary is None else machine, tuple(variables))


def write_fmu(sources: DriveSources, file: Path, option: str) -> Fmu:
    """Write a drive's FMU and return it.

    Parameters
    ----------
    sources
        Sources of the drive.
    file
        File to write.
    option
        Name of the file in messages.

    Raises
    ------
    InputError
        The C compiler fails, or the file cannot be written; nothing has changed.
    """
    content = fmu_of(sources, identifier_of(file.stem))
    try:
        write_whole(file, content.content)
    except OSError as error:
        raise InputError(f"{option} {file}: cannot be written: {error.strerror}") from error
    return content


def identifier_of(name: str) -> str:
    """Convert a file's name to a C identifier."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if re.match("[A-Za-z]", plain) else f"drive_{plain}"


_LIBRARY = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")
"""File name extension of shared libraries on this system, as FMI requires."""


def _platform_tuple() -> str:
    """Return FMI's name of this platform, such as ``x86_64-linux``: the folder of the library."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(
        platform.machine().lower(), platform.machine().lower()
    )
    return f"{machine}-{platform.system().lower()}"


def _rows(variables: list[Variable]) -> Iterator[str]:
    """Yield the rows of the table of variables in fmu.c."""
    for reference, variable in enumerate(variables):
        values = f"{reference}, {variable.settable}, AT({variable.place}), {_least(variable)}"
        yield f"    {{{values}}}, /* {variable.name} */\n"


def _least(variable: Variable) -> str:
    """Return a constant's smallest accepted value in C; -INFINITY for all other variables."""
    is_constant = variable.place.startswith("drive.p.") and "min" in variable.attributes
    return variable.attributes["min"] if is_constant else "-INFINITY"


def _unsupported(text: str) -> Iterator[str]:
    """Yield a function that fails for each function of the standard that the text lacks."""
    for name, arguments in _FUNCTION.findall(
        (_HEADERS / _HEADER_NAMES[1]).read_text(encoding="utf-8")
    ):
        if f"\nfmi3Status {name}(" in text:
            continue
        parameters = [" ".join(one.split()) for one in arguments.split(",")]
        unused = [re.sub(r"\[\]$", "", one).rpartition(" ")[2].lstrip("*") for one in parameters]
        void = ", ".join(f"(void){word}" for word in unused if word != "instance")
        yield (
            f"fmi3Status {name}({', '.join(parameters)})\n{{\n"
            + (f"    {void};\n" if void else "")
            + f'    return unsupported(instance, "{name}");\n}}\n'
        )


def _binary(sources: dict[str, str]) -> bytes | None:
    """Compile the shared library; return None without a C compiler.

    Raises
    ------
    InputError
        The compiler fails.
    """
    compiler = shutil.which("cc")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory(prefix="ab_sim-fmu-") as name:
        folder = Path(name)
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8", newline="\n")
        for file in _HEADER_NAMES:
            (folder / file).write_bytes((_HEADERS / file).read_bytes())
        words = [compiler, *FLAGS, "drive.c", "fmu.c", "-o", "fmu", "-lm"]
        result = subprocess.run(
            words, cwd=folder, capture_output=True, encoding="utf-8", errors="replace"
        )
        if result.returncode:
            message = next((line for line in result.stderr.splitlines() if "error" in line), "")
            raise InputError(
                f"{compiler}: cannot build the FMU's binary: {message or result.stderr.strip()}; "
                "repair the compiler, or hide it from PATH for an FMU of sources alone"
            )
        return (folder / "fmu").read_bytes()


def _zipped(content: dict[str, bytes]) -> bytes:
    """Return a ZIP archive that depends only on the content, not on times."""
    archive_bytes = io.BytesIO()
    with zipfile.ZipFile(archive_bytes, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            info = zipfile.ZipInfo(name)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = (0o755 if name.endswith(_LIBRARY) else 0o644) << 16
            archive.writestr(info, data)
    return archive_bytes.getvalue()
