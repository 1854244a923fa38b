"""Balls on a fixed round track of radius 1: a scene whose motion is known."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ab_sim.engine.events.run import (
    ALONG,
    CURVE,
    FRICTION,
    GRIP,
    INERTIA,
    LOAD,
    NORMAL,
    PATH,
    PATH_ACCELERATION,
    PATH_FORCE,
    PULL,
    SIZE,
    Run,
    SceneFunctions,
)
from ab_sim.engine.events.run_arrays import workspace
from ab_sim.model.dynamics.system import LOADED, MASS, MOBILITY, RACE_RADIUS, ROLLING_MASS, SPACING
from tests.events.arrays import loose_balls

Force = Callable[[float, np.ndarray], Any]


def run_on_track(
    places: Any,
    speeds: Any,
    *,
    force: Force = lambda t, y: 0.0,
    mass: Any = 1.0,
    friction: float = 0.0,
    load: Force | None = None,
    spacing: float | None = None,
    restitution: float = 1.0,
) -> Run:
    """Return a Run with steps of the classical Runge-Kutta method.

    Parameters
    ----------
    places
        Positions of the balls [rad], in order.
    speeds
        Rates of the balls [rad/s].
    force
        Force on each ball along the track, a function of time and state.
    mass
        Mass of each ball.
    friction
        Coefficient of friction; used with ``load``.
    load
        Normal force of the track on each ball, a function of time and state; None for no friction.
    spacing
        Distance of balls in contact [rad]; None lets them pass each other.
    restitution
        Coefficient of restitution.
    """
    n = len(places)
    contact = spacing is not None
    balls = loose_balls(n, 2, has_friction=load is not None, has_contact=contact)
    balls.constants[:, MASS] = balls.constants[:, ROLLING_MASS] = mass
    balls.constants[:, MOBILITY], balls.constants[:, RACE_RADIUS] = 1.0 / np.asarray(mass), 1.0
    balls.contacts[:, SPACING] = spacing or 0.0
    balls.block[0, 0] = balls.block[1, 1] = 1.0
    balls.discrete[:n, LOADED] = 1

    def evaluate(
        c: Any, b: Any, y: Any, slope: Any, x: Any, motor: Any, table: Any, time: float
    ) -> None:
        table[LOAD] = load(time, y) if load else 0.0
        table[INERTIA], table[PATH_FORCE], table[GRIP] = mass, force(time, y), friction
        table[FRICTION] = b[:n] * friction
        table[CURVE], table[ALONG], table[PATH] = 1.0, y[:n], y[n:]
        forces = table[PATH_FORCE] - table[FRICTION] * table[LOAD]
        table[NORMAL], table[PULL] = table[LOAD], forces
        table[SIZE] = abs(forces) + (abs(table[LOAD]) if load else 0.0)
        rows = b[n : n + n * n].reshape(n, n) if contact else np.diag(b[n : 2 * n])
        table[PATH_ACCELERATION] = rows @ forces
        slope[:n], slope[n:] = y[n:], table[PATH_ACCELERATION]

    def step(c: Any, b: Any, y: Any, slope: Any, trial: Any, begin: float, length: float) -> None:
        stages, table = [slope.copy()], np.zeros_like(balls.table)
        for part in (0.5, 0.5, 1.0):
            k = np.zeros(2 * n)
            at = y + part * length * stages[-1]
            evaluate(c, b, at, k, None, None, table, begin + part * length)
            stages.append(k)
        trial[:] = y + length / 6.0 * (stages[0] + 2.0 * stages[1] + 2.0 * stages[2] + stages[3])

    def finish(
        c: Any, b: Any, y: Any, slope: Any, row: Any, time: float, profile_time: float
    ) -> None:
        table = np.zeros_like(balls.table)
        evaluate(c, b, y, slope, None, None, table, time)
        row[0] = profile_time
        row[3 : 3 + 2 * n : 2], row[4 : 4 + 2 * n : 2] = y[:n], y[n:]

    def part(c: Any, b: Any, out: Any, approach: float) -> None:
        out[0] = restitution

    def nothing(*_: Any) -> None:
        """Ignore the call: the track is fixed, so that no carrier takes up a jump."""

    own: Any = (nothing, evaluate, nothing, step, finish, nothing, part, np.zeros(8))
    bounds = np.full(2 * n, 1e6)
    state = np.array([*places, *speeds], float)
    work = workspace(balls, bounds)
    laws = load is not None or contact
    scene = SceneFunctions(*own)
    return Run(scene, balls, work, state, 0.1, 0, 3, -1, laws)


def passing_points(places: np.ndarray, speeds: np.ndarray, spacing: float, time: float) -> Any:
    """Return the motion of equal elastic balls, like points that pass through each other.

    Returns
    -------
    Any
        Positions and speeds in order along the track from the first ball on, and the free length.
    """
    n = len(places)
    length = 2.0 * math.pi - n * spacing
    points = places - spacing * np.arange(n) + speeds * time
    order = np.argsort(points % length)
    return (points % length)[order], speeds[order], length
