"""Column mapping: a YAML file with the meaning of a table's columns."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError, model_validator

from ab_sim.base.errors import InputError, nearest, short
from ab_sim.base.numbers import number_in
from ab_sim.base.yaml_files import read_yaml_file
from ab_sim.identification.measured import ACCELERATION, DISPLACEMENT, UNITS
from ab_sim.scene.quantities import Section
from ab_sim.scene.units import has_unit, in_si

_SPELLINGS = {
    **dict.fromkeys((("1/min", "rad/s"), ("min^-1", "rad/s"), ("u/min", "rad/s")), "rpm"),
    **dict.fromkeys((("1/min.", "rad/s"), ("min-1", "rad/s"), ("upm", "rad/s")), "rpm"),
    **dict.fromkeys((("rpm", "rad/s"), ("r/min", "rad/s"), ("rev/min", "rad/s")), "rpm"),
    **dict.fromkeys((("g", "m/s^2"), ("gn", "m/s^2")), "g_0"),
    ("mg", "m/s^2"): "mg_0",
    ("m/s2", "m/s^2"): "m/s^2",
}
"""Pint's spelling of a unit, by the spelling of instruments in lower case and the SI unit."""
PAIRS = {DISPLACEMENT: ("x", "y"), ACCELERATION: ("ax", "ay")}
"""Columns of the deck's motion in recordings of ab_sim."""
AXES = (0.0, 1.5707963267948966)
"""Default directions of the first and second signal [rad]: the deck's x and y."""


class ColumnOf(Section):
    """Column, and the unit of its numbers."""

    column: str = Field(description="name of the column")
    unit: str | None = Field(
        default=None, description="unit of the numbers; default: that of the file, else SI"
    )


class SignalColumn(ColumnOf):
    """Column of a vibration signal, with the direction of its axis and the sensor's sensitivity."""

    direction: str | float | None = Field(
        default=None, description="angle of the axis from the deck's x, rad; default: x, then y"
    )
    sensitivity: str | None = Field(
        default=None,
        description="sensitivity of the sensor if the numbers are voltages or the like: 100 mV/g_0",
    )


class Keyphasor(Section):
    """Column with pulses of a mark on the spindle."""

    column: str = Field(description="name of the column")
    per_turn: int = Field(default=1, ge=1, description="pulses per turn")
    angle: str | float | None = Field(
        default=None, description="spindle angle at the first pulse, rad; default: fitted"
    )


class ColumnMapping(Section):
    """Meaning of a table's columns."""

    time: ColumnOf | None = Field(default=None, description="times of the samples")
    sampling: str | float | None = Field(
        default=None, description="sampling rate if there is no column of times, Hz"
    )
    speed: ColumnOf | None = Field(default=None, description="the spindle's speed, rad/s")
    angle: ColumnOf | None = Field(default=None, description="the spindle's angle, rad")
    keyphasor: Keyphasor | None = Field(
        default=None, description="pulses that give the spindle's angle instead"
    )
    signals: tuple[SignalColumn, ...] = Field(
        description="displacement or acceleration along one or two axes", min_length=1, max_length=2
    )
    kind: Literal["displacement", "acceleration"] | None = Field(
        default=None, description="quantity of the signals; default: that of their unit"
    )
    sensor: str | dict[str, Any] | None = Field(
        default=None,
        description="sensor that the signals passed: a sensor or probe of the scene, or its "
        "parameters, {bandwidth: 200}",
    )
    delay: str | float = Field(default=0.0, description="delay of the signals, s")
    free: tuple[Literal["gain", "bias", "delay", "disc_angle"], ...] = Field(
        default=(), description="unknown parameters of the recording, which are fitted"
    )
    balls: bool = Field(default=True, description="whether the balls were in the race")
    trial_mass: str | float = Field(
        default=0.0, description="mass clamped to the deck for this recording, kg"
    )
    at_rest: bool | None = Field(
        default=None,
        description="whether the recording begins at rest; default: if the spindle does",
    )

    @model_validator(mode="after")
    def _whole(self) -> "ColumnMapping":
        if (self.time is None) == (self.sampling is None):
            raise ValueError("give exactly one of time (a column) and sampling (a rate)")
        if self.speed is None and self.angle is None and self.keyphasor is None:
            raise ValueError("give speed, angle or keyphasor of the spindle: the fit follows it")
        if self.angle is not None and self.keyphasor is not None:
            raise ValueError("give angle or keyphasor, not both: each gives the spindle's angle")
        return self

    @property
    def kind_of_signals(self) -> str | None:
        """Acceleration or displacement, as stated or from the signals' unit; None if unknown."""
        if self.kind is not None:
            return self.kind
        for signal in self.signals:
            if signal.sensitivity is not None:
                return kind_of_unit(signal.sensitivity.rpartition("/")[2])
            if signal.unit is not None:
                return kind_of_unit(signal.unit)
        return None


