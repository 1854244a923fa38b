"""The equations of motion, unsolved: accelerations from what they were taken to be a moment before.

For those who iterate anyway. What carries the balls gives way to the path accelerations that they
had, and then each ball to what carries it: no elimination, and no division.
"""

import numba

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.layout import rate_at
from ab_sim.dynamics.race.ball import path_change, rate_change
from ab_sim.dynamics.race.elimination import accelerate
from ab_sim.dynamics.race.race import race_of
from ab_sim.dynamics.race.table import PATH_ACCELERATION
from ab_sim.dynamics.slope import loads
from ab_sim.dynamics.system import ball_count, give_way


@numba.njit(**INLINED)
def carry(plant, spindle, state, slope):  # type: ignore[no-untyped-def]
    """Accelerations of what carries the balls, from those of the balls.

    Args:
        plant: the Plant; its table holds the balls' cosines and sines, and its room
            afterwards what the equations say, and these accelerations.
        spindle: the Spindle's motion.
        state: the state.
        slope: holds each ball's theta''.
    """
    loads(plant, spindle, state)
    for i in range(ball_count(plant.system)):
        at = rate_at(plant.system, i)
        path = path_change(plant, i, state[at], slope[at])
        plant.room.table[i, PATH_ACCELERATION] = path
    give_way(plant.system.carrier, plant)


@numba.njit(**INLINED)
def be_carried(plant, state, slope):  # type: ignore[no-untyped-def]
    """Each ball's theta'' into ``slope``, from the accelerations in the room, after ``carry``."""
    accelerate(race_of(plant))
    for i in range(ball_count(plant.system)):
        at = rate_at(plant.system, i)
        path = plant.room.table[i, PATH_ACCELERATION]
        slope[at] = rate_change(plant, i, state[at], path)
