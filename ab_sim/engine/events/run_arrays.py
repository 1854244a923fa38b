"""Create the arrays of events and drivers for a system."""

import math

import numpy as np

from ab_sim.engine.compiling.kinds import aligned
from ab_sim.engine.events.balls import put_branches
from ab_sim.engine.events.event_functions import NEVER, slots
from ab_sim.engine.events.rows import WIDTH
from ab_sim.engine.events.run import COUPLING, NORMAL, BallEvents, Workspace
from ab_sim.model.dynamics.system import System, has_contact, has_friction, has_motor


def balls_of(system: System, discrete: np.ndarray) -> BallEvents:
    """Return the balls of a system, with arrays for the results of evaluations.

    Parameters
    ----------
    system
        System of equations.
    discrete
        Array for ``BallEvents.discrete``, which changes at events.
    """
    n, states = len(system.balls), type(system.deck_model).STATES
    every, contact = type(system.deck_model).UNKNOWNS + 1, has_contact(system.effects)
    driven, table = has_motor(system.effects), aligned((COUPLING + 2 * every, n))
    return BallEvents(
        number=n,
        constants=np.ascontiguousarray(system.balls),
        contacts=np.ascontiguousarray(system.contacts),
        discrete=discrete,
        branches=aligned((n + n * (n if contact else 1) + 1,)),
        table=table,
        block=aligned((every, every + 1)),
        x=aligned((every,)),
        motor=aligned((3,)),
        force=table[NORMAL],
        push=aligned((n,)),
        accelerations=every,
        free=every if driven else every - 1,
        first_angle=states,
        first_rate=states + n,
        spindle=states + 2 * n,
        has_friction=has_friction(system.effects),
        has_contact=contact,
        has_motor=driven,
        has_energy_balance=bool(system.energy_balance),
    )


def branches_of(system: System, discrete: np.ndarray) -> np.ndarray:
    """Return branches of set-valued laws in the form that a scene's code reads.

    See ``balls.put_branches``.
    """
    balls = balls_of(system, discrete)
    put_branches(balls)
    return balls.branches


def workspace(balls: BallEvents, bounds: np.ndarray, memory: tuple[int, int] = (0, 0)) -> Workspace:
    """Return a workspace for balls, bounds of the states, and the shape of a stepper's memory."""
    states, size = (len(bounds),), (slots(balls.number),)
    functions, near_value = [aligned(size) for _ in range(4)], aligned((3, *size))
    for values in (*functions, near_value[0], near_value[2]):
        values[:] = NEVER
    value, value_ahead, rate, rate_ahead = functions
    return Workspace(
        slope=aligned(states),
        trial=aligned(states),
        slope_ahead=aligned(states),
        memory=aligned(memory),
        smooth=np.full(1, math.nan),
        bounds=np.array(bounds),
        value=value,
        value_ahead=value_ahead,
        rate=rate,
        rate_ahead=rate_ahead,
        rounding=aligned(size),
        rows=aligned((balls.number, WIDTH)),
        near=aligned((2, *states)),
        near_value=near_value,
        force_rate=aligned((2, *size)),
        measured=np.zeros(2),
        counts=np.zeros(2, np.int64),
    )
