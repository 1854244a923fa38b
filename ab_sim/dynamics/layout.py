"""Where in the state a quantity lies: the only file that knows.

A state is a flat array: the deck's own states; theta_0 .. theta_n-1 [rad]; theta_0' .. [rad/s];
with a motor psi [rad], w [rad/s] and the speed loop's integral [rad]; with a ledger the motor's
work and the energy dissipated [J].
"""

import functools
from typing import NamedTuple

from ab_sim.dynamics.system import System, ball_count, has_motor

MOTOR_NAMES = ("spindle angle", "spindle speed", "speed loop's integral")
LEDGER_NAMES = ("motor work", "energy dissipated")


class Layout(NamedTuple):
    """Where quantities lie in a system's state, for Python."""

    names: tuple[str, ...]
    """Of all states."""
    carrier: slice
    """The carrier's own states, see its class."""
    angles: slice
    """theta_i."""
    rates: slice
    """theta_i'."""
    spindle: slice
    """psi, w and the speed loop's integral; empty without a motor."""
    ledger: slice
    """Motor work and energy dissipated; empty without a ledger."""

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.names)


def layout_of(system: System) -> Layout:
    """Where quantities lie in the state of a system."""
    own, n = type(system.carrier).STATE_NAMES, ball_count(system)
    return _layout(own, n, bool(has_motor(system.effects)), bool(system.ledger))


@functools.lru_cache
def _layout(own: tuple[str, ...], n: int, motor: bool, ledger: bool) -> Layout:
    names = [*own, *(f"ball_{i} angle" for i in range(n)), *(f"ball_{i} rate" for i in range(n))]
    angles, rates = slice(len(own), len(own) + n), slice(len(own) + n, len(names))
    names += MOTOR_NAMES if motor else ()
    spindle = slice(rates.stop, len(names))
    names += LEDGER_NAMES if ledger else ()
    return Layout(
        tuple(names), slice(0, len(own)), angles, rates, spindle, slice(spindle.stop, len(names))
    )
