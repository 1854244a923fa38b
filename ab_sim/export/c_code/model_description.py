"""XML files of an FMU: variables with units, and instructions to build its sources."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple
from xml.etree import ElementTree as Xml

import ab_sim
from ab_sim.export.c_code.declarations import OF_BALLS, OF_SENSORS, outputs
from ab_sim.export.c_code.sources import DriveSources
from ab_sim.export.c_code.templates import one_line
from ab_sim.scene.model import Scene

NEVER, EARLY, ALWAYS = range(3)
"""Times at which a variable may be set: never, until the FMU is initialized, always."""
BASE_UNITS = {
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
    attributes: dict[str, str]
    """Attributes of its element in the model description."""
    unit: str = ""
    kind: str = "Float64"


def variables_of(sources: DriveSources) -> list[Variable]:
    """Return all variables of an FMU, in the order of their value references."""
    return [*_given(sources), *_seen(sources)]


def _given(sources: DriveSources) -> Iterator[Variable]:
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
        *("follow_profile", "follow_profile", EARLY),
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
        when = EARLY if parameter.is_start else ALWAYS
        for place, value, unit in parameter.places:
            about = {"description": one_line(parameter.meaning), "start": repr(value)}
            least = parameter.minimum(unit)
            bound = {} if least is None else {"min": repr(float(least))}
            yield Variable(place, f"drive.p.{place}", when, kind | about | bound, unit)


def _seen(sources: DriveSources) -> Iterator[Variable]:
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


def model_description(
    scene: Scene, variables: Sequence[Variable], identifier: str, token: str
) -> bytes:
    """Return ``modelDescription.xml``."""
    root = Xml.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=one_line(scene.name),
        instantiationToken=token,
        description=one_line(scene.description) or "A drive with a ball balancer",
        generationTool=f"ab_sim {ab_sim.__version__}",
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
    for each_output in outputs:  # no dependencies: an input acts from the next step on
        Xml.SubElement(structure, "Output", valueReference=each_output, dependencies="")
    for each_output in outputs:
        Xml.SubElement(structure, "InitialUnknown", valueReference=each_output)
    return _text(root)


def build_description(identifier: str, files: Sequence[str]) -> bytes:
    """Return ``sources/buildDescription.xml``."""
    root = Xml.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = Xml.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    built = Xml.SubElement(configuration, "SourceFileSet", language="C99")
    for name in files:
        Xml.SubElement(built, "SourceFile", name=name)
    return _text(root)


def _units(root: Xml.Element, variables: Sequence[Variable]) -> None:
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
            if name not in BASE_UNITS or sign == 0 or not (power or "1").isdigit():
                return None
            for base, exponent in BASE_UNITS[name].items():
                exponents[base] += sign * exponent * int(power or 1)
    return {name: power for name, power in exponents.items() if power}


def _text(root: Xml.Element) -> bytes:
    Xml.indent(root)
    return bytes(Xml.tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"
