"""Header and source of a scene's drive, an example and a check, from templates."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

import ab_sim
from ab_sim.drive import Drive
from ab_sim.drive.rows import RowReader
from ab_sim.engine.integrate.choose import Choice
from ab_sim.export.c_code.declarations import (
    FIELDS,
    declared,
    field,
    indented,
    initialised,
    outputs,
    segments,
    sensor_rows,
)
from ab_sim.export.c_code.equations import Equations, equations_of, step_of
from ab_sim.export.c_code.parameters import DriveParameter, parameters_of, start_of_balls
from ab_sim.export.c_code.suitable import suitable
from ab_sim.export.c_code.templates import comment, filled, in_html, in_markdown, plain
from ab_sim.model.dynamics.assemble import start_state, state_bounds
from ab_sim.model.dynamics.layout import layout_of
from ab_sim.model.dynamics.system import System
from ab_sim.model.spindle import RaisedCosine, Ramp, SpeedSchedule
from ab_sim.scene.model import Scene
from ab_sim.tracing.c_text import REPEATED, SUMS, c_literal

NAMES = ("drive.h", "drive.c", "main.c", "drive_check.c", "CMakeLists.txt", "README.md")
"""Names of the files."""
README = NAMES[-1]
MARK = "Made by `ab-sim c`"
"""Mark in the first line of every written file; only files with this mark are replaced."""
CHECKED = (500, 300, 200)
"""Numbers of steps after which states are compared: along the profile, then after two commands."""


class DriveSources(NamedTuple):
    """C sources of a drive, with the data from which they were written."""

    files: dict[str, str]
    """Text of each file by its name."""
    scene: Scene
    parameters: tuple[DriveParameter, ...]
    """Parameters that the code uses."""
    channels: tuple[str, ...]
    """Channels of the deck."""
    choice: Choice
    """Stepper and the reason of its choice."""
    made_by: str
    """First line of each file."""
    title: str


class _Content(NamedTuple):
    """Data from which the texts are written."""

    scene: Scene
    system: System
    choice: Choice
    schedule: SpeedSchedule
    parameters: Sequence[DriveParameter]
    equations: Equations
    channels: Sequence[str]

    @property
    def kinds(self) -> list[type[Any]]:
        return kinds_of(self.schedule)


def kinds_of(schedule: SpeedSchedule) -> list[type[Any]]:
    """Return the kinds of a schedule's segments; ramps are included, because commands need them."""
    kinds = {type(scheduled.segment) for scheduled in schedule.segments}
    return [kind for kind in (Ramp, RaisedCosine) if kind is Ramp or kind in kinds]


def sources_of(scene: Scene) -> DriveSources:
    """Return a scene's drive as C99 files.

    Raises:
        SceneError: the scene cannot be converted to C, see ``suitable``.
    """
    system, choice = suitable(scene)
    schedule = SpeedSchedule.of_scene(scene)
    channels = type(system.deck_model).CHANNELS
    parameters = parameters_of(scene, system)
    equations = equations_of(system, parameters, kinds_of(schedule), channels, scene.sensors)
    used = [parameter for parameter in parameters if equations.used & set(parameter.inputs)]
    if scene.balls.count:
        used.append(start_of_balls(scene))
    parts = _Content(scene, system, choice, schedule, used, equations, channels)
    values = _values(parts)
    flags = _flags(parts)
    texts = {name: filled(name, values, flags) for name in NAMES if name != README}
    texts[README] = filled(README, values | _in_readme(scene, values), flags)
    return DriveSources(
        texts, scene, tuple(used), tuple(channels), choice, values["MADE_BY"], values["TITLE"]
    )


def _flags(drive: _Content) -> dict[str, bool]:
    equations = drive.equations
    return {
        "balls": len(drive.system.balls) > 0,
        "columns": bool(equations.columns),
        "derived": equations.derived > 0,
        "ball_derived": equations.ball_derived > 0,
        "sensors": bool(drive.scene.sensors),
        "quaternion": type(drive.system.deck_model).UNIT_AT >= 0,
        "cosine": RaisedCosine in drive.kinds,
    }


def _values(drive: _Content) -> dict[str, str]:
    """Return the values for templates by name."""
    scene, step = drive.scene, drive.scene.solver.step
    about = {
        "MADE_BY": f"{MARK} of ab_sim {ab_sim.__version__}, of the scene {plain(scene.name)}.",
        "TITLE": _title(scene),
        "STEP_SHORT": f"{step:g}",
        "STEPPER": f"{drive.choice.stepper.name}, order {drive.choice.stepper.order}",
        "LIMITS": "Accelerometers have no noise; add it if needed." if scene.sensors else "",
        "ACTS": ", ".join(scene.effects) or "none, only inertia",
        "SECONDS": f"{scene.duration:g}",
        "EVERY": str(max(1, round(0.01 / step))),
        "EXPECTED": _expected(scene),
    }
    return about | _in_header(drive) | _in_source(drive)


