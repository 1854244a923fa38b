"""The balls of a plant as plain numbers: all that rows, friction and impacts know.

Neither a scene's effects nor what carries the balls are in it by type, so what works on it is
compiled once for all scenes.
"""

from math import pi
from typing import Any, NamedTuple

import numba
import numpy as np
from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import INLINED, attribute, chosen_by, number_of
from ab_sim.dynamics.layout import angle_at, rate_at, spindle_angle_at
from ab_sim.dynamics.race.table import ALONG, CURVE
from ab_sim.dynamics.system import (
    FIRST_TURNS,
    ORDER,
    RACE_RADIUS,
    SPACING,
    TURNS,
    Plant,
    Room,
    has_contact,
    has_friction,
    has_motor,
)


class Race(NamedTuple):
    """Balls, what holds of them, and the equations of what carries them.

    Counts and truth values are tuples where a kernel knows them by its types: see ``number_of`` and
    ``holds`` in ``dispatch``.
    """

    number: Any
    """n."""
    balls: Any
    """``System.balls``."""
    contacts: Any
    """``System.contacts``."""
    modes: Any
    """``Plant.modes``."""
    room: Room
    """What the last evaluation wrote."""
    all: Any
    """K, the number of accelerations."""
    free: Any
    """How many of them are solved for: K, or K - 1 where the spindle's is prescribed."""
    first_angle: int
    """Where in the state theta_0 lies."""
    first_rate: int
    """Where in the state theta_0' lies."""
    spindle: int
    """Where in the state psi lies, with a motor."""
    rubs: Any
    """Whether balls rub on the race."""
    meets: Any
    """Whether balls touch each other."""
    driven: Any
    """Whether a motor drives the spindle."""
    booked: Any
    """Whether a ledger is kept."""


def race_kind() -> Any:
    """Numba's type of a Race whose arrays the caller owns: the same for all scenes."""
    flat, table = np.zeros(0), np.zeros((0, 0))
    room = Room(table, table, table, flat, flat)
    modes = np.zeros((0, 0), np.int64)
    numbers = (0,) * 5, (False,) * 4
    return numba.typeof(Race(0, table, table, modes, room, *numbers[0], *numbers[1]))


every_of = attribute("ALL")
_free_of = attribute("FREE")
_free = chosen_by(
    has_motor, lambda system: every_of(system.carrier), lambda system: _free_of(system.carrier)
)
_rubs, _meets, _driven = (
    chosen_by(asked, lambda system: (None,), lambda system: ())
    for asked in (has_friction, has_contact, has_motor)
)


@register_jitable(**INLINED)
def race_of(plant: Plant) -> Race:
    """The balls of a plant."""
    system = plant.system
    return Race(
        system.each,
        system.balls,
        system.contacts,
        plant.modes,
        plant.room,
        every_of(system.carrier),
        _free(system),
        angle_at(system, 0),
        rate_at(system, 0),
        spindle_angle_at(system),
        _rubs(system),
        _meets(system),
        _driven(system),
        system.ledger,
    )


@register_jitable(**INLINED)
def around(race: Race, place: int) -> int:
    """The same place of the row, which closes in itself, from -n .. 2 n - 1: divisions are slow."""
    n = number_of(race.number)
    if place >= n:
        return place - n
    return place + n if place < 0 else place


@register_jitable(**INLINED)
def ball_at(race: Race, place: int) -> int:
    """Which ball is at a place of the row."""
    return int(race.contacts[place, ORDER])


@register_jitable(**INLINED)
def gap(race: Race, k: int) -> Any:
    """Distance along the race between the balls at contact k [m]; negative where they overlap."""
    n, table, modes, balls = number_of(race.number), race.room.table, race.modes, race.balls
    i, j = ball_at(race, k), ball_at(race, around(race, k + 1))
    turns = (modes[j, TURNS] - balls[j, FIRST_TURNS]) - (modes[i, TURNS] - balls[i, FIRST_TURNS])
    if k == n - 1:
        turns += 1.0
    apart = (table[j, ALONG] - table[i, ALONG]) + 2.0 * pi * balls[j, RACE_RADIUS] * turns
    return apart - race.contacts[k, SPACING]


@register_jitable(**INLINED)
def path_speed(race: Race, state: Any, i: int) -> Any:
    """Speed of ball i along the race [m/s], where the table holds the race's shape at it."""
    return race.room.table[i, CURVE] * state[race.first_rate + i]
