"""Which tables of responses a span of the equations of motion takes, made when first asked for.

A span of one length has a set of them: up to the nodes, and up to the samples in it, eight at a
time; each for every equation of second order, and for what is only integrated.
"""

import numba

from ab_sim.dynamics.carriers import own_motion
from ab_sim.dynamics.carriers.own_motion import DAMPINGS, STIFFNESSES
from ab_sim.dynamics.dispatch import APART, INLINED
from ab_sim.dynamics.layout import equation_count
from ab_sim.dynamics.race.ball import ball_of
from ab_sim.dynamics.system import (
    DIRECTION,
    MOBILITY,
    ball_count,
    ball_drag,
    carrier_coordinates,
    has_motor,
)
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
RATIO, NEXT, LATEST, CARRY, OWN = 0, 1, 2, 1, 1 + NODES
"""The head of the tables: in line 0 the ratio of spans for which the lines from CARRY on carry a
polynomial on, which of the sets kept is to go next, and where behind the head the one asked for
last begins; from line OWN on what is linear, see ``carriers.own_motion``."""
HEAD = OWN + own_motion.LINES
LINES_EACH = HEAD + KEPT * (1 + SAMPLES // NODES) * LINES
"""Enough for each equation, and for what is only integrated."""


@numba.njit(**INLINED)
def drag_rate_of(system, i):  # type: ignore[no-untyped-def]
    """Rate at which drag slows down ball i on a deck that does not move [1/s]."""
    return ball_drag(system.effects, ball_of(system, i)) * system.balls[i, MOBILITY]


@numba.njit(**INLINED)
def linear_part(system, tables, q):  # type: ignore[no-untyped-def]
    """c [1/s] and k [1/s^2] of equation q."""
    first, n = carrier_coordinates(system.carrier), ball_count(system)
    if q < first:
        return tables[OWN + DAMPINGS, q], tables[OWN + STIFFNESSES, q]
    if q < first + n:
        return drag_rate_of(system, q - first), 0.0
    return tables[OWN + DAMPINGS, first], 0.0


@numba.njit(**INLINED)
def lines_for(system):  # type: ignore[no-untyped-def]
    """How many lines all tables up to the same instants have."""
    return LINES * (equation_count(system) + 1)


@numba.njit(**INLINED)
def first_line(weights, system, length, count, tables):  # type: ignore[no-untyped-def]
    """Where the set for a span of that length [s] with so many samples begins, made if need be."""
    first = HEAD + int(tables[0, LATEST])
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
            tables[0, LATEST] = first - HEAD
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
    fill_all(weights, system, length, ends, values, tables, first)
    for group in range((count + NODES - 1) // NODES):
        for j in range(NODES):
            ends[j] = min(1.0, (NODES * group + j + 1) / count)
        at = first + (1 + group) * every
        fill_all(weights, system, length, ends, values, tables, at)
        for line in range(NUMBERS, every, LINES):
            most = max(tables[at + line, BEYOND], tables[first + every + line, BEYOND])
            tables[first + every + line, BEYOND] = most
    tables[first + NUMBERS, COUNT] = count
    tables[0, LATEST] = first - HEAD
    return first


@numba.njit(**APART)
def fill_all(weights, system, length, ends, values, tables, first):  # type: ignore[no-untyped-def]
    """The tables of all equations up to the same instants; see ``responses.fill``."""
    equations, before = equation_count(system), (-1.0, -1.0)
    for q in range(equations + 1):
        c, k = linear_part(system, tables, q) if q < equations else (0.0, 0.0)
        at = first + q * LINES
        if q > 0 and (c, k) == before:
            for line in range(LINES):
                for j in range(NODES):
                    tables[at + line, j] = tables[at - LINES + line, j]
        else:
            fill(weights.nodes, length, c, k, ends, values, tables[at : at + LINES])
        before = c, k


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
def table_of(plant, first, q):  # type: ignore[no-untyped-def]
    """Where the table of equation q begins.

    The speed loop of a motor at its limit is open: its spindle's acceleration is only integrated.
    """
    system, n = plant.system, ball_count(plant.system)
    if has_motor(system.effects) and q == carrier_coordinates(system.carrier) + n:
        if plant.modes[n, DIRECTION] != 0:
            return integral_line(system, first)
    return first + q * LINES


@numba.njit(**INLINED)
def integral_line(system, first):  # type: ignore[no-untyped-def]
    """Where the table of what is only integrated begins: v is the integral of f, G is time."""
    return first + equation_count(system) * LINES
