"""Plane of two parameters of a scene, each over a range."""

import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.held_speed import FASTEST
from ab_sim.base.errors import InputError, exact
from ab_sim.base.numbers import number_in, whole_number_in
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene
from ab_sim.scene.registry import effect_classes, effect_parameters

SPEED = "speed"
"""Key of the spindle speed [rad/s], which is constant and not part of the scene."""
COUNT = 200
"""Default number of values along an axis."""
MOST = 2000
"""Largest number of values along an axis."""

IDLE = ("accuracy", "duration", "probes", "profile", "sensors", "solver", "start")
"""Sections of a scene that do not affect resting states."""


class Axis(NamedTuple):
    """Axis of a map: a scene parameter or the speed, with its values."""

    key: str
    """Dotted key, as in ``--set``, or ``speed``."""
    values: tuple[float, ...]
    """Evenly spaced values, at least two, in SI units."""


def axis(key: str, first: float, last: float, count: int = COUNT) -> Axis:
    """Return evenly spaced values of a parameter.

    Parameters
    ----------
    key
        Dotted key of a scene, e.g. ``effects.suspension.damping``, or ``speed``.
    first, last
        End values, in either order; finite and different.
    count
        Number of values, from 2 to 2000.

    Raises
    ------
    InputError
        An argument is invalid; the message names the key, the value and the allowed range.
    """
    for end in (first, last):
        if not math.isfinite(end):
            raise InputError(f"{key}: from {first!r} to {last!r}: must be finite numbers")
        if key == SPEED and abs(end) > FASTEST:
            raise InputError(f"speed = {exact(end)} rad/s: must be within +-{FASTEST:g}")
    if first == last:
        raise InputError(f"{key}: from {exact(first)} to {exact(last)}: the two ends must differ")
    if not 2 <= count <= MOST:
        raise InputError(f"{key}: {count} values: must be from 2 to {MOST}")
    return Axis(key, tuple(float(value) for value in np.linspace(first, last, count)))


def axes_of(text: str) -> tuple[Axis, Axis]:
    """Return the axes across and up of ``KEY=FROM:TO[:COUNT],KEY=FROM:TO[:COUNT]``.

    Raises
    ------
    InputError
        The text is invalid.
    """
    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(
            f"map {text!r}: must be two of KEY=FROM:TO[:COUNT] with a comma between, e.g. "
            "speed=50:300,effects.suspension.damping=0.1:4"
        )
    across, up = (_axis_of(part.strip()) for part in parts)
    if across.key == up.key:
        raise InputError(f"map {text!r}: {up.key} is named twice; a map needs two parameters")
    return across, up


def _axis_of(text: str) -> Axis:
    """Parse ``KEY=FROM:TO[:COUNT]`` to an axis.

    Raises
    ------
    InputError
        The text is invalid.
    """
    key, equals, range_ = text.partition("=")
    numbers = range_.split(":")
    wrong = InputError(
        f"map {text!r}: must be KEY=FROM:TO or KEY=FROM:TO:COUNT with numbers, e.g. "
        "speed=50:300:200"
    )
    if not equals or not key.strip() or len(numbers) not in (2, 3):
        raise wrong
    try:
        first, last = (number_in(number) for number in numbers[:2])
        count = whole_number_in(numbers[2]) if len(numbers) == 3 else COUNT
    except ValueError:
        raise wrong from None
    return axis(key.strip(), first, last, count)


class Plane(NamedTuple):
    """Scene, speed and the two axes of a map."""

    scene: Scene
    speed: float
    """Spindle speed [rad/s], if it is not one of the axes."""
    across: Axis
    """Parameter of the columns."""
    up: Axis
    """Parameter of the rows."""

    @property
    def titles(self) -> tuple[str, str]:
        """Titles of the axes, across and up, with units."""
        across, up = (_titled(self.scene, axis.key) for axis in (self.across, self.up))
        return across, up

    @property
    def units(self) -> tuple[str | None, str | None]:
        """Units of the axes, across and up; None for a value without a unit."""
        across, up = (_unit_of(self.scene, axis.key) for axis in (self.across, self.up))
        return across, up

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows (values up) and columns (values across)."""
        return len(self.up.values), len(self.across.values)

    def at(self, row: int, column: int) -> tuple[Scene, float]:
        """Return the scene of a point, and its speed [rad/s].

        Parameters
        ----------
        row
            Index of the value up; negative ones count from the end.
        column
            Index of the value across.

        Raises
        ------
        SceneError
            The values give no valid scene; the message names key and value.
        """
        values: dict[str, Any] = {
            self.across.key: _plain(self.across.values[column]),
            self.up.key: _plain(self.up.values[row]),
        }
        speed = values.pop(SPEED, self.speed)
        text = ", ".join(f"{key} = {value!r}" for key, value in values.items())
        changed = changed_scene(self.scene, values, f"map, at {text}") if values else self.scene
        return changed, float(speed)

    def check(self) -> None:
        """Refuse a plane that cannot be mapped before anything is computed.

        Raises
        ------
        InputError
            A key does not affect resting states.
        SceneError
            A corner gives no valid scene.
        """
        for axis in (self.across, self.up):
            if axis.key.partition(".")[0] in IDLE:
                raise InputError(
                    f"--map {axis.key}: does not affect where balls rest; map a value of rotor, "
                    "race, balls or effects, or the speed"
                )
        for row in (0, -1):
            for column in (0, -1):
                self.at(row, column)


def _titled(scene: Scene, key: str) -> str:
    """Return a parameter's title for an axis, with its unit in brackets."""
    if key == SPEED:
        return "spindle speed [rad/s]"
    unit = _unit_of(scene, key)
    return key if unit is None else f"{key} [{unit}]"


def _unit_of(scene: Scene, key: str) -> str | None:
    """Return the SI unit of a dotted key or of ``SPEED``; None if it has none."""
    if key == SPEED:
        return "rad/s"
    *sections, last = key.split(".")
    about: Any
    if sections[:1] == ["effects"]:
        about = effect_parameters(effect_classes()[sections[1]]).get(last, {})
    else:
        holder: Any = scene
        for name in sections:
            holder = getattr(holder, name, None)
        field = getattr(type(holder), "model_fields", {}).get(last)
        about = (field and field.json_schema_extra) or {}
    return about.get("unit")


def _plain(value: float) -> float | int:
    """Return whole numbers as int, because counts accept no other type."""
    return int(value) if value.is_integer() else value
