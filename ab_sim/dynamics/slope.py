"""The equations of motion, solved: how fast the state changes.

Each ball, or each row of balls in contact, is eliminated, which leaves the equations of what
carries them: O(n), no linear-algebra library (the arrowhead of docs/equations.md, 2).
"""

import numba

from ab_sim.dynamics.dispatch import APART, INLINED, chosen_by, number_of
from ab_sim.dynamics.layout import angle_at, integral_at, rate_at, spindle_angle_at
from ab_sim.dynamics.ledger import book
from ab_sim.dynamics.numbers.abreast import cosines
from ab_sim.dynamics.race.ball import place_ball, rate_change, resist_ball
from ab_sim.dynamics.race.elimination import eliminate, eliminate_free, solve
from ab_sim.dynamics.race.race import race_of
from ab_sim.dynamics.race.table import COS, PATH_ACCELERATION, PULL, SIN
from ab_sim.dynamics.spindle_motion import spindle_motion
from ab_sim.dynamics.system import (
    ball_count,
    bear,
    begin,
    carrier_unknowns,
    has_motor,
    may_hold,
    move,
)

_eliminate = chosen_by(
    may_hold,
    lambda plant: eliminate(race_of(plant)),
    lambda plant: eliminate_free(race_of(plant)),
)


@numba.njit(**APART)
def evaluate(plant, time, state, slope):  # type: ignore[no-untyped-def]
    """Time derivative of the state.

    Args:
        plant: the Plant; its room holds afterwards what the equations say there.
        time: local time in its speed segment [s].
        state: the state, see ``layout``.
        slope: where the derivative goes, same shape.
    """
    system, room, race = plant.system, plant.room, race_of(plant)
    spindle = spindle_motion(plant, time, state)
    frame = equations(plant, spindle, state)
    _eliminate(plant)
    solve(race)
    move(system.carrier, plant, spindle, frame, state, slope)
    for i in range(ball_count(system)):
        rate = state[rate_at(system, i)]
        slope[angle_at(system, i)] = rate
        slope[rate_at(system, i)] = rate_change(plant, i, rate, room.table[i, PATH_ACCELERATION])
    if has_motor(system.effects):
        slope[spindle_angle_at(system)] = spindle.speed
        slope[spindle_angle_at(system) + 1] = room.acceleration[number_of(race.all) - 1]
        slope[integral_at(system)] = spindle.integral_rate
    book(system.ledger, plant, spindle, state, slope)


@numba.njit(**INLINED)
def equations(plant, spindle, state):  # type: ignore[no-untyped-def]
    """The equations of the balls and of what carries them, not yet solved, into the room.

    Returns:
        The carrier's frame.
    """
    system, table = plant.system, plant.room.table
    cosines(state, angle_at(system, 0), system.each, table, COS, SIN)
    return loads(plant, spindle, state)


@numba.njit(**INLINED)
def loads(plant, spindle, state):  # type: ignore[no-untyped-def]
    """``equations`` where the table holds the balls' cosines and sines."""
    system, room = plant.system, plant.room
    room.acceleration[carrier_unknowns(system.carrier)] = spindle.acceleration
    frame = begin(system.carrier, plant, spindle, state)
    for i in range(ball_count(system)):
        c, s = place_ball(plant, i, state)
        resistance = resist_ball(plant, i, state)
        pull = bear(system.carrier, plant, spindle, frame, c, s, i, state)
        room.table[i, PULL] = pull + resistance
    return frame


inlined_evaluate = numba.njit(**INLINED)(evaluate.py_func)
"""``evaluate`` for where nearly all of the time is spent."""
