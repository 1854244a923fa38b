"""One span of collocation: its polynomials f found by iteration, and the motion anywhere in it.

What carries the balls, the balls, and a motor's spindle are written as x'' + c x' + k x = f: of the
first its own motion at rest (``carriers.own_motion``), of balls the race's drag, of the spindle its
speed loop's. f is a polynomial through its values at eight Gauss nodes, which are the lanes of one
evaluation of the equations; what that makes of x is exact (responses.py), however stiff, and at any
instant of the span.

A span is kept whole in a run's memory, which belongs to the state. Its lines are f of each such
equation at the nodes, and the slope of what else there is; the state at the beginning, in the first
column of as many lines more; the head; and a line for who goes over events.
"""

import math

import numba

from ab_sim.dynamics.dispatch import APART, INLINED, chosen_by
from ab_sim.dynamics.layout import (
    angle_and_rate_at,
    angle_at,
    equation_count,
    integral_at,
    integrals_at,
    rate_at,
    spindle_angle_at,
    spindle_speed_at,
    state_count,
    state_size,
)
from ab_sim.dynamics.numbers.across import product, total
from ab_sim.dynamics.numbers.cos_sin import SMALL, cos_sin, turned
from ab_sim.dynamics.numbers.lanes import as_lanes
from ab_sim.dynamics.race.table import COS, SIN
from ab_sim.dynamics.slope import evaluate
from ab_sim.dynamics.spindle_motion import spindle_motion
from ab_sim.dynamics.system import (
    Plant,
    ball_count,
    carrier_coordinates,
    coordinate_accelerations,
    from_coordinates,
    has_motor,
    on_next_axes,
    segment_speed,
    to_coordinates,
)
from ab_sim.integrate.iteration import Motion, freely, hangs_freely, iterate, response
from ab_sim.integrate.left_out import left_out
from ab_sim.integrate.on_stack import own_array, own_room
from ab_sim.integrate.response_tables import (
    CARRY,
    HEAD,
    OWN,
    RATIO,
    carry_on,
    first_line,
    integral_line,
    linear_part,
    table_of,
    up_to_samples,
)
from ab_sim.integrate.responses import (
    DAMPING,
    IMPULSE,
    INTO_V,
    NUMBERS,
    STIFFNESS,
)

AT, SHARE = 0, 1
"""Lines of the weights: c_j, and the weights of the quadrature over the span; left_out.COEFFICIENTS
follow."""
MOST = 16
"""Iterations after which a span is given up."""
SETTLED = 1e-10
"""Changes [rad] below this that no longer shrink are rounding."""
FED_BACK = 1.0 / 70.0
"""Of an error within a span, what an iteration makes of it, and so the motion at its end."""

SPAN, SAMPLES_IN, TAKEN, BEGIN, MOVED, STEP, AHEAD, WAIT = range(8)
"""The memory's head: length of the span [s]; how many samples there are in it, and how many have
been taken; local time of its beginning [s]; the angle that the rotor's axes make in it; from one
sample to the next [s]; and what only the stepper knows, twice."""


@numba.njit(**INLINED)
def head_at(system, state):  # type: ignore[no-untyped-def]
    """Which line of the memory its head is."""
    return 2 * state_size(system, state)


@numba.njit(**INLINED)
def into_equations(system, own, state, x, v):  # type: ignore[no-untyped-def]
    """x and v of all equations, of a state at a span's beginning."""
    to_coordinates(system.carrier, own, state, x, v)
    for q in range(carrier_coordinates(system.carrier), equation_count(system)):
        angle, rate = angle_and_rate_at(system, q)
        x[q], v[q] = state[angle], state[rate]


@numba.njit(**APART)
def begin_anew(plant, begin, length, state, work):  # type: ignore[no-untyped-def]
    """Fill the memory as if f had been so far, for so long, what it is now."""
    system, slope = plant.system, work.slopes[0]
    states, size = state_size(system, state), state_count(system, state)
    memory, head = as_lanes(work.memory), work.memory[head_at(system, state)]
    own, ways = work.tables[OWN:HEAD], carrier_coordinates(system.carrier)
    x, v = own_array(0.0, (size,)), own_array(0.0, (size,))
    force = own_array(0.0, (size,))
    evaluate(plant, begin, state, slope)
    spindle = spindle_motion(plant, begin, state)
    into_equations(system, own, state, x, v)
    coordinate_accelerations(system.carrier, plant, spindle, own, (1.0, 0.0), state, force)
    for q in range(equation_count(system)):
        if q >= ways:
            force[q] = slope[angle_and_rate_at(system, q)[1]]
        c, k = linear_part(system, work.tables, q)
        memory[q] = force[q] + c * v[q] + k * x[q]
    for j in range(integrals_at(system), states):
        memory[j] = slope[j]
    head[SPAN] = length
    head[MOVED] = head[WAIT] = 0.0


