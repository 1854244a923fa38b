"""Which tables of responses a span of the equations of motion takes, made when first asked for.

A span of one length has a set of them: up to the nodes, and up to the samples in it, eight at a
time; each for every equation of second order, and for what is only integrated.
"""

import numba
import numpy as np

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
    DAMPING,
    LENGTH,
    LINES,
    NODES,
    NUMBERS,
    STIFFNESS,
    fill,
    polynomials,
)

COUNTS = (1, 2, 3, 4, 6, 8, 12, 16)
"""How many samples a span may have."""
SAMPLES = COUNTS[-1]
KEPT = 20
"""Lengths of spans whose tables are kept: all that there are for one length of steps."""
RATIO, NEXT, LATEST, CARRY, OWN = 0, 1, 2, 1, 1 + NODES
"""The head of the tables: in line 0 the ratio of spans for which the lines from CARRY on carry a
polynomial on, which of the sets kept is to go next, and where behind the head the one asked for
last begins; from line OWN on what is linear, see ``carriers.own_motion``."""
HEAD = OWN + own_motion.LINES
LINES_EACH = HEAD + KEPT * (1 + SAMPLES // NODES) * LINES
"""Enough for each equation, and for what is only integrated."""


def sample_instants() -> list[np.ndarray]:
    """For ``responses.nodes``: the samples in a span, as many as it may have, eight at a time.

    Where there are fewer than eight, the last one again.
    """
    return [
        np.minimum(np.arange(group + 1, group + 1 + NODES) / count, 1.0)
        for count in COUNTS
        for group in range(0, count, NODES)
    ]


@numba.njit(**INLINED)
def instants_of(count, group):  # type: ignore[no-untyped-def]
    """Which of the Nodes' sets of instants has a group of eight of so many samples."""
    chosen = 1 + group
    for each in COUNTS:
        if each == count:
            break
        chosen += (each + NODES - 1) // NODES
    return chosen


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
        has, of = tables[first + NUMBERS, LENGTH], tables[first + NUMBERS, COUNT]
        if has == length and abs(of) == count:
            if of < 0.0:
                fill_set(weights, system, length, count, first, tables)
            tables[0, LATEST] = first - HEAD
            return first
    kept = int(tables[0, NEXT])
    tables[0, NEXT] = (kept + 1) % KEPT
    first = HEAD + kept * every
    fill_set(weights, system, length, count, first, tables)
    tables[0, LATEST] = first - HEAD
    return first


def doubt(tables: np.ndarray, equations: int) -> None:
    """Have tables serve a system with other numbers: each is looked at when it is asked for."""
    every = (1 + SAMPLES // NODES) * LINES * (equations + 1)
    counts = tables[HEAD + NUMBERS : HEAD + KEPT * every : every, COUNT]
    counts[:] = -np.abs(counts)


@numba.njit(**INLINED)
def up_to_samples(system, first, group):  # type: ignore[no-untyped-def]
    """Where those of a set begin that reach up to the samples of a group of eight."""
    return first + (1 + group) * lines_for(system)


@numba.njit(**APART)
def fill_set(weights, system, length, count, first, tables):  # type: ignore[no-untyped-def]
    """The set for such a span, from a line on; what is there and serves stays.

    BEYOND of the tables up to the first samples is that of all samples.
    """
    every, equations = lines_for(system), equation_count(system)
    groups = (count + NODES - 1) // NODES
    for q in range(equations + 1):
        at = first + q * LINES
        # The last one is of what is only integrated.
        damping, stiffness = linear_part(system, tables, q) if q < equations else (0.0, 0.0)
        if serves(tables[at + NUMBERS], length, count, damping, stiffness):
            continue
        if q > 0 and serves(tables[at - LINES + NUMBERS], length, count, damping, stiffness):
            for group in range(1 + groups):
                for line in range(at + group * every, at + group * every + LINES):
                    for j in range(NODES):
                        tables[line, j] = tables[line - LINES, j]
            continue
        beyond = 0.0
        for group in range(1 + groups):
            chosen = 0 if group == 0 else instants_of(count, group - 1)
            own = tables[at + group * every : at + group * every + LINES]
            fill(weights.nodes, chosen, length, damping, stiffness, own)
            if group > 0:
                beyond = max(beyond, own[NUMBERS, BEYOND])
        tables[at + NUMBERS, COUNT], tables[at + every + NUMBERS, BEYOND] = count, beyond
    tables[first + NUMBERS, COUNT] = count


@numba.njit(**INLINED)
def serves(numbers, length, count, damping, stiffness):  # type: ignore[no-untyped-def]
    """Whether a table with these numbers is the one for such a span."""
    return (
        numbers[LENGTH] == length
        and abs(numbers[COUNT]) == count
        and numbers[DAMPING] == damping
        and numbers[STIFFNESS] == stiffness
    )


@numba.njit(**APART)
def carry_on(weights, ratio, tables):  # type: ignore[no-untyped-def]
    """Make the tables carry polynomials on into a span so many times as long."""
    values, nodes = own_array(0.0, (NODES,)), weights.nodes
    for j in range(NODES):
        polynomials(nodes.at, nodes.scale, 1.0 + ratio * nodes.at[j], values)
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
