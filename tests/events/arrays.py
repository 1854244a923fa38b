"""Balls without a scene: arrays that a test fills in."""

from typing import Any

import numpy as np

from ab_sim.engine.events.run import COUPLING, NORMAL, BallEvents
from ab_sim.model.dynamics.system import FIRST_TURNS, MOBILITY, ORDER, ROLLING_MASS


def loose_balls(n: int, size: int = 3, **changes: Any) -> BallEvents:
    """Return ``n`` balls with inertia 1, in order, on a deck of ``size`` accelerations."""
    constants, contacts = np.zeros((n, FIRST_TURNS + 1)), np.zeros((n, 2))
    constants[:, [ROLLING_MASS, MOBILITY]] = 1.0
    contacts[:, ORDER] = np.arange(n)
    table = np.zeros((COUPLING + 2 * size, n))
    balls = BallEvents(
        number=n,
        constants=constants,
        contacts=contacts,
        discrete=np.zeros((n + 1, 4), np.int64),
        branches=np.zeros(n + n * n + 1),
        table=table,
        block=np.zeros((size, size + 1)),
        x=np.zeros(size),
        motor=np.zeros(3),
        force=table[NORMAL],
        push=np.zeros(n),
        accelerations=size,
        free=size - 1,
        first_angle=0,
        first_rate=n,
        spindle=2 * n,
        has_friction=False,
        has_contact=False,
        has_motor=False,
        has_energy_balance=False,
    )
    return balls._replace(**changes)
