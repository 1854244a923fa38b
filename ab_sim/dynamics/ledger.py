"""The energy ledger: motor work and losses, integrated along with the motion if asked for.

Two extra states behind all others: the work that the motor has done and the energy dissipated,
both [J]. A system with an empty ledger has neither the states nor this code.
"""

from typing import Any, NamedTuple

from numba.extending import overload

from ab_sim.dynamics.dispatch import INLINED, number_of
from ab_sim.dynamics.layout import dissipated_at, work_at
from ab_sim.dynamics.race.ball import ball_of
from ab_sim.dynamics.race.race import race_of
from ab_sim.dynamics.race.reactions import normal_forces
from ab_sim.dynamics.race.table import FORCE, FRICTION, PATH, PATH_ACCELERATION, REACH
from ab_sim.dynamics.system import (
    ball_count,
    ball_drag,
    dissipate,
    has_drag,
    has_friction,
    has_motor,
)


class Ledger(NamedTuple):
    """Asks the kernel to keep the ledger."""


def book(ledger: Any, plant: Any, spindle: Any, state: Any, slope: Any) -> None:
    """Put motor power and dissipated power [W] behind the other derivatives, if asked for."""
    if not ledger:
        return
    system, room, race = plant.system, plant.room, race_of(plant)
    x, row = room.acceleration, number_of(race.all) - 1
    if has_friction(system.effects):
        normal_forces(race, x)
    # What the spindle's equation leaves to the motor.
    torque = -room.block[row, number_of(race.all)]
    for r in range(number_of(race.all)):
        torque += room.block[r, row] * x[r]
    loss = dissipate(system.carrier, plant, spindle, state)
    for i in range(ball_count(system)):
        path = room.table[i, PATH]
        torque -= room.table[i, REACH + row] * room.table[i, PATH_ACCELERATION]
        if has_drag(system.effects):
            loss += ball_drag(system.effects, ball_of(system, i)) * path * path
        if has_friction(system.effects):
            loss += room.table[i, FRICTION] * room.table[i, FORCE] * path
    if has_motor(system.effects):
        torque = spindle.torque
    slope[work_at(state)] = torque * spindle.speed
    slope[dissipated_at(state)] = loss


@overload(book, jit_options=INLINED, strict=False)
def _book(ledger, plant, spindle, state, slope):  # type: ignore[no-untyped-def]
    if len(ledger):
        return book
    return lambda ledger, plant, spindle, state, slope: None


def mechanical_energy(system: Any, state: Any, psi: float, speed: float) -> float:
    """Kinetic and stored energy [J]; of the rotor's inertia I_r only what a motor accelerates.

    Args:
        system: the System.
        state: its state.
        psi: spindle angle [rad].
        speed: spindle speed [rad/s].
    """
    return float(system.carrier.energy(system, state, psi, speed))
