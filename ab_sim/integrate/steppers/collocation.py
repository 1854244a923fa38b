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
from ab_sim.dynamics.layout import rate_at, state_count, state_size
from ab_sim.dynamics.numbers.across import column_of, product, put_column, total
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.numbers.lanes import as_lanes
from ab_sim.dynamics.slope import inlined_evaluate
from ab_sim.dynamics.system import (
    RACE_RADIUS,
    Plant,
    ball_count,
    carrier_ways,
    own_motion,
    segment_speed,
    turn,
    unturned,
)
from ab_sim.integrate.on_stack import own_array, own_room
from ab_sim.integrate.registry import Parameter, register_family
from ab_sim.integrate.response_tables import (
    CARRY,
    LINES_EACH,
    RATIO,
    carry_on,
    drag_rate_of,
    first_line,
    place_of,
)
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
    LAST_UNIT,
    NODES,
    NUMBERS,
    STIFFNESS,
    UNIT,
    Nodes,
    gauss,
    nodes,
    polynomials,
)
from ab_sim.integrate.stepper import Stepper
from ab_sim.integrate.workspace import aligned

AT, SHARE, INTEGRAL = 0, 1, 2
"""Lines: c_j; the weights of the quadrature over the step; and eight of that up to the nodes."""
MOST = 16
"""Iterations after which a step is taken in halves."""
SETTLED = 1e-10
"""Changes [rad] below this that no longer shrink are rounding."""
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
        tables=LINES_EACH,
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
def part(weights, plant, begin, length, state, work):  # type: ignore[no-untyped-def]
    """One step or a part of it, from the state and the memory, which both go to its end.

    Returns:
        Whether the iterations have come to an end; else nothing has changed.
    """
    system, memory, numbers = plant.system, work.memory, work.tables
    n, ways = ball_count(system), carrier_ways(system.carrier)
    states, size = state_size(system, state), state_count(system, state)
    first = first_line(weights, system, length, numbers)
    ratio = length / memory[NODES, 0]
    if numbers[0, RATIO] != ratio:
        carry_on(weights, ratio, numbers)
    lines, tables = as_lanes(weights.lines), as_lanes(numbers)
    time = begin + length * lines[AT]
    w = segment_speed(plant.place.segment, time)
    turned = cos_sin(length * product(lines, INTEGRAL, w))

    force, at, slope = own_array(time, (size,)), own_array(time, (size,)), own_array(time, (size,))
    free_x, free_v = own_array(time, (size,)), own_array(time, (size,))
    for j in range(states):
        at[j] = 0.0
    for q in range(ways + n):
        table, x, v = place_of(system, first, q)
        force[q] = product(tables, CARRY, column_of(memory, v))
        k = numbers[table + NUMBERS, STIFFNESS]
        g = tables[table + IMPULSE]
        free_x[q] = state[x] + (g * state[v] - tables[table + UNIT] * (k * state[x]))
        free_v[q] = tables[table + IMPULSE_RATE] * state[v] - g * (k * state[x])

    own = Plant(system, plant.place, plant.modes, own_room(system, n, time))
    before, solved = 0.0, False
    for _ in range(MOST):
        for q in range(ways + n):
            table, x, v = place_of(system, first, q)
            at[x] = free_x[q] + product(tables, table + INTO_X, force[q])
            at[v] = free_v[q] + product(tables, table + INTO_V, force[q])
        last, all_of = iterate(own, time, w, turned, at, slope, force, first, numbers)
        # Each iteration leaves of an error what it left of the one before.
        most = weights.tolerance * all_of
        shrinks = last < 0.5 * before or before == 0.0
        if (
            last <= most
            or last * last <= most * before
            or (last <= SETTLED * all_of and not shrinks)
        ):
            solved = True
            break
        before = last
    if not solved:
        return False

    for j in range(rate_at(system, n), states):
        state[j] += length * total(lines[SHARE] * slope[j])
    for q in range(ways + n):
        table, x, v = place_of(system, first, q)
        k = numbers[table + NUMBERS, STIFFNESS] * state[x]
        u, g = numbers[table + NUMBERS, LAST_UNIT], numbers[table + NUMBERS, LAST]
        r = numbers[table + NUMBERS, LAST_RATE]
        state[x] += (g * state[v] - u * k) + total(tables[table + END_X] * force[q])
        state[v] = (r * state[v] - g * k) + total(tables[table + END_V] * force[q])
    c, s = cos_sin(length * total(lines[SHARE] * w))
    turn(system.carrier, c, s, state)
    force[0], force[1] = c * force[0] + s * force[1], c * force[1] - s * force[0]
    for q in range(ways + n):
        put_column(force[q], memory, place_of(system, first, q)[2])
    memory[NODES, 0] = length
    return True


@numba.njit(**INLINED)
def iterate(plant, time, w, turned, at, slope, force, first, numbers):  # type: ignore[no-untyped-def]
    """f at the nodes of the states there, which are on axes that stand still, and then no more.

    Returns:
        How much that is from what it was, as an angle at the step's end; and what that is to be
        measured by: 1, or without a ball all of f.
    """
    system = plant.system
    carrier, n, ways = system.carrier, ball_count(system), carrier_ways(system.carrier)
    c, k = numbers[first + NUMBERS, DAMPING], numbers[first + NUMBERS, STIFFNESS]
    change, all_of = 0.0 * time, 0.0 * time
    # Here and below two axes: of a carrier whose own motion is one along each.
    linear = c * at[ways] + k * at[0], c * at[ways + 1] + k * at[1]
    turn(carrier, turned[0], turned[1], at)
    inlined_evaluate(plant, time, at, slope)
    acceleration = unturned(carrier, turned[0], turned[1], w, at, slope)
    for q in range(ways):
        new = acceleration[q] + linear[q]
        change += abs(new - force[q])
        all_of += abs(new)
        force[q] = new
    if n > 0:
        change *= numbers[first + NUMBERS, LAST_UNIT] / system.balls[0, RACE_RADIUS]
    for i in range(n):
        table, _, v = place_of(system, first, ways + i)
        new = slope[v] + numbers[table + NUMBERS, DAMPING] * at[v]
        change += abs(new - force[ways + i]) * numbers[table + NUMBERS, LAST_UNIT]
        force[ways + i] = new
    return total(change), 1.0 if n > 0 else total(all_of)
