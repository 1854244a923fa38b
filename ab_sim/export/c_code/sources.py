"""C sources of a scene's drive: check of the scene, texts from templates, writing of files.

Either all files are written or none, and files of other origin are not replaced.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import InputError, SceneError, exact
from ab_sim.base.files import check_can_be_made, replacing
from ab_sim.base.version import __version__
from ab_sim.drive import Drive
from ab_sim.drive.observation import RowReader
from ab_sim.engine.integrate.choose import (
    Choice,
    choose_stepper,
    largest_step,
    step_limiting_rates,
    top_speed,
)
from ab_sim.engine.integrate.registry import stepper_named
from ab_sim.engine.kernels.runge_kutta import Tableau
from ab_sim.export.c_code.declarations import (
    FIELDS,
    DriveParameter,
    declared,
    field,
    indented,
    initialised,
    outputs,
    parameters_of,
    segments,
    sensor_rows,
    start_of_balls,
)
from ab_sim.export.c_code.equations import Equations, equations_of, step_of
from ab_sim.export.c_code.templates import comment, filled, in_html, in_markdown, plain
from ab_sim.model.dynamics.assemble import linear_rates, start_state, state_bounds, system_of
from ab_sim.model.dynamics.system import System, eventful, layout_of
from ab_sim.model.spindle import RaisedCosine, Ramp, SpeedSchedule
from ab_sim.scene.model import Scene
from ab_sim.tracing.c_text import REPEATED, SUMS, c_literal


def _suitable(scene: Scene) -> tuple[System, Choice]:
    """Return a scene's system and stepper, if it can be converted to C.

    Parameters
    ----------
    scene
        Scene to convert.

    Raises
    ------
    SceneError
        The scene has effects with events, probes, an accuracy, or a profile that depends on
        measurements (one message names all of these); or its method is not explicit; or its step is
        too long at ``spindle.max_speed``, the limit of commands.
    """
    refusals = list(_refusals(scene))
    if len(refusals) == 1:
        raise SceneError(refusals[0].why)
    if refusals:
        reasons = "; ".join(f"({n}) {refusal.why}" for n, refusal in enumerate(refusals, 1))
        options = " ".join(refusal.options for refusal in refusals)
        raise SceneError(f"{len(refusals)} reasons: {reasons}; without all of them: {options}")
    system = system_of(scene)
    choice = choose_stepper(scene, system, top_speed(scene))
    _check_explicit(scene, system, choice)
    try:
        _check_explicit(scene, system, choose_stepper(scene, system, scene.spindle.max_speed))
    except SceneError as error:
        raise SceneError(
            f"{error} (C takes commands up to spindle.max_speed = "
            f"{exact(scene.spindle.max_speed)} rad/s; lower that, or the step)"
        ) from None
    return system, choice


class _Refusal(NamedTuple):
    """Property of a scene that C does not support."""

    why: str
    """Reason of the refusal with a remedy."""
    options: str
    """Options of the command that remove the cause."""


def _refusals(scene: Scene) -> Iterator[_Refusal]:
    """Yield the refusals that do not need the scene's system."""
    if effects_with_events := eventful(scene.effects):
        named = ", ".join(f"{name} ({what})" for name, what in effects_with_events.items())
        leave_out = " ".join(f"--set effects.{name}=" for name in effects_with_events)
        yield _Refusal(
            f"effects: {named}: C has no location of events, which these need; leave them out "
            f"({leave_out}) if what you test does not depend on them, or run this scene by ab-sim "
            "(ab-sim live, ab_sim.Drive)",
            leave_out,
        )
    if scene.probes:
        yield _Refusal(
            f"probes: {', '.join(scene.probes)}: C has accelerometers only; leave them out (--set "
            "probes=), its outputs have the displacement itself",
            "--set probes=",
        )
    if scene.accuracy is not None:
        options = "--set accuracy= --set solver.stepper=rk8 --set solver.step=0.001"
        yield _Refusal(
            "accuracy: C takes steps of a fixed length by an explicit method; name them instead: "
            + options,
            options,
        )
    if scene.is_controlled:
        try:
            SpeedSchedule.of_scene(scene)
        except SceneError as error:
            yield _Refusal(str(error), "--set profile=")


def _check_explicit(scene: Scene, system: System, choice: Choice) -> None:
    """Refuse a method that is not explicit; the message names a step at which rk8 is stable."""
    if isinstance(choice.stepper.weights, Tableau):
        return
    usual = stepper_named("rk8")
    rates = step_limiting_rates(usual, linear_rates(system, scene.spindle.max_speed))
    longest, what = largest_step(usual, rates)
    # Rounded down to one digit.
    step = min(scene.solver.step, 10.0 ** math.floor(math.log10(min(longest, 1.0))))
    step *= max(1.0, math.floor(min(longest, scene.solver.step) / step))
    raise SceneError(
        f"solver.stepper = {scene.solver.stepper!r}: is {choice.stepper.name} here "
        f"({choice.reason}), but exported C needs an explicit method; rk8 takes steps of at most "
        f"{longest:.3g} s because of {what}: --set solver.stepper=rk8 --set solver.step={step:g}"
    )


NAMES = ("drive.h", "drive.c", "main.c", "drive_check.c", "CMakeLists.txt", "README.md")
"""Names of the files that are written."""
_README = NAMES[-1]
MARK = "Made by `ab-sim c`"
"""Mark in the first line of every written file; only files with this mark are replaced."""
_CHECKED = (500, 300, 200)
"""Numbers of steps after which states are compared: along the profile, then after two commands."""


