"""Names of a drive's frames, which tf, messages and the URDF share (docs/topics.md)."""

import re

HOUSING = "drive_housing"
"""Frame fixed in space."""
DECK = "deck"
SPINDLE = "spindle"
"""Frame that turns with the disc; x points at the unbalance."""


def race_frame(number: int) -> str:
    """Return the name of a race's frame, which turns with the spindle, at the balls' height."""
    return f"race_{number}"


def ball_frame(number: int) -> str:
    """Return the name of a ball's frame, at its centre, x away from the shaft."""
    return f"ball_{number}"


def arm_frame(number: int) -> str:
    """Return the name of the frame on the shaft whose x axis points at a ball."""
    return f"{ball_frame(number)}_arm"


TAKEN = rf"{HOUSING}|{DECK}|{SPINDLE}|race_\d+|ball_\d+(_arm)?"
"""Regular expression of the names that are reserved for a drive's own frames."""


def is_taken(name: str) -> bool:
    """Return whether a name is reserved for a drive's own frames, so that no sensor may have it."""
    return re.fullmatch(TAKEN, name) is not None
