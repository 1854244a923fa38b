"""Declarations and tables of a scene in header and source, and its constants as struct fields."""

import ast
import inspect
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np

from ab_sim.drive.pickup import low_pass_of
from ab_sim.drive.trajectory import unit_of
from ab_sim.engine.kernels.constants import flattened
from ab_sim.export.c_code.templates import WIDTH, plain
from ab_sim.model.dynamics.assemble import active_segment
from ab_sim.model.dynamics.system import HEIGHT, MASS, RACE_RADIUS, RADIUS, System
from ab_sim.model.equations.mounts import MOUNT_UNITS
from ab_sim.model.equations.neighbours import start_angles
from ab_sim.model.spindle import RaisedCosine, Ramp, ScheduledSegment
from ab_sim.scene.model import Scene
from ab_sim.scene.registry import effect_parameters
from ab_sim.scene.sensors import Accelerometer, steps_per_sample
from ab_sim.tracing.c_text import c_literal

GIVEN = {
    "mass": ("ball_mass", MASS, "kg", "m of each ball"),
    "radius": ("ball_radius", RADIUS, "m", "a of each ball"),
    "race_radius": ("race_radius", RACE_RADIUS, "m", "R, of the circle of each ball's centre"),
    "height": ("race_height", HEIGHT, "m", "height of each ball's race along the shaft"),
}
"""Constants of the balls that the scene gives; further ones are derived from these.

By name in ``BallConstants``: name in C, column of ``System.balls``, unit, meaning.
"""


_NOT_NEGATIVE = ("kg", "N/m", "N s/m")
"""Units of quantities that must not be negative: masses, springs and dampers."""
_RADII = ("ball_radius", "race_radius")
"""Names of radii in C, which must not be negative either."""


class DriveParameter(NamedTuple):
    """Field of ``struct drive_parameters``."""

    name: str
    unit: str
    """Unit of all numbers of the field; empty if the units differ."""
    meaning: str
    values: np.ndarray
    """Numbers of the parameter; shape () for a single number."""
    inputs: tuple[str, ...]
    """Input of the model for each number; a single input for a constant of the balls."""
    units: tuple[str, ...] = ()
    """Units along the last axis of the values, if they differ."""
    is_start: bool = False
    """True if the parameter is used at the start only."""
    least: float | None = None
    """Lower bound that the parameter's effect states."""

    @property
    def is_of_balls(self) -> bool:
        """True if each ball has a value."""
        return self.is_start or self.inputs[0] in GIVEN

    @property
    def places(self) -> Iterator[tuple[str, float, str]]:
        """Yield the C text of the struct member, the value and the unit of each number."""
        for index in np.ndindex(self.values.shape):
            place = self.name + "".join(f"[{k}]" for k in index)
            unit = self.units[index[-1]] if self.units else self.unit
            yield place, float(self.values[index]), unit

    def minimum(self, unit: str) -> float | None:
        """Return the lower bound of a number with a unit; None if there is none."""
        return 0.0 if unit in _NOT_NEGATIVE or self.name in _RADII else self.least


def parameters_of(scene: Scene, system: System) -> list[DriveParameter]:
    """Return all fields of a scene's ``struct drive_parameters``: of deck, effects and balls."""
    deck, parameters = system.deck_model, list[DriveParameter]()
    for name, value in zip(deck._fields, deck, strict=True):
        inputs = tuple(input_ for input_, _ in flattened(value, f".0.{name}"))
        if inputs:  # a count or a choice has no inputs
            parameters.append(_of_deck(_docstrings_of(type(deck))[name], name, value, inputs))
    for k, (name, effect) in enumerate(scene.effects.items()):
        described = effect_parameters(type(effect))
        for field, value in zip(effect._fields, effect, strict=True):
            inputs = tuple(input_ for input_, _ in flattened(value, f".1.{k}.{field}"))
            if inputs:
                about, of = described[field], re.sub(r"\W", "_", name)
                parameters.append(
                    DriveParameter(
                        *(f"{of}_{field}", about.get("unit", "1"), about.get("description", "")),
                        *(np.asarray(value, float), inputs),
                        least=about.get("ge", about.get("exclusiveMinimum")),
                    )
                )
    for given_name, (name, column, unit, meaning) in GIVEN.items():
        parameters.append(
            DriveParameter(name, unit, meaning, system.balls[:, column], (given_name,))
        )
    return parameters


