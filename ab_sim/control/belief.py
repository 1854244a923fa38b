"""What the adaptive start-up does and believes, as its callers see it."""

import enum
from typing import NamedTuple


class State(enum.IntEnum):
    """What it is doing; the same numbers in C."""

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
        """In lower case, with spaces."""
        return self.name.lower().replace("_", " ")

    @property
    def over(self) -> bool:
        """Whether nothing more will be decided."""
        return self in (State.DONE, State.GAVE_UP, State.ABORTED)


class Belief(NamedTuple):
    """What it believes of the drive; NaN while it does not know."""

    critical_speed: float
    critical_speed_deviation: float
    """rad/s; the second is a standard deviation."""
    net_unbalance: complex
    """Offset of the rotor's centre of mass, balls included, from the shaft [m], on axes that turn
    with the spindle."""
    net_unbalance_deviation: float
    """m; a standard deviation."""
    without_balls: float
    """The largest its magnitude has been since the critical speed was known [m]: the scale that it
    is compared with. It stands for the unbalance before balls moved, and is rarely below that of
    the rotor alone, or above twice that."""
    dwells: int
    retries: int
    """How many so far."""


class Decision(NamedTuple):
    """The latest change of mind."""

    number: int
    """How many there were so far: a caller that keeps it says each once."""
    text: str