def read_mapping_file(path: Path) -> ColumnMapping:
    """Read a mapping from a file.

    Raises
    ------
    InputError
        The file cannot be read or is no mapping; the message names the key and the allowed values.
    """
    try:
        raw = read_yaml_file(path)
    except OSError as error:
        raise InputError(f"--map {path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InputError(f"--map {path}: {error}") from error
    return mapping_of(raw, f"--map {path}")


def mapping_of(raw: Any, place: str) -> ColumnMapping:
    """Check plain values, as read from YAML, and return them as a mapping.

    Parameters
    ----------
    raw
        Plain values.
    place
        Origin of the values, for messages.

    Raises
    ------
    InputError
        See ``read_mapping_file``.
    """
    if not isinstance(raw, dict):
        raise InputError(f"{place}: must be a mapping with time, speed or angle, and signals")
    try:
        return ColumnMapping.model_validate(raw)
    except ValidationError as error:
        first_error = error.errors(include_url=False)[0]
        key = ".".join(map(str, first_error["loc"]))
        if first_error["type"] == "extra_forbidden":
            last = str(first_error["loc"][-1])
            raise InputError(
                f"{place}: {key}: there is no such key{nearest(last, ColumnMapping.model_fields)}"
            ) from None
        what = first_error["msg"].removeprefix("Value error, ")
        value = "" if not key else f" = {short(first_error['input'])}"
        raise InputError(f"{place}: {key or 'it'}{value}: {what}") from None


def kind_of_unit(unit: str) -> str | None:
    """Return the quantity that a unit measures: displacement or acceleration, None for others."""
    for kind, units in UNITS.items():
        if unit == units:
            return kind
        try:
            in_si(f"1 {_spelled(unit, units)}", units)
        except ValueError:
            continue
        return kind
    return None


def _spelled(unit: str, si: str) -> str:
    """Return pint's spelling of a unit for a quantity with the SI unit ``si``."""
    return _SPELLINGS.get((unit.strip().lower(), si), unit.strip())


def sensitivity_factor(sensitivity: str, unit: str | None, si: str, name: str) -> float:
    """Return the factor from a sensor's output to SI.

    Parameters
    ----------
    sensitivity
        Output per measured quantity, such as ``100 mV/g_0``.
    unit
        Unit of the output; None for that of the sensitivity.
    si
        SI unit of the measured quantity.
    name
        Key of the mapping, for messages.

    Raises
    ------
    InputError
        The text has another form, or does not fit the units.
    """
    output, slash, measured = sensitivity.rpartition("/")
    number, _, output_unit = output.strip().partition(" ")
    place = f"{name}.sensitivity = {short(sensitivity)}"
    try:
        size = number_in(number)
    except ValueError:
        size = 0.0
    if not slash or not output_unit or not math.isfinite(size) or size == 0.0:
        raise InputError(f"{place}: must be like 100 mV/g_0 or 8 mV/um, and not 0")
    per = factor_of(measured.strip(), si, place)
    return per / size * (1.0 if unit is None else factor_of(unit, output_unit.strip(), place))


def factor_of(unit: str | None, si: str, place: str) -> float:
    """Return the factor from a unit to SI.

    Parameters
    ----------
    unit
        Unit of the numbers; None if they are in SI.
    si
        SI unit of the quantity.
    place
        Recording and key of the mapping, for messages.

    Raises
    ------
    InputError
        The unit does not fit the quantity.
    """
    if unit is None or unit == si:
        return 1.0
    try:
        return in_si(f"1 {_spelled(unit, si)}", si)
    except ValueError as error:
        raise InputError(f"{place}: unit {unit!r} {error}") from None


def number_of(value: str | float, si: str, place: str) -> float:
    """Return a number in SI, from a number or a text with a unit.

    Parameters
    ----------
    value
        Number in SI, or text with or without a unit.
    si
        SI unit of the quantity.
    place
        Recording and key of the mapping, for messages.

    Raises
    ------
    InputError
        The text is not a number, or its unit does not fit.
    """
    if isinstance(value, str):
        try:
            return in_si(value, si) if has_unit(value) else number_in(value)
        except ValueError as error:
            why = error if has_unit(value) else f"must be a number, in {si} or with a unit"
            raise InputError(f"{place} = {short(value)}: {why}") from None
    return float(value)


def pair_of(signal: str) -> tuple[str, str]:
    """Return the names of a signal's two columns in recordings of ab_sim."""
    return PAIRS.get(signal, (f"{signal}_1", f"{signal}_2"))


def usual_mapping(
    names: Sequence[str], sensors: Sequence[str], probes: Sequence[str], wanted: str | None
) -> ColumnMapping | str:
    """Return the mapping of a table with ab_sim's columns, or a text that states why there is none.

    Parameters
    ----------
    names
        Names of the columns.
    sensors
        Accelerometers with columns in the table.
    probes
        Displacement probes with columns in the table.
    wanted
        ``DISPLACEMENT``, ``ACCELERATION``, or a sensor's name; None selects the first sensor, else
        the first probe, else the displacement.
    """
    lacking = [name for name in ("time", "speed") if name not in names]
    if lacking:
        return f"it has no column {' and '.join(lacking)}"
    if wanted is None:
        usual = DISPLACEMENT if "x" in names else ACCELERATION
        wanted = next(iter((*sensors, *probes)), usual)
    pair = pair_of(wanted)
    if not {*pair} <= {*names}:
        signals = (*PAIRS, *sensors, *probes)
        if wanted not in signals:
            return f"signal {short(wanted)}: must be one of {', '.join(signals)}"
        return f"it has no columns {pair[0]} and {pair[1]} for the signal {wanted!r}"
    kind = DISPLACEMENT if wanted in (DISPLACEMENT, *probes) else ACCELERATION
    return ColumnMapping.model_validate(
        {
            "time": {"column": "time"},
            "speed": {"column": "speed"},
            "angle": {"column": "angle"} if "angle" in names else None,
            "signals": [{"column": name, "unit": UNITS[kind]} for name in pair],
            "kind": kind,
            "sensor": wanted if wanted in (*sensors, *probes) else None,
        }
    )
