"""Names of a drive's frames, which tf, messages and the URDF share (docs/topics.md)."""

import re

HOUSING = "drive_housing"
"""Fixed in space."""
DECK = "deck"
SPINDLE = "spindle"
"""Turns with the disc; x points at the unbalance."""


def race_frame(number: int) -> str:
    """Of a race: turns with the spindle, in the plane of the balls' centres."""
    return f"race_{number}"


def ball_frame(number: int) -> str:
    """Of a ball: at its centre, x away from the shaft."""
    return f"ball_{number}"


def arm_frame(number: int) -> str:
    """On the shaft, x towards a ball."""
    return f"{ball_frame(number)}_arm"


TAKEN = rf"{HOUSING}|{DECK}|{SPINDLE}|race_\d+|ball_\d+(_arm)?"
"""Names of frames that a drive may have already, as a regular expression."""


def is_taken(name: str) -> bool:
    """Whether a drive may have a frame of this name already, so that no sensor's can have it."""
    return re.fullmatch(TAKEN, name) is not None
