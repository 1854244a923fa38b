"""Collocation on eight Gauss nodes, which are the lanes of one evaluation of the equations.

Deck and balls are written as x'' + c x' + k x = f: on axes that stand still during the step, with
the suspension's c and k at rest, and the drag of the race. f is a polynomial through its values at
the nodes; what that makes of deck and balls is exact (responses.py), however stiff; and Picard's
iteration finds the values. Each iteration evaluates the equations once, at all nodes at a time.
Iterations begin with the polynomial of the step before, carried on; behind a kink of the motion,
where there is none, the step is taken in parts of 1/8, 1/8, 1/4 and 1/2, as is fit for what decays
after a jump. A step whose iteration does not come to an end is taken in halves.

Of order 16 at the end of a step where the iterations are carried far enough: Gauss nodes, Hairer,
Norsett, Wanner, Solving Ordinary Differential Equations I, II.7; Hochbruck and Ostermann (2005),
Appl. Numer. Math. 53, 323-339: exponential collocation.
"""

import cmath
from typing import Any, NamedTuple

import numba
import numpy as np

from ab_sim.dynamics.dispatch import APART, INLINED
from ab_sim.dynamics.layout import angle_at, rate_at, state_count, state_size
from ab_sim.dynamics.numbers.across import column_of, product, put_column, total
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.numbers.lanes import as_lanes
from ab_sim.dynamics.race.ball import ball_of
from ab_sim.dynamics.slope import inlined_evaluate
from ab_sim.dynamics.system import (
    MOBILITY,
    RACE_RADIUS,
    Plant,
    ball_count,
    ball_drag,
    carrier_ways,
    own_motion,
    segment_speed,
    turn,
    unturned,
)
from ab_sim.integrate.on_stack import own_array, own_room
from ab_sim.integrate.registry import Parameter, register_family
from ab_sim.integrate.responses import (
    DAMPING,
    END_V,
    END_X,
    IMPULSE,
    IMPULSE_RATE,
    INTO_V,
    INTO_X,
    LAST,
    LAST_RATE,
    LENGTH,
    LINES,
    NODES,
    NUMBERS,
    STIFFNESS,
    YIELD,
    Nodes,
    fill,
    gauss,
    nodes,
    polynomials,
)
from ab_sim.integrate.stepper import Stepper
from ab_sim.integrate.workspace import aligned

AT, SHARE, INTEGRAL = 0, 1, 2
"""Lines: c_j; the weights of the quadrature over the step; and eight of that up to the nodes."""
KEPT = 4
"""Lengths of steps whose tables are kept: what a graded start takes, and the step itself."""
RATIO, NEXT, CARRY = 0, 1, 1
"""The head of the tables: in line 0 the ratio of steps for which the lines from CARRY on carry a
polynomial on, and which of the tables kept is to go next."""
HEAD = 1 + NODES
MOST = 16
"""Iterations after which a step is taken in halves."""
PARTS = 64
"""The finest parts of a step; one that cannot be solved is given up: its result is not finite."""
FIRST = PARTS // 8
FARTHEST = 2.0
"""A step so many times longer than the one before does not begin with its polynomial."""


class Weights(NamedTuple):
    """What a step is made with."""

    nodes: Nodes
    lines: np.ndarray
    """In lanes: see AT, SHARE, INTEGRAL; shape (10, 8)."""
    tolerance: float
    """rad."""

    def step(self, plant: Any, begin: float, length: float, state: Any, work: Any) -> None:
        """See ``Stepper.weights``."""
        collocation_step(self, plant, begin, length, state, work)


TOLERANCE = Parameter(
    "what iterations may leave of an error in each step, in balls' angles and in the deck's "
    "displacement over the race's radius [rad]",
    1e-12,
    1e-16,
    1e-2,
)


def growth_of(z: complex) -> complex:
    """What a step makes of what it solves exactly: drag, and the deck's own motion."""
    return cmath.exp(complex(min(z.real, 0.0), z.imag))


