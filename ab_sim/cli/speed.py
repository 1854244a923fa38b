"""The option ``--speed``: constant speed of the spindle."""

from ab_sim.analysis.held_speed import FASTEST
from ab_sim.errors import InputError


def check_speed(speed: float) -> float:
    """Check a speed and return it [rad/s].

    Raises:
        InputError: not a number, or too fast.
    """
    if not abs(speed) <= FASTEST:
        raise InputError(f"--speed {speed}: must be a number within +-{FASTEST:g} rad/s")
    return speed
