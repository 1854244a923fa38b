"""The option ``--speed``: of the spindle, held."""

from ab_sim.analysis.held_speed import FASTEST
from ab_sim.errors import InputError


def check_speed(speed: float) -> float:
    """The same [rad/s].

    Raises:
        InputError: no number, or too fast.
    """
    if not abs(speed) <= FASTEST:
        raise InputError(f"--speed {speed}: must be a number within +-{FASTEST:g} rad/s")
    return speed
