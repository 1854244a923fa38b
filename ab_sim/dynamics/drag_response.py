"""How carrier, balls and spindle accelerate under the race's drag alone: the stiff, linear part."""

import numba

from ab_sim.dynamics.dispatch import APART, number_of
from ab_sim.dynamics.layout import rate_at, spindle_speed_at
from ab_sim.dynamics.linear_solver import reduce
from ab_sim.dynamics.race.ball import ball_of, curve_at
from ab_sim.dynamics.race.elimination import eliminate, lead, row_at, solve
from ab_sim.dynamics.race.race import race_of
from ab_sim.dynamics.race.table import (
    DRAG,
    INERTIA,
    LEADER,
    LOAD,
    PATH_ACCELERATION,
    PULL,
    REACH,
)
from ab_sim.dynamics.slope import equations
from ab_sim.dynamics.spindle_motion import spindle_motion
from ab_sim.dynamics.system import (
    Plant,
    Room,
    ball_count,
    ball_drag,
    has_drag,
    has_motor,
    kick,
)


@numba.njit(**APART)
def drag_response(plant, state, slope):  # type: ignore[no-untyped-def]
    """The drag's part f_I of the state's rate of change; linear in the velocities.

    Args:
        plant: the Plant; its room holds the ``equations`` at the state's angles.
        state: a state; only its velocities, and how the carrier lies, are meant.
        slope: where f_I goes; zero but for the velocities' part.
    """
    system, table, x = plant.system, plant.room.table, plant.room.acceleration
    race = race_of(plant)
    drag_on_balls(plant, state)
    for r in range(number_of(race.free)):
        plant.room.block[r, number_of(race.all)] = 0.0
    x[number_of(race.all) - 1] = 0.0
    eliminate(race)
    solve(race)
    slope[:] = 0.0
    kick(system.carrier, state, x, slope)
    for i in range(ball_count(system)):
        slope[rate_at(system, i)] = table[i, PATH_ACCELERATION] / curve_at(plant, i)
    if has_motor(system.effects):
        slope[spindle_speed_at(system)] = x[number_of(race.all) - 1]


def table_rows(balls: int, nodes: int, accelerations: int) -> int:
    """Lines of a table that ``drag_responses`` needs for its own."""
    return accelerations * nodes + balls * (nodes + 1 + accelerations)


@numba.njit(**APART)
def at_node(plant, m):  # type: ignore[no-untyped-def]
    """The plant with room of its own for node m, behind that for the state at hand."""
    n, room, every = ball_count(plant.system), plant.room, number_of(race_of(plant).all)
    table = room.table[(1 + m) * n : (2 + m) * n]
    block = room.block[(1 + m) * every : (2 + m) * every]
    own = Room(table, block, room.reduced, room.acceleration, room.motor)
    return Plant(plant.system, plant.place, plant.modes, own)


@numba.njit(**APART)
def equations_at_node(plant, m, time, state):  # type: ignore[no-untyped-def]
    """``equations`` into the room of node m; local time [s]."""
    own = at_node(plant, m)
    equations(own, spindle_motion(own, time, state), state)


@numba.njit(**APART)
def drag_responses(plant, step, q, states, slopes, tables):  # type: ignore[no-untyped-def]
    """The f_m that solve f_m = f_I(state_m + step sum_j q_mj f_j), on all nodes m at once.

    The elimination of the equations of motion with each ball's inertia mu replaced by the matrix
    mu 1 + c_b step q: it couples the nodes, and leaves K equations for each.

    Args:
        plant: the Plant, with the ``equations`` at each node in its room.
        step: of the stepper [s].
        q: its integration matrix, shape (m, m).
        states: the states, shape (m, states); only their velocities are meant.
        slopes: where the f go, shape (m, states).
        tables: overwritten, ``table_rows`` lines of a table.
    """
    system, race = plant.system, race_of(plant)
    n, m, free = ball_count(system), q.shape[0], number_of(race.free)
    # The carrier's equations with their right-hand side, then of each ball its matrix with its
    # inverse, its force, and what the accelerations ask of it.
    size, each = free * m, m + 1 + number_of(race.all)
    carrier, balls = (
        tables[:size],
        tables[number_of(race.all) * m : number_of(race.all) * m + n * each],
    )
    tables[:] = 0.0
    for a in range(m):
        own = at_node(plant, a)
        drag_on_balls(own, states[a])
        here, there = race_of(own), own.room.table
        lead(here)
        for i in range(n):
            at = int(there[i, LEADER])
            if at < 0:
                continue
            ball = balls[at * each : (at + 1) * each]
            ball[a, a] += there[i, INERTIA]
            ball[m, a] += there[i, PULL]
            for r in range(free):
                ball[m + 1 + r, a] += row_at(here, i, r)
            for b in range(m):
                curved = curve_at(own, i) / curve_at(at_node(plant, b), i)
                ball[a, b] += there[i, DRAG] * step * q[a, b] * curved
    for i in range(n):
        if int(plant.room.table[n + i, LEADER]) == i:
            ball = balls[i * each : (i + 1) * each]
            for a in range(m):
                ball[a, m + a] = 1.0
            reduce(ball, m, 2 * m)
    for a in range(m):
        own = at_node(plant, a)
        for p in range(free):
            for r in range(free):
                carrier[p * m + a, r * m + a] += own.room.block[min(p, r), max(p, r)]
        for i in range(n):
            at = int(own.room.table[i, LEADER])
            if at >= 0:
                ball = balls[at * each : (at + 1) * each]
                for p in range(free):
                    reach = own.room.table[i, REACH + p]
                    for b in range(m):
                        mobility = reach * ball[a, m + b]
                        carrier[p * m + a, size] += mobility * ball[m, b]
                        for r in range(free):
                            carrier[p * m + a, r * m + b] -= mobility * ball[m + 1 + r, b]
    reduce(carrier, size, size + 1)
    x = plant.room.acceleration
    for a in range(m):
        own = at_node(plant, a)
        slopes[a] = 0.0
        x[number_of(race.all) - 1] = 0.0
        for r in range(free):
            x[r] = carrier[r * m + a, size]
        kick(system.carrier, states[a], x, slopes[a])
        if has_motor(system.effects):
            slopes[a, spindle_speed_at(system)] = x[number_of(race.all) - 1]
        for i in range(n):
            at, g = int(own.room.table[i, LEADER]), 0.0
            if at >= 0:
                ball = balls[at * each : (at + 1) * each]
                for b in range(m):
                    pull = ball[m, b]
                    for r in range(free):
                        pull += ball[m + 1 + r, b] * carrier[r * m + b, size]
                    g += ball[a, m + b] * pull
            slopes[a, rate_at(system, i)] = g / curve_at(own, i)


@numba.njit(**APART)
def drag_on_balls(plant, state):  # type: ignore[no-untyped-def]
    """Each ball's own equation if nothing but drag acts on it."""
    system, table = plant.system, plant.room.table
    for i in range(ball_count(system)):
        drag = 0.0
        if has_drag(system.effects):
            drag = ball_drag(system.effects, ball_of(system, i))
        table[i, DRAG] = drag
        table[i, LOAD] = 0.0
        table[i, PULL] = -drag * curve_at(plant, i) * state[rate_at(system, i)]
