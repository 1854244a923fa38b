"""What a profile under way tells who runs it, whatever kind of profile it is; no ROS."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol


class Hears(NamedTuple):
    """The topics that a profile needs."""

    vibration: bool = False
    sensor: str | None = None
    """Name of that of which it needs every sample, and the spindle's angle to it."""
    first_sensor: bool = True
    """Whether that is the drive's first accelerometer, or its first probe."""
    probe: bool = False
    """Whether it is a proximity probe."""


class Believed(NamedTuple):
    """What an adaptive start-up believes of the drive; NaN: it does not know."""

    critical_speed: float = math.nan
    critical_speed_deviation: float = math.nan
    """rad/s; the second is a standard deviation."""
    net_unbalance: float = math.nan
    net_unbalance_deviation: float = math.nan
    """m: offset of the rotor's mass centre, balls included."""


class Course(Protocol):
    """A profile under way. Times are of the clock of who runs it [s]."""

    first: float
    """The speed at which it begins [rad/s]."""

    @property
    def words(self) -> str:
        """What it does, for people."""

    @property
    def segment(self) -> tuple[int, int]:
        """Number of the present segment, from 1, and of segments; zeros if it has none."""

    @property
    def ended(self) -> bool:
        """Whether the final speed is held from now on."""

    @property
    def reached(self) -> bool:
        """Whether it has ended, and come to what it is for."""

    @property
    def failure(self) -> str:
        """Why it has to be aborted; empty while it need not be."""

    @property
    def why(self) -> str:
        """What did not go well; empty as long as all does."""

    @property
    def values(self) -> Mapping[str, str]:
        """Numbers for the diagnostics, units in the keys."""

    @property
    def believed(self) -> Believed:
        """What it believes of the drive."""

    def begin(self, now: float) -> None:
        """It begins now."""

    def command(self, now: float) -> float | None:
        """Decide, once a period; the speed that is commanded now [rad/s], None: nothing is."""

    def state(self) -> dict[str, Any]:
        """All that it needs to go on, as JSON-able values."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from what ``state`` gave; may raise whatever a value that is none of its causes."""
