"""How deck, balls and spindle accelerate under the race's drag alone: the stiff, linear part."""

import numba

from ab_sim.dynamics.balls import (
    curve_at,
    path_acceleration,
    rigid_lever,
    rotor_inertia,
    set_rows,
    sliding_friction,
)
from ab_sim.dynamics.dispatch import APART
from ab_sim.dynamics.linear_system import reduce
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


def table_rows(balls: int, nodes: int) -> int:
    """Rows of WIDTH numbers that ``drag_responses`` needs for its tables."""
    return 3 * nodes + balls * (nodes + 4)


@numba.njit(**APART)
def drag_responses(system, modes, step, q, states, slopes, scratch, tables):  # type: ignore[no-untyped-def]
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
        tables: overwritten, ``table_rows`` of WIDTH numbers.
    """
    n, m = ball_count(system), q.shape[0]
    unknowns = 3 if has_motor(system.effects) else 2
    # The deck's and spindle's equations with their right-hand side, then of each ball its matrix
    # with its inverse, its force, and what deck and spindle ask of it.
    size, each = unknowns * m, m + 4
    deck, balls = tables[:size], tables[3 * m : 3 * m + n * each]
    tables[:] = 0.0
    for a in range(m):
        here = scratch[a * n : (a + 1) * n]
        drag_on_balls(system, states[a], modes, here)
        lead(system, modes, here)
        for i in range(n):
            at = int(here[i, LEADER])
            if at < 0:
                continue
            ball = balls[at * each : (at + 1) * each]
            ball[a, a] += here[i, INERTIA]
            ball[m, a] += here[i, PULL]
            for b in range(unknowns):
                ball[m + 1 + b, a] += here[i, ROW1 + b]
            for b in range(m):
                there = scratch[b * n : (b + 1) * n]
                curved = curve_at(system, i, here) / curve_at(system, i, there)
                ball[a, b] += here[i, DRAG] * step * q[a, b] * curved
    for i in range(n):
        if int(scratch[i, LEADER]) == i:
            ball = balls[i * each : (i + 1) * each]
            for a in range(m):
                ball[a, m + a] = 1.0
            reduce(ball, m, 2 * m)
    for a in range(m):
        here = scratch[a * n : (a + 1) * n]
        deck[a, a] += system.body.total_mass
        deck[m + a, m + a] += system.body.total_mass
        if has_motor(system.effects):
            deck[m + a, 2 * m + a] += system.body.unbalance
            deck[2 * m + a, m + a] += system.body.unbalance
            deck[2 * m + a, 2 * m + a] += rotor_inertia(system, here)
        for i in range(n):
            add_ball(system, i, a, m, here, balls, deck)
    reduce(deck, size, size + 1)
    for a in range(m):
        here = scratch[a * n : (a + 1) * n]
        slopes[a] = 0.0
        slopes[a, 2] = deck[a, size]
        slopes[a, 3] = deck[m + a, size]
        if has_motor(system.effects):
            slopes[a, 5 + 2 * n] = deck[2 * m + a, size]
        for i in range(n):
            at, g = int(here[i, LEADER]), 0.0
            if at >= 0:
                ball = balls[at * each : (at + 1) * each]
                for b in range(m):
                    pull = ball[m, b]
                    for r in range(unknowns):
                        pull += ball[m + 1 + r, b] * deck[r * m + b, size]
                    g += ball[a, m + b] * pull
            slopes[a, 4 + n + i] = g / curve_at(system, i, here)


@numba.njit(**APART)
def add_ball(system, i, a, m, here, balls, deck):  # type: ignore[no-untyped-def]
    """What ball i, eliminated, adds to the equations of deck and spindle at node a."""
    at, mass = int(here[i, LEADER]), system.balls[i, MASS]
    unknowns = 3 if has_motor(system.effects) else 2
    if has_motor(system.effects):
        d1, d2 = rigid_lever(system, i, here)
        deck[a, 2 * m + a] += d1
        deck[m + a, 2 * m + a] += d2
        deck[2 * m + a, a] += d1
        deck[2 * m + a, m + a] += d2
    if at < 0:
        return
    ball = balls[at * (m + 4) : (at + 1) * (m + 4)]
    for p in range(unknowns):
        pushed = -mass * here[i, SIN]
        if p == 1:
            pushed = mass * here[i, COS]
        elif p == 2:
            pushed = here[i, LEVER]
        for b in range(m):
            mobility = pushed * ball[a, m + b]
            deck[p * m + a, unknowns * m] -= mobility * ball[m, b]
            for r in range(unknowns):
                deck[p * m + a, r * m + b] += mobility * ball[m + 1 + r, b]


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