class DriveSources(NamedTuple):
    """C sources of a drive, with the data from which they were written."""

    files: dict[str, str]
    """Text of each file by its name."""
    scene: Scene
    parameters: tuple[DriveParameter, ...]
    """Parameters that the code uses."""
    channels: tuple[str, ...]
    """Names of the channels that describe the deck's motion."""
    choice: Choice
    """Stepper, and the reason why it was chosen."""
    made_by: str
    """First line of each file."""
    title: str


class _Content(NamedTuple):
    """Data from which the C sources are written."""

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
    kinds = {type(scheduled.law) for scheduled in schedule.segments}
    return [kind for kind in (Ramp, RaisedCosine) if kind is Ramp or kind in kinds]


def sources_of(scene: Scene) -> DriveSources:
    """Return a scene's drive as C99 files.

    Raises
    ------
    SceneError
        The scene cannot be converted to C, see ``_suitable``.
    """
    system, choice = _suitable(scene)
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
    texts = {name: filled(name, values, flags) for name in NAMES if name != _README}
    texts[_README] = filled(_README, values | _in_readme(scene, values), flags)
    return DriveSources(
        texts, scene, tuple(used), tuple(channels), choice, values["MADE_BY"], values["TITLE"]
    )


def _flags(drive: _Content) -> dict[str, bool]:
    """Return the flags that select the optional lines of the templates."""
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
        "MADE_BY": f"{MARK} of ab_sim {__version__}, of the scene {plain(scene.name)}.",
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
    """Return the values that README.md escapes differently."""
    return {"MADE_BY": in_html(values["MADE_BY"]), "SCENE": in_markdown(scene.name)}


def _in_header(drive: _Content) -> dict[str, str]:
    """Return the values of drive.h."""
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
    """Return the values of drive.c."""
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
        "SENSORS": indented(sensor_rows(scene.sensors, step, _forces_at_start(drive))),
        "ANGLES": str(layout.angles.start),
        "QUATERNION": str(deck.UNIT_AT),
        "START_ANGLE": c_literal(scene.start.angle),
        "START_SPEED": c_literal(scene.start.speed),
    }


def _rows(numbers: np.ndarray, names: Sequence[str]) -> str:
    """Return the rows of a C array: one number per row, with its name as a comment."""
    return indented(
        f"{c_literal(float(x))}, /* {name} */" for x, name in zip(numbers, names, strict=True)
    )


def _title(scene: Scene) -> str:
    n = scene.balls.count
    return f"A drive with {n or 'no'} ball{'s' * (n != 1)}."


def _about(scene: Scene, choice: Choice) -> list[str]:
    """Return the paragraphs of the header's comment on scene, stepper and sensors."""
    lines = [scene.description] if scene.description else []
    lines += [f"Source: {scene.source}"] if scene.source else []
    lines.append(f"Stepper: {choice.stepper.name}, {choice.reason}.")
    if scene.sensors:
        lines.append("Accelerometers have low-pass, range, resolution and rate, but no noise.")
    return lines


def _effects(scene: Scene) -> str:
    """Return a comment with equation and source of each effect."""
    about = (
        f"{name}: {effect.equation} ({effect.source})" for name, effect in scene.effects.items()
    )
    return comment(*about)


def _forces_at_start(drive: _Content) -> dict[str, np.ndarray]:
    """Return the specific force at each sensor at the start, on the sensor's axes [m/s^2]."""
    pickups = RowReader(drive.scene, drive.system).pickups
    return {name: pickup.state.force for name, pickup in pickups.items()}


def _expected(scene: Scene) -> str:
    """Return the rows of the table of ``drive_check.c``: states that ab_sim computes."""
    drive, rows = Drive(scene), []
    top = scene.spindle.max_speed
    for steps, command in zip(_CHECKED, (math.nan, 0.5 * top, 0.25 * top), strict=True):
        if not math.isnan(command):
            drive.command(command)
        drive.advance(steps)
        state = ", ".join(c_literal(x) for x in drive.snapshot().state.tolist())
        rows.append(f"{{{steps}, {c_literal(command)}, {{{state}}}}},")
    return indented(rows)


def check_output(folder: Path, names: list[str], option: str) -> None:
    """Refuse a folder that is not writable, or has a file of these names that ab_sim did not write.

    Parameters
    ----------
    folder
        Folder to write to.
    names
        Names of the files to write.
    option
        Name of the folder in messages, e.g. ``--out``.

    Raises
    ------
    InputError
        The folder cannot be used; the message states the reason.
    """
    check_can_be_made(folder, option)
    for name in names:
        file = folder / name
        if file.is_dir() or (file.exists() and MARK not in _first_line(file)):
            raise InputError(
                f"{option} {folder}: has a {name} that ab-sim did not write; name another folder, "
                "e.g. a new one"
            )


def write_sources(sources: DriveSources, folder: Path, option: str) -> list[Path]:
    """Write a drive's files to a folder, which is created if missing; return their paths.

    Parameters
    ----------
    sources
        Files to write.
    folder
        Folder to write to.
    option
        Name of the folder in messages.

    Raises
    ------
    InputError
        The folder cannot be used or a file cannot be written; nothing has changed.
    """
    check_output(folder, list(sources.files), option)
    try:
        with ExitStack() as unfinished:
            for name, text in sources.files.items():
                file = unfinished.enter_context(replacing(folder / name))
                file.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(f"{option} {folder}: cannot be written: {error.strerror}") from error
    return [folder / name for name in sources.files]


def _first_line(file: Path) -> str:
    with file.open(encoding="utf-8", errors="replace") as opened:
        return opened.readline(1000)
