"""Which tables of responses a span of the equations of motion takes, made when first asked for.

A span of one length has a set of them: up to the nodes, and up to the samples in it, eight at a
time; each for the deck, for each ball, and for what is only integrated.
"""

import numba

from ab_sim.dynamics.dispatch import APART, INLINED
from ab_sim.dynamics.layout import angle_at, rate_at
from ab_sim.dynamics.race.ball import ball_of
from ab_sim.dynamics.system import MOBILITY, ball_count, ball_drag, carrier_ways, own_motion
from ab_sim.integrate.on_stack import own_array
from ab_sim.integrate.responses import (
    BEYOND,
    COUNT,
    LENGTH,
    LINES,
    NODES,
    NUMBERS,
    fill,
    polynomials,
)

SAMPLES = 2 * NODES
"""The most that a span may have."""
KEPT = 16
"""Lengths of spans whose tables are kept: all that there are for one length of steps."""
RATIO, NEXT, LATEST, CARRY = 0, 1, 2, 1
"""The head of the tables: in line 0 the ratio of spans for which the lines from CARRY on carry a
polynomial on, which of the sets kept is to go next, and the line where the one asked for last
begins."""
HEAD = 1 + NODES
LINES_EACH = HEAD + KEPT * (1 + SAMPLES // NODES) * LINES
"""Enough for each ball, what carries them, and what is only integrated."""


@numba.njit(**INLINED)
def drag_rate_of(system, i):  # type: ignore[no-untyped-def]
    """Rate at which drag slows down ball i on a deck that does not move [1/s]."""
    return ball_drag(system.effects, ball_of(system, i)) * system.balls[i, MOBILITY]


@numba.njit(**INLINED)
def lines_for(system):  # type: ignore[no-untyped-def]
    """How many lines all tables up to the same instants have."""
    return LINES * (2 + ball_count(system))


@numba.njit(**INLINED)
def first_line(weights, system, length, count, tables):  # type: ignore[no-untyped-def]
    """Where the set for a span of that length [s] with so many samples begins, made if need be."""
    first = int(tables[0, LATEST])
    if tables[first + NUMBERS, LENGTH] == length and tables[first + NUMBERS, COUNT] == count:
        return first
    return found(weights, system, length, count, tables)


@numba.njit(**APART)
def found(weights, system, length, count, tables):  # type: ignore[no-untyped-def]
    """The same, where it is not the one asked for last."""
    every = (1 + SAMPLES // NODES) * lines_for(system)
    for kept in range(KEPT):
        first = HEAD + kept * every
        if tables[first + NUMBERS, LENGTH] == length and tables[first + NUMBERS, COUNT] == count:
            tables[0, LATEST] = first
            return first
    return made_anew(weights, system, length, count, tables)


@numba.njit(**INLINED)
def up_to_samples(system, first, group):  # type: ignore[no-untyped-def]
    """Where those of a set begin that reach up to the samples of a group of eight."""
    return first + (1 + group) * lines_for(system)


@numba.njit(**APART)
def made_anew(weights, system, length, count, tables):  # type: ignore[no-untyped-def]
    """The set for such a span, in place of the oldest; returns where it begins.

    BEYOND of the tables up to the first samples is that of all samples.
    """
    kept = int(tables[0, NEXT])
    tables[0, NEXT] = (kept + 1) % KEPT
    every = lines_for(system)
    first = HEAD + kept * (1 + SAMPLES // NODES) * every
    values, ends = own_array(0.0, (NODES,)), own_array(0.0, (NODES,))
    for j in range(NODES):
        ends[j] = weights.nodes.at[j]
    fill_all(weights, system, length, ends, values, tables[first : first + every])
    for group in range((count + NODES - 1) // NODES):
        for j in range(NODES):
            ends[j] = min(1.0, (NODES * group + j + 1) / count)
        at = first + (1 + group) * every
        fill_all(weights, system, length, ends, values, tables[at : at + every])
        for line in range(NUMBERS, every, LINES):
            most = max(tables[at + line, BEYOND], tables[first + every + line, BEYOND])
            tables[first + every + line, BEYOND] = most
    tables[first + NUMBERS, COUNT] = count
    tables[0, LATEST] = first
    return first


@numba.njit(**APART)
def fill_all(weights, system, length, ends, values, tables):  # type: ignore[no-untyped-def]
    """The tables of all equations up to the same instants; see ``responses.fill``."""
    n = ball_count(system)
    c, k = own_motion(system.carrier, system.effects)
    fill(weights.nodes, length, max(c, 0.0), max(k, 0.0), ends, values, tables[:LINES])
    for i in range(n):
        at, same = (1 + i) * LINES, False
        if i > 0:
            same = drag_rate_of(system, i) == drag_rate_of(system, i - 1)
        if same:
            for line in range(LINES):
                for j in range(NODES):
                    tables[at + line, j] = tables[at - LINES + line, j]
        else:
            rate = drag_rate_of(system, i)
            fill(weights.nodes, length, rate, 0.0, ends, values, tables[at : at + LINES])
    fill(weights.nodes, length, 0.0, 0.0, ends, values, tables[integral_line(system, 0) :])


@numba.njit(**APART)
def carry_on(weights, ratio, tables):  # type: ignore[no-untyped-def]
    """Make the tables carry polynomials on into a span so many times as long."""
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


@numba.njit(**INLINED)
def integral_line(system, first):  # type: ignore[no-untyped-def]
    """Where the table of what is only integrated begins: v is the integral of f, G is time."""
    return first + (1 + ball_count(system)) * LINES
