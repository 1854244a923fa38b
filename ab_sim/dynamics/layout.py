"""Where in the state a quantity lies: the only file that knows.

A state is a flat array: the deck's own states; theta_0 .. theta_n-1 [rad]; theta_0' .. [rad/s];
with a motor psi [rad], w [rad/s] and the speed loop's integral [rad]; with an energy balance the
motor's work and the energy dissipated [J].
"""

import functools
from typing import NamedTuple

from ab_sim.dynamics.system import System, has_motor

MOTOR_NAMES = ("spindle angle", "spindle speed", "speed loop's integral")
ENERGY_BALANCE_NAMES = ("motor work", "energy dissipated")


class StateLayout(NamedTuple):
    """Where quantities lie in a system's state, for Python."""

    names: tuple[str, ...]
    """Of all states."""
    deck: slice
    """The deck model's own states, see its class."""
    angles: slice
    """theta_i."""
    rates: slice
    """theta_i'."""
    spindle: slice
    """psi, w and the speed loop's integral; empty without a motor."""
    energy_balance: slice
    """Motor work and energy dissipated; empty without an energy balance."""

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.names)


def layout_of(system: System) -> StateLayout:
    """Where quantities lie in the state of a system."""
    own, n = type(system.deck_model).STATE_NAMES, len(system.balls)
    return _layout(own, n, bool(has_motor(system.effects)), bool(system.energy_balance))


@functools.lru_cache
def _layout(own: tuple[str, ...], n: int, motor: bool, energy_balance: bool) -> StateLayout:
    names = [*own, *(f"ball_{i} angle" for i in range(n)), *(f"ball_{i} rate" for i in range(n))]
    angles, rates = slice(len(own), len(own) + n), slice(len(own) + n, len(names))
    names += MOTOR_NAMES if motor else ()
    spindle = slice(rates.stop, len(names))
    names += ENERGY_BALANCE_NAMES if energy_balance else ()
    return StateLayout(
        tuple(names), slice(0, len(own)), angles, rates, spindle, slice(spindle.stop, len(names))
    )
