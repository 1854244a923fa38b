"""What is compiled for the kernel cannot be called from Python: these can."""

import numba
import numpy as np

from ab_sim.dynamics.race.ball import place_ball
from ab_sim.dynamics.race.pools import pool
from ab_sim.dynamics.race.race import race_of
from ab_sim.dynamics.system import Place, Plant, System, ball_count, carrier_unknowns
from ab_sim.integrate.workspace import room

OPTIONS = {"error_model": "numpy", "_nrt": False}
"""As ``compiled``: what is called returns arrays that it does not count."""


def plant_of(system: System, place: Place, modes: np.ndarray) -> Plant:
    """A Plant with room for one evaluation."""
    accelerations = carrier_unknowns(system.carrier) + 1
    return Plant(system, place, modes, room(accelerations, ball_count(system)))


@numba.njit(**OPTIONS)
def compiled_places(plant, state):  # type: ignore[no-untyped-def]
    """``place_ball`` of every ball."""
    for i in range(ball_count(plant.system)):
        place_ball(plant, i, state)


@numba.njit(**OPTIONS)
def compiled_pool(plant, pools):  # type: ignore[no-untyped-def]
    """``pool``."""
    return pool(race_of(plant), pools)