@register_family("collocation", {"tolerance": TOLERANCE})
def collocation(tolerance: float) -> Stepper:
    """The method whose iterations end at a tolerance [rad]."""
    own, lines = nodes(), aligned((INTEGRAL + NODES, NODES))
    lines[AT], lines[SHARE] = gauss(NODES)
    values = np.empty(NODES)
    for j, end in enumerate(own.at):
        for x, w in own.points.T:
            polynomials.py_func(own, end * x, values)
            lines[INTEGRAL:, j] += end * w * values
    return Stepper(
        "collocation",
        2 * NODES,
        "Hochbruck and Ostermann (2005), Appl. Numer. Math. 53, 323-339, on Gauss nodes",
        Weights(own, lines, tolerance),
        evaluations=5 * NODES,
        growth=growth_of,
        slopes=1,
        memory=NODES + 1,
        tables=HEAD + KEPT * LINES,
        solves_drag=True,
        solves_own_motion=True,
        locates_events=False,
        priced=False,
    )


@numba.njit(**APART)
def collocation_step(weights, plant, begin, length, state, work):  # type: ignore[no-untyped-def]
    """One step of the method; see ``Stepper.weights``.

    Memory: f at the nodes of the step before, on the rotor's axes at its end, in the columns of the
    velocities; and in the last row how long that step was [s].
    """
    trial, past = work.trial, work.memory[NODES]
    for j in range(state_size(plant.system, state)):
        trial[j] = state[j]
    size = PARTS
    if not length <= FARTHEST * past[0]:
        size = FIRST
        begin_anew(plant, begin, length * (FIRST / PARTS), state, work)
    done = 0
    while done < PARTS:
        share = size / PARTS
        if part(weights, plant, begin + (done / PARTS) * length, share * length, trial, work):
            done += size
            size = done & -done
        elif size > 1:
            size //= 2
        else:
            trial[0] = np.nan
            break


