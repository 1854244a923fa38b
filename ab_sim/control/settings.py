"""Settings of the adaptive start-up: the drive's limits and its sensor."""

import math
from typing import Literal, NamedTuple

from ab_sim.base.errors import InputError, exact

Quantity = Literal["displacement", "acceleration"]
_QUANTITIES: tuple[Quantity, ...] = ("displacement", "acceleration")


class SensorFacts(NamedTuple):
    """Properties of the vibration sensor on the deck."""

    quantity: Quantity
    """Quantity of a reading: displacement [m] or acceleration [m/s^2]."""
    axes: int
    """Number of readings per sample: 1, or 2 on axes 90 degrees apart."""
    axis_angle: float = 0.0
    """Angle of the first axis from the deck's x axis, to which the spindle's angle 0 points
    [rad]."""
    noise: float = 0.0
    """Standard deviation of a reading [m or m/s^2]; 0: unknown, it is estimated."""


class StartUpSettings(NamedTuple):
    """Settings of the start-up: limits and sensor of the drive, and limits for giving up."""

    final_speed: float
    """Final speed, above the critical speed [rad/s]."""
    acceleration: float
    """Largest rate of change of the commanded speed [rad/s^2]."""
    sensing: SensorFacts
    period: float
    """Time between two calls of ``StartUp.command`` [s]."""
    most_retries: int = 8
    """Largest number of retries after the first passage of the critical speed; after them the
    start-up ends unbalanced at the final speed."""
    patience: float = 14.5
    """Time after the start beyond which no further retry begins [s]."""
    silence: float = 0.5
    """Time without a valid sample after which the start-up is aborted [s]."""
    limit: float = math.inf
    """Largest magnitude of a reading [m or m/s^2]; a larger one aborts the start-up."""


def checked(settings: StartUpSettings) -> StartUpSettings:
    """Return settings if they are valid.

    Raises
    ------
    InputError
        A setting is invalid; the message names field, value and allowed range.
    """
    sensing = settings.sensing
    if sensing.quantity not in _QUANTITIES:
        _refuse("sensing.quantity", repr(sensing.quantity), "'displacement' or 'acceleration'")
    if sensing.axes not in (1, 2):
        _refuse("sensing.axes", repr(sensing.axes), "1 or 2")
    _within("sensing.axis_angle", sensing.axis_angle, -2.0 * math.pi, 2.0 * math.pi, "rad")
    _within("sensing.noise", sensing.noise, 0.0, 1e6, "of the reading's unit")
    _within("final_speed", settings.final_speed, 1.0, 1e5, "rad/s")
    _within("acceleration", settings.acceleration, 1e-2, 1e6, "rad/s^2")
    _within("period", settings.period, 1e-5, 0.1, "s")
    if settings.most_retries not in range(101):
        _refuse("most_retries", repr(settings.most_retries), "a whole number from 0 to 100")
    _within("patience", settings.patience, 0.0, 1e4, "s")
    _within("silence", settings.silence, settings.period, 1e2, "s")
    if not settings.limit > 0.0:
        _refuse("limit", exact(settings.limit), "more than 0, or inf for none")
    return settings


def _within(field: str, value: float, least: float, most: float, unit: str) -> None:
    if not least <= value <= most:  # NaN fails, too
        _refuse(field, exact(value), f"from {least:g} to {most:g} {unit}")


def _refuse(field: str, value: str, allowed: str) -> None:
    raise InputError(f"{field} = {value}: must be {allowed}")
