"""State and estimates of the adaptive start-up, for its callers."""

import enum
from typing import NamedTuple


class State(enum.IntEnum):
    """State of the start-up; the same numbers in C."""

    WAITING = 0
    RUN_UP = 1
    DWELL = 2
    TO_FINAL = 3
    JUDGING = 4
    RETRY = 5
    DONE = 6
    GAVE_UP = 7
    ABORTING = 8
    ABORTED = 9

    @property
    def text(self) -> str:
        """Name in lower case, with spaces."""
        return self.name.lower().replace("_", " ")

    @property
    def over(self) -> bool:
        """True if the start-up has ended; an abort may still follow `DONE` and `GAVE_UP`."""
        return self in (State.DONE, State.GAVE_UP, State.ABORTED)


class Estimates(NamedTuple):
    """Estimates of the drive's parameters; NaN while unknown."""

    critical_speed: float
    critical_speed_deviation: float
    """Critical speed and its standard deviation [rad/s]."""
    net_unbalance: complex
    """Offset of the rotor's centre of mass, balls included, from the shaft [m], on axes that turn
    with the spindle."""
    net_unbalance_deviation: float
    """Standard deviation of the net unbalance [m]."""
    without_balls: float
    """Largest magnitude of the net unbalance since the critical speed was known [m], the scale for
    comparison. It approximates the unbalance before balls moved, and is usually between one and two
    times the unbalance of the rotor alone."""
    dwells: int
    retries: int
    """Number of dwells and of retries so far."""


class Decision(NamedTuple):
    """Latest decision of the start-up."""

    number: int
    """Number of decisions so far, by which a caller recognises a new one."""
    text: str
    """State and reason in plain words."""
