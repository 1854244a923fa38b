"""Positions of quantities in the state vector, defined only here."""

import functools
from typing import NamedTuple

from ab_sim.model.dynamics.system import System, has_motor

MOTOR_NAMES = ("spindle angle", "spindle speed", "speed loop's integral")
ENERGY_BALANCE_NAMES = ("motor work", "energy dissipated")


class StateLayout(NamedTuple):
    """Positions of quantities in a system's state, for Python."""

    names: tuple[str, ...]
    """Names of all states."""
    deck: slice
    """The deck model's own states, see its class."""
    angles: slice
    """Positions of theta_i."""
    rates: slice
    """Positions of theta_i'."""
    spindle: slice
    """Positions of psi, w and the speed loop's integral; empty without a motor."""
    energy_balance: slice
    """Positions of motor work and dissipated energy; empty without an energy balance."""

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.names)


def layout_of(system: System) -> StateLayout:
    """Return the positions of quantities in the state of a system."""
    deck_names, n = type(system.deck_model).STATE_NAMES, len(system.balls)
    return _layout(deck_names, n, bool(has_motor(system.effects)), bool(system.energy_balance))


@functools.lru_cache
def _layout(deck_names: tuple[str, ...], n: int, motor: bool, energy_balance: bool) -> StateLayout:
    names = [
        *deck_names,
        *(f"ball_{i} angle" for i in range(n)),
        *(f"ball_{i} rate" for i in range(n)),
    ]
    angles, rates = (
        slice(len(deck_names), len(deck_names) + n),
        slice(len(deck_names) + n, len(names)),
    )
    names += MOTOR_NAMES if motor else ()
    spindle = slice(rates.stop, len(names))
    names += ENERGY_BALANCE_NAMES if energy_balance else ()
    return StateLayout(
        tuple(names),
        slice(0, len(deck_names)),
        angles,
        rates,
        spindle,
        slice(spindle.stop, len(names)),
    )