def start_of_balls(scene: Scene) -> DriveParameter:
    """Return the start angles of the balls, which are not a constant of the equations."""
    meaning = "start angle of each ball from the unbalance, set by drive_reset"
    values = np.array(start_angles(scene), float)
    return DriveParameter("start_ball_angle", "rad", meaning, values, (), is_start=True)


def _of_deck(about: str, name: str, value: Any, inputs: tuple[str, ...]) -> DriveParameter:
    """Return a parameter of the deck; unit and meaning are from the field's docstring ``about``."""
    values, unit = np.asarray(value, float), re.search(r"\[([^]]+)\]", about)
    if name == "mounts":
        meaning = (
            "each mount: position on deck axes [m], stiffness [N/m] and damping [N s/m] along its "
            "three axes; these axes in the ground's frame, one after the other"
        )
        return DriveParameter(name, "", meaning, values, inputs, MOUNT_UNITS)
    meaning = re.sub(r"\s*\[[^]]+\]", "", about).strip(" ,.")
    return DriveParameter(name, unit[1] if unit else "1", meaning, values, inputs)


def _docstrings_of(kind: type[Any]) -> dict[str, str]:
    """Return the docstrings of a class's fields.

    One docstring may document several fields before it.
    """
    docstrings, waiting = dict.fromkeys(kind._fields, ""), list[str]()
    try:
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    except OSError:  # defined at an interactive prompt
        return docstrings
    assert isinstance(body, ast.ClassDef)
    for node in body.body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            waiting.append(node.target.id)
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            text = inspect.cleandoc(str(node.value.value))
            docstrings |= {name: " ".join(text.split()) for name in waiting}
            waiting = []
    return docstrings


KINDS: dict[type[Any], str] = {Ramp: "ramp", RaisedCosine: "raised_cosine"}
"""Names in C of the speed laws of profile segments, by class."""
FIELDS = {
    "start_speed": ("rad/s", "speed at the start"),
    "slope": ("rad/s^2", "acceleration of a ramp"),
    "change": ("rad/s", "total change of speed of a raised cosine"),
    "duration": ("s", "duration of a raised cosine"),
}
"""Units and meanings of the fields of segments."""

CHANNELS = {
    "q": "quaternion from deck axes to axes fixed in space",
    "_rate": "rate of the angular velocity on deck axes",
    "w": "angular velocity of the deck on deck axes",
    "": "motion of the deck on axes fixed in space",
}
"""Meanings of the deck's channels, by a part of a channel's name; the first match counts."""


def indented(lines: Iterable[str]) -> str:
    """Return the lines of a C block as text, each indented by four spaces."""
    return "".join(f"    {line}\n" for line in lines)


def field(name: str, unit: str, about: str = "", shape: Sequence[str | int] = ()) -> str:
    """Return the declaration of a struct's field, after its comment if the comment is long.

    Parameters
    ----------
    name
        Name of the field.
    unit
        Unit of the values; "1" is left out.
    about
        Meaning of the field.
    shape
        Sizes of an array's axes.
    """
    size = "".join(f"[{size}]" for size in shape)
    words = plain(": ".join(part for part in (unit if unit != "1" else "", about) if part))
    line = f"double {name}{size};"
    if not words:
        return line
    if len(line) + len(words) < WIDTH - 10:
        return f"{line} /* {words} */"
    lines = wrap(words, WIDTH - 10)
    return "/* " + "\n     * ".join(lines) + f" */\n    {line}"


