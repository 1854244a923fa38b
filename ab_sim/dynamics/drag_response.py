"""How deck, balls and spindle accelerate under the race's drag alone: the stiff, linear part."""

import numba
import numpy as np

from ab_sim.dynamics.balls import (
    curve_at,
    path_acceleration,
    rigid_lever,
    rotor_inertia,
    set_rows,
    sliding_friction,
)
from ab_sim.dynamics.dispatch import APART
from ab_sim.dynamics.motion import Ball
from ab_sim.dynamics.planar import accelerations
from ab_sim.dynamics.rows import eliminate, lead
from ab_sim.dynamics.scratch import COS, DRAG, INERTIA, LEADER, LEVER, PULL, ROW1, SIN
from ab_sim.dynamics.system import MASS, RADIUS, ball_count, ball_drag, has_drag, has_motor


@numba.njit(**APART)
def drag_response(system, state, modes, slope, scratch):  # type: ignore[no-untyped-def]
    """The drag's part f_I of ``derivatives``; linear in the velocities.

    Args:
        system, modes: as for ``derivatives``.
        state: a state; only its velocities are meant.
        slope: where f_I goes; zero but for the velocities' part.
        scratch: as ``place_balls`` has left it at the state's angles.
    """
    n = ball_count(system)
    drag_on_balls(system, state, modes, scratch)
    eliminate(system, modes, scratch)
    A1, A2, al = accelerations(system, 0.0, 0.0, 0.0, 0.0, scratch)
    slope[:] = 0.0
    slope[2] = A1
    slope[3] = A2
    for i in range(n):
        g = path_acceleration(system, i, A1, A2, al, scratch)
        slope[4 + n + i] = g / curve_at(system, i, scratch)
    if has_motor(system.effects):
        slope[5 + 2 * n] = al


# It makes arrays of its own, and so counts references.
@numba.njit(**{**APART, "_nrt": True})
def drag_responses(system, modes, step, q, states, slopes, scratch):  # type: ignore[no-untyped-def]
    """The f_m that solve f_m = f_I(state_m + step sum_j q_mj f_j), on all nodes m at once.

    The elimination of ``derivatives`` with each ball's inertia mu replaced by the matrix
    mu 1 + c_b step q: it couples the nodes, and leaves two or three equations for each.

    Args:
        system, modes: as for ``derivatives``.
        step: of the stepper [s].
        q: its integration matrix, shape (m, m).
        states: the states, shape (m, states); only their velocities are meant.
        slopes: where the f go, shape (m, states).
        scratch: for each node, as ``place_balls`` has left it, one behind the other.
    """
    effects = system.effects
    n, m = ball_count(system), q.shape[0]
    unknowns = 3 if has_motor(effects) else 2
    inertia, force = np.zeros((n, m, m)), np.zeros((n, m))
    rows = np.zeros((n, 3, m))
    for a in range(m):
        here = scratch[a * n : (a + 1) * n]
        drag_on_balls(system, states[a], modes, here)
        lead(system, modes, here)
        for i in range(n):
            at = int(here[i, LEADER])
            if at < 0:
                continue
            inertia[at, a, a] += here[i, INERTIA]
            force[at, a] += here[i, PULL]
            for b in range(unknowns):
                rows[at, b, a] += here[i, ROW1 + b]
            for b in range(m):
                there = scratch[b * n : (b + 1) * n]
                curved = curve_at(system, i, here) / curve_at(system, i, there)
                inertia[at, a, b] += here[i, DRAG] * step * q[a, b] * curved
    matrix, right = np.zeros((unknowns * m, unknowns * m)), np.zeros(unknowns * m)
    for a in range(m):
        matrix[a, a] += system.body.total_mass
        matrix[m + a, m + a] += system.body.total_mass
        if has_motor(effects):
            matrix[m + a, 2 * m + a] += system.body.unbalance
            matrix[2 * m + a, m + a] += system.body.unbalance
            matrix[2 * m + a, 2 * m + a] += rotor_inertia(system, scratch[a * n : (a + 1) * n])
    for i in range(n):
        if int(scratch[i, LEADER]) == i:
            inertia[i] = np.linalg.inv(inertia[i])
    pushed = np.zeros(unknowns)
    for i in range(n):
        at, mass = int(scratch[i, LEADER]), system.balls[i, MASS]
        for a in range(m):
            here = scratch[a * n : (a + 1) * n]
            pushed[0], pushed[1] = -mass * here[i, SIN], mass * here[i, COS]
            if has_motor(effects):
                pushed[2] = here[i, LEVER]
                d1, d2 = rigid_lever(system, i, here)
                matrix[a, 2 * m + a] += d1
                matrix[m + a, 2 * m + a] += d2
                matrix[2 * m + a, a] += d1
                matrix[2 * m + a, m + a] += d2
            if at < 0:
                continue
            for b in range(m):
                mobility = inertia[at, a, b]
                for p in range(unknowns):
                    right[p * m + a] -= pushed[p] * mobility * force[at, b]
                    for r in range(unknowns):
                        matrix[p * m + a, r * m + b] += pushed[p] * mobility * rows[at, r, b]
    solved = np.linalg.solve(matrix, right)
    for a in range(m):
        here = scratch[a * n : (a + 1) * n]
        slopes[a] = 0.0
        slopes[a, 2] = solved[a]
        slopes[a, 3] = solved[m + a]
        if has_motor(effects):
            slopes[a, 5 + 2 * n] = solved[2 * m + a]
        for i in range(n):
            at, g = int(here[i, LEADER]), 0.0
            if at >= 0:
                for b in range(m):
                    pull = force[at, b]
                    for r in range(unknowns):
                        pull += rows[at, r, b] * solved[r * m + b]
                    g += inertia[at, a, b] * pull
            slopes[a, 4 + n + i] = g / curve_at(system, i, here)


@numba.njit(**APART)
def drag_on_balls(system, state, modes, scratch):  # type: ignore[no-untyped-def]
    """Each ball's own equation if nothing but drag acts on it."""
    n = ball_count(system)
    for i in range(n):
        drag = 0.0
        if has_drag(system.effects):
            drag = ball_drag(system.effects, Ball(system.balls[i, MASS], system.balls[i, RADIUS]))
        scratch[i, DRAG] = drag
        scratch[i, PULL] = -drag * curve_at(system, i, scratch) * state[4 + n + i]
        set_rows(system, i, sliding_friction(system, i, modes), scratch)