def _in_readme(scene: Scene, values: Mapping[str, str]) -> dict[str, str]:
    return {"MADE_BY": in_html(values["MADE_BY"]), "SCENE": in_markdown(scene.name)}


def _in_header(drive: _Content) -> dict[str, str]:
    scene, equations, layout = drive.scene, drive.equations, layout_of(drive.system)
    segment_fields = dict.fromkeys(name for kind in drive.kinds for name in kind._fields)
    names = [f"DRIVE_SENSOR_{name.upper()}" for name in scene.sensors]
    sensor_names = f"enum {{ {', '.join([*names, 'DRIVE_SENSORS'])} }}; /* accelerometers */\n"
    return {
        "ABOUT": comment(*_about(scene, drive.choice)),
        # Decimal with all bits, because C++ accepts hexadecimal numbers only from C++17 on.
        "STEP": repr(scene.solver.step),
        "MAX_SPEED": repr(scene.spindle.max_speed),
        "MAX_ACCELERATION": repr(scene.spindle.max_acceleration),
        "BALLS": str(len(drive.system.balls)),
        "STATES": str(layout.size),
        "AXES": str(type(drive.system.deck_model).AXES),
        "SEGMENTS": str(max(2, len(drive.schedule.segments))),
        "SENSOR_NAMES": sensor_names if scene.sensors else "",
        "PARAMETERS": indented(declared(drive.parameters)),
        "OUTPUTS": indented(
            field(*output) for output in outputs(drive.channels, scene.balls.count, scene.sensors)
        ),
        "SEGMENT_FIELDS": indented(field(name, *FIELDS[name]) for name in segment_fields),
        "COLUMNS": indented(field(name, "", "", ["DRIVE_BALLS"]) for name in equations.columns),
        "STATE_NAMES": ", ".join(layout.names),
        "DERIVED": str(equations.derived),
        "BALL_DERIVED": str(equations.ball_derived),
    }


def _in_source(drive: _Content) -> dict[str, str]:
    scene, system, text = drive.scene, drive.system, drive.equations.text
    deck, layout, stepper = type(system.deck_model), layout_of(system), drive.choice.stepper
    n, step = len(system.balls), scene.solver.step
    sums = SUMS + (REPEATED if "repeated(" in text else "")
    return {
        "PARAMETER_VALUES": indented(initialised(drive.parameters)),
        "START": _rows(start_state(scene, system), layout.names),
        "BOUNDS": _rows(state_bounds(system, step / stepper.parts), layout.names),
        "PROFILE": indented(segments(drive.schedule.segments)),
        "SUMS": sums if n else "",
        "SOURCES": deck.__module__.replace(".", "/") + ".py",
        "EFFECTS": _effects(scene),
        "EQUATIONS": text,
        "STEPPER_SOURCE": stepper.source,
        "RUNGE_KUTTA": step_of(stepper.weights),
        "CYCLE": c_literal(drive.choice.cycle),
        "SENSORS": indented(sensor_rows(scene.sensors, step, _felt_at_start(drive))),
        "ANGLES": str(layout.angles.start),
        "QUATERNION": str(deck.UNIT_AT),
        "START_ANGLE": c_literal(scene.start.angle),
        "START_SPEED": c_literal(scene.start.speed),
    }


def _rows(numbers: np.ndarray, names: Sequence[str]) -> str:
    return indented(
        f"{c_literal(float(x))}, /* {name} */" for x, name in zip(numbers, names, strict=True)
    )


def _title(scene: Scene) -> str:
    n = scene.balls.count
    return f"A drive with {n or 'no'} ball{'s' * (n != 1)}."


def _about(scene: Scene, choice: Choice) -> list[str]:
    lines = [scene.description] if scene.description else []
    lines += [f"Source: {scene.source}"] if scene.source else []
    lines.append(f"Stepper: {choice.stepper.name}, {choice.reason}.")
    if scene.sensors:
        lines.append("Accelerometers have low-pass, range, resolution and rate, but no noise.")
    return lines


def _effects(scene: Scene) -> str:
    about = (
        f"{name}: {effect.equation} ({effect.source})" for name, effect in scene.effects.items()
    )
    return comment(*about)


def _felt_at_start(drive: _Content) -> dict[str, np.ndarray]:
    """Return the specific force of sensors at the start, on their own axes [m/s^2]."""
    pickups = RowReader(drive.scene, drive.system).pickups
    return {name: pickup.state.force for name, pickup in pickups.items()}


def _expected(scene: Scene) -> str:
    """Return the rows of the table of ``drive_check.c``: states that ab_sim computes."""
    drive, rows = Drive(scene), []
    top = scene.spindle.max_speed
    for steps, command in zip(CHECKED, (math.nan, 0.5 * top, 0.25 * top), strict=True):
        if not math.isnan(command):
            drive.command(command)
        drive.advance(steps)
        state = ", ".join(c_literal(x) for x in drive.snapshot().state.tolist())
        rows.append(f"{{{steps}, {c_literal(command)}, {{{state}}}}},")
    return indented(rows)