def declared(parameters: Sequence[DriveParameter]) -> Iterator[str]:
    """Yield the fields of ``struct drive_parameters``."""
    for parameter in parameters:
        shape: list[str | int] = list(parameter.values.shape)
        if parameter.is_of_balls:
            shape = ["DRIVE_BALLS"]
        yield field(parameter.name, parameter.unit, parameter.meaning, shape)


def initialised(parameters: Sequence[DriveParameter]) -> Iterator[str]:
    """Yield the initialisers of the fields of ``struct drive_parameters``."""
    for parameter in parameters:
        yield f".{parameter.name} = {_value_text(parameter.values)},"


def _value_text(values: np.ndarray) -> str:
    """Return an array as a C initialiser, with braces around each axis."""
    if values.ndim == 0:
        return number_text(float(values))
    return "{" + ", ".join(_value_text(part) for part in values) + "}"


def number_text(value: float) -> str:
    """Return a number as exact C text, with a decimal comment if it is hexadecimal."""
    text = c_literal(value)
    return f"{text} /* {value!r} */" if "0x" in text else text


class Output(NamedTuple):
    """Field of ``struct drive_outputs``."""

    name: str
    unit: str
    meaning: str
    shape: tuple[str, ...] = ()
    """Names in C of the sizes of an array's axes; empty for a single number."""


OF_BALLS, OF_SENSORS = ("DRIVE_BALLS",), ("DRIVE_SENSORS", "DRIVE_AXES")
"""Shapes of fields per ball and per sensor."""


def outputs(
    channels: Sequence[str], balls: int, sensors: Mapping[str, Accelerometer]
) -> Iterator[Output]:
    """Yield all outputs of a drive.

    Parameters
    ----------
    channels
        Channels of the deck.
    balls
        Number of balls.
    sensors
        Accelerometers by name.
    """
    yield Output("angle", "rad", "angle of the spindle, unwrapped")
    yield Output("speed", "rad/s", "speed of the spindle")
    yield Output("command", "rad/s", "commanded speed")
    for name in channels:
        yield Output(name, unit_of(name) or "1", next(CHANNELS[k] for k in CHANNELS if k in name))
    if balls:
        yield Output("ball_angle", "rad", "angle from the unbalance, unwrapped", OF_BALLS)
        yield Output("ball_rate", "rad/s", "rate relative to the race", OF_BALLS)
    if sensors:
        about = "readings of the accelerometers, by DRIVE_SENSOR_NAME, without noise"
        yield Output("readings", "m/s^2", about, OF_SENSORS)


def segments(scheduled: Sequence[ScheduledSegment]) -> Iterator[str]:
    """Yield the rows of the C table of a profile's segments."""
    for segment in scheduled:
        place = active_segment(segment)
        numbers: dict[str, Any] = {
            "start": segment.start,
            "end": segment.end,
            "start_angle": segment.start_angle,
            "phase": place.phase,
            **segment.law._asdict(),
        }
        numbers_by_name = {name: float(value) for name, value in numbers.items()}
        kind = KINDS[type(segment.law)].upper()
        values = [
            f".{name} = {c_literal(value)}"
            for name, value in numbers_by_name.items()
            if value != 0.0
        ]
        yield "{" + ", ".join([f".kind = {kind}", *values]) + "},"


def sensor_rows(
    sensors: Mapping[str, Accelerometer], step: float, starts: Mapping[str, np.ndarray]
) -> Iterator[str]:
    """Yield the rows of the C table of sensors.

    Parameters
    ----------
    sensors
        Sensors of the scene.
    step
        Integration step [s].
    starts
        Specific force at the start on each sensor's axes [m/s^2].
    """
    for name, sensor in sensors.items():
        numbers = [
            *(np.cos(sensor.axis_angle), np.sin(sensor.axis_angle)),
            *(sensor.range, sensor.resolution),
        ]
        every = steps_per_sample(sensor.sample_rate, step)
        chain = [*map(c_literal, map(float, numbers)), str(every)]
        chain += map(c_literal, low_pass_of(sensor, step))
        yield "{" + ", ".join(chain) + f", {_value_text(starts[name])}}}, /* {name} */"