@numba.njit(**APART)
def begin_anew(plant, begin, length, state, work):  # type: ignore[no-untyped-def]
    """Fill the memory as if f had been so far what it is now."""
    system, memory, slope = plant.system, work.memory, work.slopes[0]
    ways, n = carrier_ways(system.carrier), ball_count(system)
    c, k = own_motion(system.carrier, system.effects)
    w = segment_speed(plant.place.segment, begin)
    acceleration = unturned(system.carrier, 1.0, 0.0, w, state, slope)
    for row in range(NODES):
        for q in range(ways):
            memory[row, ways + q] = acceleration[q] + c * state[ways + q] + k * state[q]
        for i in range(n):
            at = rate_at(system, i)
            memory[row, at] = slope[at] + drag_rate_of(system, i) * state[at]
    memory[NODES, 0] = length


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
def part(weights, plant, begin, length, state, work):  # type: ignore[no-untyped-def]
    """One step or a part of it, from the state and the memory, which both go to its end.

    Returns:
        Whether the iterations have come to an end; else nothing has changed.
    """
    system, memory = plant.system, work.memory
    carrier, n, states = system.carrier, ball_count(system), state_size(system, state)
    ways = carrier_ways(carrier)
    first = first_line(weights, system, length, work.tables)
    ratio = length / memory[NODES, 0]
    if work.tables[0, RATIO] != ratio:
        carry_on(weights, ratio, work.tables)
    lines, tables = as_lanes(weights.lines), as_lanes(work.tables)
    numbers = work.tables
    time = begin + length * lines[AT]
    w = segment_speed(plant.place.segment, time) + 0.0 * time
    cos, sin = cos_sin(length * product(lines, INTEGRAL, w))
    end_cos, end_sin = cos_sin(length * total(lines[SHARE] * w))

    size = state_count(system, state)
    force, found = own_array(time, (size,)), own_array(time, (size,))
    homogeneous = own_array(time, (size,))
    at, slope = own_array(time, (size,)), own_array(time, (size,))
    own = Plant(system, plant.place, plant.modes, own_room(system, n, time))
    for j in range(states):
        at[j] = state[j] + 0.0 * time
    for q in range(ways + n):
        own_table, x, v = place_of(system, first, q)
        force[q] = product(tables, CARRY, column_of(memory, v))
        c = numbers[own_table + NUMBERS, DAMPING]
        k = numbers[own_table + NUMBERS, STIFFNESS]
        g, r = tables[own_table + IMPULSE], tables[own_table + IMPULSE_RATE]
        homogeneous[2 * q] = state[x] + (r + c * g - 1.0) * state[x] + g * state[v]
        homogeneous[2 * q + 1] = r * state[v] - (k * g) * state[x]

    c = numbers[first + NUMBERS, DAMPING]
    k = numbers[first + NUMBERS, STIFFNESS]
    before, solved = 0.0, False
    for _ in range(MOST):
        for q in range(ways + n):
            own_table, x, v = place_of(system, first, q)
            at[x] = homogeneous[2 * q] + product(tables, own_table + INTO_X, force[q])
            at[v] = homogeneous[2 * q + 1] + product(tables, own_table + INTO_V, force[q])
        for q in range(ways):
            found[q] = c * at[ways + q] + k * at[q]
        turn(carrier, cos, sin, at)
        inlined_evaluate(own, time, at, slope)
        acceleration = unturned(carrier, cos, sin, w, at, slope)
        change, sum_of = 0.0 * time, 0.0 * time
        for q in range(ways):
            found[q] += acceleration[q]
            change += abs(found[q] - force[q])
            sum_of += abs(found[q])
            force[q] = found[q]
        if n > 0:
            change *= numbers[first + NUMBERS, YIELD] / system.balls[0, RACE_RADIUS]
        for i in range(n):
            own_table, x, v = place_of(system, first, ways + i)
            rate = numbers[own_table + NUMBERS, DAMPING]
            new = slope[v] + rate * at[v]
            change += abs(new - force[ways + i]) * numbers[own_table + NUMBERS, YIELD]
            force[ways + i] = new
        # Each iteration leaves of an error what it left of the one before.
        most, last = weights.tolerance * (1.0 if n > 0 else total(sum_of)), total(change)
        if last <= most or last * last <= most * before:
            solved = True
            break
        before = last
    if not solved:
        return False

    for j in range(rate_at(system, n), states):
        state[j] += length * total(lines[SHARE] * slope[j])
    for q in range(ways + n):
        own_table, x, v = place_of(system, first, q)
        c = numbers[own_table + NUMBERS, DAMPING]
        k = numbers[own_table + NUMBERS, STIFFNESS]
        g = numbers[own_table + NUMBERS, LAST]
        r = numbers[own_table + NUMBERS, LAST_RATE]
        from_x, from_v = state[x], state[v]
        state[x] = from_x + (
            (r + c * g - 1.0) * from_x + g * from_v + total(tables[own_table + END_X] * force[q])
        )
        state[v] = r * from_v - k * g * from_x + total(tables[own_table + END_V] * force[q])
    turn(carrier, end_cos, end_sin, state)
    turned(force, end_cos, end_sin)
    for q in range(ways + n):
        _, _, v = place_of(system, first, q)
        put_column(force[q], memory, v)
    memory[NODES, 0] = length
    return True


@numba.njit(**INLINED)
def turned(force, c, s):  # type: ignore[no-untyped-def]
    """The deck's f onto the rotor's axes at the step's end."""
    one, two = force[0], force[1]
    force[0], force[1] = c * one + s * two, c * two - s * one


@numba.njit(**INLINED)
def place_of(system, first, q):  # type: ignore[no-untyped-def]
    """Of equation q: where its table begins, and where in the state x and v are."""
    ways = carrier_ways(system.carrier)
    if q < ways:
        return first, q, ways + q
    i = q - ways
    return first + (1 + i) * LINES, angle_at(system, i), rate_at(system, i)
