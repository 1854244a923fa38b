"""Interface of a profile in progress, common to all kinds of profiles; it does not need ROS."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol


class ProfileInputs(NamedTuple):
    """Measurements that a profile needs."""

    vibration: bool = False
    """True if a condition of the profile depends on the vibration."""
    sensor: str | None = None
    """Name of the sensor of which the profile needs every sample, with the spindle's angle; None if
    it needs no such sensor."""
    first_sensor: bool = True
    """True if ``sensor`` is the drive's first accelerometer, or its first probe."""
    probe: bool = False
    """True if ``sensor`` is a proximity probe."""


class ProfileExecution(Protocol):
    """A profile in progress. Times are by the caller's clock [s]."""

    first: float
    """Speed at which the profile begins [rad/s]."""

    @property
    def words(self) -> str:
        """Present action, as text."""

    @property
    def segment(self) -> tuple[int, int]:
        """Number of the present segment, from 1, and number of segments; zeros without segments."""

    @property
    def ended(self) -> bool:
        """True if the final speed is held from now on."""

    @property
    def reached(self) -> bool:
        """True if the profile has ended and reached its aim."""

    @property
    def failure(self) -> str:
        """Reason for an abort; empty if there is none."""

    @property
    def why(self) -> str:
        """Problem so far; empty if there is none."""

    @property
    def values(self) -> Mapping[str, str]:
        """Numbers for the diagnostics, units in the keys."""

    def begin(self, now: float) -> None:
        """Begin the profile now."""

    def command(self, now: float) -> float | None:
        """Run one period; return the speed to command now [rad/s], or None for no command."""

    def state(self) -> dict[str, Any]:
        """Return the complete state as JSON-able values."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a result of ``state``; an invalid one may raise any error."""
