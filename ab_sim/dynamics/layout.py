"""Where in the state a quantity lies: the only file that knows.

A state is a flat array: the carrier's own states; theta_0 .. theta_n-1 [rad]; theta_0' .. [rad/s];
with a motor psi [rad], w [rad/s] and the speed loop's integral [rad]; with a ledger the motor's
work and the energy dissipated [J]. Kernels ask by the functions, Python by a ``Layout``.
"""

from typing import Any, NamedTuple

from numba.extending import overload, register_jitable

from ab_sim.dynamics.dispatch import INLINED, effect_class, found_in, part_of
from ab_sim.dynamics.system import (
    System,
    ball_count,
    ball_number,
    carrier_coordinates,
    carrier_states,
    has_motor,
)

MOTOR_NAMES = ("spindle angle", "spindle speed", "speed loop's integral")
LEDGER_NAMES = ("motor work", "energy dissipated")


@register_jitable(**INLINED)
def angle_at(system: System, i: int) -> int:
    """Of theta_i."""
    return int(carrier_states(system.carrier) + i)


@register_jitable(**INLINED)
def rate_at(system: System, i: int) -> int:
    """Of theta_i'."""
    return int(carrier_states(system.carrier) + ball_count(system) + i)


@register_jitable(**INLINED)
def spindle_angle_at(system: System) -> int:
    """Of psi; only with a motor."""
    return int(carrier_states(system.carrier) + 2 * ball_count(system))


@register_jitable(**INLINED)
def spindle_speed_at(system: System) -> int:
    """Of w; only with a motor."""
    return spindle_angle_at(system) + 1


@register_jitable(**INLINED)
def integral_at(system: System) -> int:
    """Of the speed loop's integral; only with a motor."""
    return spindle_angle_at(system) + 2


@register_jitable(**INLINED)
def equation_count(system: System) -> int:
    """Equations of second order: of the carrier's coordinates, each ball, and a motor's spindle."""
    driven = 1 if has_motor(system.effects) else 0
    return int(carrier_coordinates(system.carrier) + ball_count(system) + driven)


@register_jitable(**INLINED)
def angle_and_rate_at(system: System, q: int) -> tuple[int, int]:
    """Of what moves by equation q, behind those of the carrier: a ball, or a motor's spindle."""
    i = q - carrier_coordinates(system.carrier)
    if i < ball_count(system):
        return angle_at(system, i), rate_at(system, i)
    return spindle_angle_at(system), spindle_speed_at(system)


@register_jitable(**INLINED)
def integrals_at(system: System) -> int:
    """The first of those states that are only integrated."""
    return integral_at(system) if has_motor(system.effects) else spindle_angle_at(system)


@register_jitable(**INLINED)
def work_at(state: Any) -> int:
    """Of the motor's work; only with a ledger."""
    return len(state) - 2


@register_jitable(**INLINED)
def dissipated_at(state: Any) -> int:
    """Of the energy dissipated; only with a ledger."""
    return len(state) - 1


def state_size(system: System, state: Any) -> int:
    """Number of states, a constant where the kernel is compiled for a number of balls."""
    return len(state)


@overload(state_size, jit_options=INLINED, strict=False)
def _state_size(system, state):  # type: ignore[no-untyped-def]
    size = states_in(system)
    if size is None:
        return lambda system, state: state.size
    return lambda system, state: size


def state_count(system: System, state: Any) -> Any:
    """The same, as ``dispatch.number_of`` takes it: for functions that count to it."""
    return len(state)


@overload(state_count, jit_options=INLINED, strict=False)
def _state_count(system, state):  # type: ignore[no-untyped-def]
    size = states_in(system)
    if size is None:
        return lambda system, state: state.size
    count = (None,) * size
    return lambda system, state: count


def states_in(kind: Any) -> int | None:
    """Number of states, where numba's type of a System tells it."""
    n = ball_number(kind)
    if n is None:
        return None
    own: int = effect_class(part_of(kind, "carrier")).STATES
    motor = len(MOTOR_NAMES) if found_in(kind, has_motor) else 0
    return own + 2 * n + motor + len(LEDGER_NAMES) * len(part_of(kind, "ledger"))


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
    names = [*own, *(f"ball_{i} angle" for i in range(n)), *(f"ball_{i} rate" for i in range(n))]
    angles = slice(angle_at(system, 0), angle_at(system, n))
    rates = slice(rate_at(system, 0), rate_at(system, n))
    names += MOTOR_NAMES if has_motor(system.effects) else ()
    spindle = slice(rates.stop, len(names))
    names += LEDGER_NAMES if system.ledger else ()
    return Layout(
        tuple(names), slice(0, len(own)), angles, rates, spindle, slice(spindle.stop, len(names))
    )
