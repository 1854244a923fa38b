"""Which tables of responses a step of the equations of motion takes, made when first asked for."""

import numba

from ab_sim.dynamics.dispatch import APART, INLINED
from ab_sim.dynamics.layout import angle_at, rate_at
from ab_sim.dynamics.race.ball import ball_of
from ab_sim.dynamics.system import MOBILITY, ball_count, ball_drag, carrier_ways, own_motion
from ab_sim.integrate.on_stack import own_array
from ab_sim.integrate.responses import DAMPING, LENGTH, LINES, NODES, NUMBERS, fill, polynomials

KEPT = 4
"""Lengths of steps whose tables are kept: what a graded start takes, and the step itself."""
RATIO, NEXT, CARRY = 0, 1, 1
"""The head of the tables: in line 0 the ratio of steps for which the lines from CARRY on carry a
polynomial on, and which of the tables kept is to go next."""
HEAD = 1 + NODES
LINES_EACH = HEAD + KEPT * LINES
"""Enough for each ball and for what carries them."""


@numba.njit(**INLINED)
def drag_rate_of(system, i):  # type: ignore[no-untyped-def]
    """Rate at which drag slows down ball i on a deck that does not move [1/s]."""
    return ball_drag(system.effects, ball_of(system, i)) * system.balls[i, MOBILITY]


@numba.njit(**INLINED)
def first_line(weights, system, length, tables):  # type: ignore[no-untyped-def]
    """Where among the tables those for a step of that length begin, made if need be."""
    every = LINES * (1 + ball_count(system))
    for kept in range(KEPT):
        first = HEAD + kept * every
        if tables[first + NUMBERS, LENGTH] == length:
            return first
    return made_anew(weights, system, length, tables)


@numba.njit(**APART)
def made_anew(weights, system, length, tables):  # type: ignore[no-untyped-def]
    """Tables for a step of that length, in place of the oldest; returns where they begin."""
    n, kept = ball_count(system), int(tables[0, NEXT])
    tables[0, NEXT] = (kept + 1) % KEPT
    first, values = HEAD + kept * LINES * (1 + n), own_array(0.0, (NODES,))
    c, k = own_motion(system.carrier, system.effects)
    fill(weights.nodes, length, max(c, 0.0), max(k, 0.0), values, tables[first : first + LINES])
    for i in range(n):
        at, rate = first + (1 + i) * LINES, drag_rate_of(system, i)
        if i > 0 and tables[at - LINES + NUMBERS, DAMPING] == rate:
            for line in range(LINES):
                for j in range(NODES):
                    tables[at + line, j] = tables[at - LINES + line, j]
        else:
            fill(weights.nodes, length, rate, 0.0, values, tables[at : at + LINES])
    return first


@numba.njit(**APART)
def carry_on(weights, ratio, tables):  # type: ignore[no-untyped-def]
    """Make the tables carry polynomials on into a step so many times as long."""
    values = own_array(0.0, (NODES,))
    for j in range(NODES):
        polynomials(weights.nodes, 1.0 + ratio * weights.nodes.at[j], values)
        for k in range(NODES):
            tables[CARRY + k, j] = values[k]
    tables[0, RATIO] = ratio


@numba.njit(**INLINED)
def place_of(system, first, q):  # type: ignore[no-untyped-def]
    """Of equation q: where its table begins, and where in the state x and v are."""
    ways = carrier_ways(system.carrier)
    if q < ways:
        return first, q, ways + q
    i = q - ways
    return first + (1 + i) * LINES, angle_at(system, i), rate_at(system, i)
