"""Declarations and tables of a scene in header and source, in addition to the equations."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np

from ab_sim.drive.sensing.pickup import low_pass_of
from ab_sim.drive.units import unit_of
from ab_sim.export.c_code.equations import KINDS
from ab_sim.export.c_code.parameters import DriveParameter
from ab_sim.export.c_code.templates import WIDTH, plain
from ab_sim.model.dynamics.assemble import place_on
from ab_sim.model.spindle import ScheduledSegment
from ab_sim.scene.sensors import Accelerometer, steps_per_sample
from ab_sim.tracing.c_text import c_literal

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
"""Meanings of a deck's channels, by the first part that their names contain."""


def indented(lines: Iterable[str]) -> str:
    """Return the lines of a block, each with its line end."""
    return "".join(f"    {line}\n" for line in lines)


def field(name: str, unit: str, about: str = "", shape: Sequence[str | int] = ()) -> str:
    """Return the declaration of a struct's field, after its comment if the comment is long.

    Args:
        name: name of the field.
        unit: unit of the values; "1" is left out.
        about: meaning of the field.
        shape: sizes of an array's axes.
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
        yield f".{parameter.name} = {value_text(parameter.values)},"


def value_text(values: np.ndarray) -> str:
    """Return an array as a C initialiser, with braces around each axis."""
    if values.ndim == 0:
        return number_text(float(values))
    return "{" + ", ".join(value_text(part) for part in values) + "}"


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


OF_BALLS, OF_SENSORS = ("DRIVE_BALLS",), ("DRIVE_SENSORS", "DRIVE_AXES")
"""Shapes of fields per ball and per sensor."""


def outputs(
    channels: Sequence[str], balls: int, sensors: Mapping[str, Accelerometer]
) -> Iterator[Output]:
    """Yield all outputs of a drive.

    Args:
        channels: channels of the deck.
        balls: number of balls.
        sensors: accelerometers by name.
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
        place = place_on(segment)
        numbers: dict[str, Any] = {
            "start": segment.start,
            "end": segment.end,
            "start_angle": segment.start_angle,
            "phase": place.phase,
            **segment.segment._asdict(),
        }
        numbers_by_name = {name: float(value) for name, value in numbers.items()}
        kind = KINDS[type(segment.segment)].upper()
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

    Args:
        sensors: sensors of the scene.
        step: integration step [s].
        starts: specific force at the start on each sensor's axes [m/s^2].
    """
    for name, sensor in sensors.items():
        numbers = [
            *(np.cos(sensor.axis_angle), np.sin(sensor.axis_angle)),
            *(sensor.range, sensor.resolution),
        ]
        every = steps_per_sample(sensor.sample_rate, step)
        chain = [*map(c_literal, map(float, numbers)), str(every)]
        chain += map(c_literal, low_pass_of(sensor, step))
        yield "{" + ", ".join(chain) + f", {value_text(starts[name])}}}, /* {name} */"