@numba.njit(**INLINED)
def _as_prescribed(plant, tables, first, time, state, at, x, v):  # type: ignore[no-untyped-def]
    w = segment_speed(plant.place.segment, time)
    axes = cos_sin(product(tables, integral_line(plant.system, first) + INTO_V, w))
    return axes, spindle_motion(plant, time, at)


@numba.njit(**INLINED)
def _as_driven(plant, tables, first, time, state, at, x, v):  # type: ignore[no-untyped-def]
    system, angle = plant.system, spindle_angle_at(plant.system)
    q = equation_count(system) - 1
    at[angle], at[spindle_speed_at(system)] = x[q], v[q]
    axes = cos_sin(x[q] - state[angle])
    return axes, spindle_motion(plant, time, at)


turning = chosen_by(has_motor, _as_driven, _as_prescribed)
"""Cosine and sine of the angle that the rotor's axes have turned in a span, and the Spindle's
motion; ``(plant, tables, first, time, state, at, x, v)``: of the state at the beginning, and with a
motor of x and v, which go into the states."""


@numba.njit(**INLINED)
def solve_span(weights, plant, begin, length, samples, allowed, state, work):  # type: ignore[no-untyped-def]
    """A span from a state, with so many samples in it, into the memory, which holds the one before.

    Args:
        weights: see ``steppers.collocation``.
        plant: the Plant.
        begin, length: local time and s.
        samples: how many.
        allowed: error above which a span is not taken [rad].
        state: the state at its beginning.
        work: the Workspace.

    Returns:
        The error [rad] that is expected of the samples because f is a polynomial, infinite where
        the iterations have come to no end; if it is more than allowed, nothing has changed. And the
        error anywhere within the span.
    """
    system, numbers, head = plant.system, work.tables, work.memory[head_at(plant.system, state)]
    n, ways = ball_count(system), carrier_coordinates(system.carrier)
    equations, integrals = equation_count(system), integrals_at(system)
    states, size = state_size(system, state), state_count(system, state)
    first = first_line(weights, system, length, samples, numbers)
    if numbers[0, RATIO] * head[SPAN] != length:
        carry_on(weights, length / head[SPAN], numbers)
    lines, tables, memory = as_lanes(weights.lines), as_lanes(numbers), as_lanes(work.memory)
    time = begin + length * lines[AT]

    force, at, slope = own_array(time, (size,)), own_array(time, (size,)), own_array(time, (size,))
    x, v = own_array(time, (size,)), own_array(time, (size,))
    free_x, free_v = own_array(time, (size,)), own_array(time, (size,))
    cosines, sines = own_array(time, (size,)), own_array(time, (size,))
    first_x, first_v = own_array(0.0, (size,)), own_array(0.0, (size,))
    into_equations(system, numbers[OWN:HEAD], state, first_x, first_v)
    for j in range(states):
        at[j] = state[j]
    for q in range(equations):
        force[q] = product(tables, CARRY, memory[q])
    c, s = cos_sin(head[MOVED])
    on_next_axes(system.carrier, c, s, force)
    for q in range(equations):
        table = table_of(plant, first, q)
        free_x[q], free_v[q] = freely(numbers, table, first_x[q], first_v[q])
        if q < ways and hangs_freely(system):
            damping = numbers[table + NUMBERS, DAMPING]
            stiffness = numbers[table + NUMBERS, STIFFNESS]
            free_x[q] = damping * free_v[q] + stiffness * free_x[q]
        elif q < ways or q >= ways + n:
            x[q], v[q] = response(tables, table, free_x[q], free_v[q], force[q])
    for j in range(integrals, states):
        slope[j] = product(tables, CARRY, memory[j])
    integrate(system, tables, first, state, slope, at)

    own = Plant(system, plant.place, plant.modes, own_room(system, n, time))
    axes, spindle = turning(own, tables, first, time, state, at, x, v)
    before, solved, scales = math.inf, False, (1.0, 1.0)
    carried_before, turned_before = 0.0, 0.0
    for count in range(MOST):
        for i in range(n):
            q, angle = ways + i, angle_at(system, i)
            was = at[angle]
            at[angle], at[rate_at(system, i)] = response(
                tables, table_of(plant, first, q), free_x[q], free_v[q], force[q]
            )
            if not turned_before <= SMALL or count == 0:
                c, s = cos_sin(at[angle])
            else:
                c, s = turned(cosines[i], sines[i], at[angle] - was)
            own.room.table[i, COS], own.room.table[i, SIN] = cosines[i], sines[i] = c, s
        motion = Motion(at, slope, force, x, v, free_x, free_v)
        carried, turned_by, scales = iterate(own, spindle, axes, motion, first, numbers)
        # Each iteration leaves of an error what it left of the one before: of each kind of its own.
        last = carried + turned_by
        left = remains(carried, carried_before) + remains(turned_by, turned_before)
        if left <= weights.tolerance or (last <= SETTLED and not last < 0.5 * before):
            solved = True
            break
        carried_before, turned_before, before = carried, turned_by, last
        if has_motor(system.effects):
            integrate(system, tables, first, state, slope, at)
            axes, spindle = turning(own, tables, first, time, state, at, x, v)
    if not solved:
        return math.inf, math.inf
    error, within = left_out(plant, first, numbers, lines, force, scales)
    # What is wrong within the span acts on f; the end alone may be right by chance.
    error = max(error, FED_BACK * within)
    if not error <= allowed:  # not a number, neither
        return error, within

    for j in range(states):
        memory[states + j] = state[j]
    for j in range(integrals, states):
        memory[j] = slope[j]
    for q in range(equations):
        memory[q] = force[q]
    head[SPAN], head[SAMPLES_IN], head[TAKEN], head[BEGIN] = length, samples, 0.0, begin
    head[MOVED] = length * total(lines[SHARE] * spindle.speed)
    return error, within


@numba.njit(**INLINED)
def remains(change, before):  # type: ignore[no-untyped-def]
    """What the next iteration will change, after such a change and the one before; 0 before any."""
    return change * (change / before) if before > change else change


@numba.njit(**INLINED)
def integrate(system, tables, first, state, slope, at):  # type: ignore[no-untyped-def]
    """The speed loop's integral at the nodes: nothing else depends on what is only integrated."""
    if has_motor(system.effects):
        j, line = integral_at(system), integral_line(system, first) + INTO_V
        at[j] = state[j] + product(tables, line, slope[j])


@numba.njit(**INLINED)
def states_in_span(weights, plant, group, state, work, at):  # type: ignore[no-untyped-def]
    """The states at eight samples of the span in memory.

    Args:
        weights: see ``steppers.collocation``.
        plant: the Plant.
        group: which eight.
        state: any state.
        work: the Workspace.
        at: where they go, lanes, shape (states,).

    Returns:
        Local times [s], lanes.
    """
    system, numbers, head = plant.system, work.tables, work.memory[head_at(plant.system, state)]
    ways, equations = carrier_coordinates(system.carrier), equation_count(system)
    states, size = state_size(system, state), state_count(system, state)
    lines, tables, memory = as_lanes(weights.lines), as_lanes(numbers), as_lanes(work.memory)
    length, begin = head[SPAN], head[BEGIN]
    first = first_line(weights, system, length, int(head[SAMPLES_IN]), numbers)
    first = up_to_samples(system, first, group)
    integral = integral_line(system, first)
    at_first = work.memory[states : 2 * states, 0]
    x, v = own_array(at[0], (size,)), own_array(at[0], (size,))
    first_x, first_v = own_array(0.0, (size,)), own_array(0.0, (size,))
    into_equations(system, numbers[OWN:HEAD], at_first, first_x, first_v)
    for q in range(equations):
        table = table_of(plant, first, q)
        free_x, free_v = freely(numbers, table, first_x[q], first_v[q])
        x[q], v[q] = response(tables, table, free_x, free_v, memory[q])
        if q >= ways:
            angle, rate = angle_and_rate_at(system, q)
            at[angle], at[rate] = x[q], v[q]
    for j in range(integrals_at(system), states):
        at[j] = at_first[j] + product(tables, integral + INTO_V, memory[j])
    if has_motor(system.effects):
        angle = spindle_angle_at(system)
        axes = cos_sin(at[angle] - at_first[angle])
    else:
        w = segment_speed(plant.place.segment, begin + length * lines[AT])
        axes = cos_sin(product(tables, integral + INTO_V, w))
    from_coordinates(system.carrier, numbers[OWN:HEAD], axes, x, v, at)
    return begin + tables[integral + IMPULSE]
