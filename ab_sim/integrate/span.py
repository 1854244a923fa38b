"""One span of collocation: its polynomials f found by iteration, and the motion anywhere in it.

Deck and balls are written as x'' + c x' + k x = f: on axes that stand still during the span, with
the suspension's c and k at rest, and the drag of the race. f is a polynomial through its values at
eight Gauss nodes, which are the lanes of one evaluation of the equations; what that makes of deck
and balls is exact (responses.py), however stiff, and at any instant of the span.

A span is kept whole in a run's memory, which belongs to the state. Its lines are f of each state
that is a velocity, at the nodes, and the slope of what else there is; the state at the beginning,
in the first column of as many lines more; the head; and a line for who goes over events.
"""

import math

import numba

from ab_sim.dynamics.dispatch import APART, INLINED, only_if
from ab_sim.dynamics.layout import angle_at, rate_at, state_count, state_size
from ab_sim.dynamics.ledger import book
from ab_sim.dynamics.numbers.across import product, total
from ab_sim.dynamics.numbers.cos_sin import SMALL, cos_sin, turned
from ab_sim.dynamics.numbers.lanes import as_lanes
from ab_sim.dynamics.race.elimination import sticks
from ab_sim.dynamics.race.race import race_of
from ab_sim.dynamics.race.table import COS, SIN
from ab_sim.dynamics.slope import evaluate
from ab_sim.dynamics.spindle_motion import spindle_motion
from ab_sim.dynamics.system import (
    RACE_RADIUS,
    Plant,
    ball_count,
    carrier_ways,
    has_friction,
    own_motion,
    segment_speed,
    turn,
    unturned,
)
from ab_sim.dynamics.unsolved import be_carried, carry
from ab_sim.integrate.left_out import TINY, left_out
from ab_sim.integrate.on_stack import own_array, own_room
from ab_sim.integrate.response_tables import (
    CARRY,
    RATIO,
    carry_on,
    drag_rate_of,
    first_line,
    integral_line,
    place_of,
    up_to_samples,
)
from ab_sim.integrate.responses import (
    DAMPING,
    IMPULSE,
    IMPULSE_RATE,
    INTO_V,
    INTO_X,
    LAST_UNIT,
    NUMBERS,
    STIFFNESS,
    UNIT,
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


@numba.njit(**APART)
def begin_anew(plant, begin, length, state, work):  # type: ignore[no-untyped-def]
    """Fill the memory as if f had been so far, for so long, what it is now."""
    system, slope, states = plant.system, work.slopes[0], state_size(plant.system, state)
    memory, head = as_lanes(work.memory), work.memory[head_at(system, state)]
    ways, n = carrier_ways(system.carrier), ball_count(system)
    evaluate(plant, begin, state, slope)
    c, k = own_motion(system.carrier, system.effects)
    spindle = spindle_motion(plant, begin, state)
    acceleration = unturned(system.carrier, plant, spindle, 1.0, 0.0)
    for j in range(states):
        memory[j] = slope[j]
    for q in range(ways):
        memory[ways + q] = acceleration[q] + c * state[ways + q] + k * state[q]
    for i in range(n):
        at = rate_at(system, i)
        memory[at] = slope[at] + drag_rate_of(system, i) * state[at]
    head[SPAN] = length
    head[MOVED] = head[WAIT] = 0.0


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
    n, ways = ball_count(system), carrier_ways(system.carrier)
    states, size = state_size(system, state), state_count(system, state)
    first = first_line(weights, system, length, samples, numbers)
    if numbers[0, RATIO] * head[SPAN] != length:
        carry_on(weights, length / head[SPAN], numbers)
    lines, tables, memory = as_lanes(weights.lines), as_lanes(numbers), as_lanes(work.memory)
    time = begin + length * lines[AT]
    w = segment_speed(plant.place.segment, time)
    axes = cos_sin(product(tables, integral_line(system, first) + INTO_V, w))

    force, at, slope = own_array(time, (size,)), own_array(time, (size,)), own_array(time, (size,))
    free, still = own_array(time, (size,)), own_array(time, (size,))
    for j in range(states):
        at[j] = state[j]
    for q in range(ways + n):
        force[q] = product(tables, CARRY, memory[place_of(system, first, q)[2]])
    c, s = cos_sin(head[MOVED])
    # Here and below two axes: of a carrier whose own motion is one along each.
    force[0], force[1] = c * force[0] + s * force[1], c * force[1] - s * force[0]
    for q in range(ways + n):
        leave(system, numbers, first, q, state, free)
        if q < ways:
            respond(system, tables, first, q, free, force, still)

    own = Plant(system, plant.place, plant.modes, own_room(system, n, time))
    spindle = spindle_motion(own, time, at)
    before, solved, last, all_of = 2.0 * SMALL, False, 0.0, 1.0
    for count in range(MOST):
        for q in range(ways, ways + n):
            angle = angle_at(system, q - ways)
            was = at[angle]
            respond(system, tables, first, q, free, force, at)
            if before > SMALL:
                c, s = cos_sin(at[angle])
            else:
                c, s = own.room.table[q - ways, COS], own.room.table[q - ways, SIN]
                c, s = turned(c, s, at[angle] - was)
            own.room.table[q - ways, COS], own.room.table[q - ways, SIN] = c, s
        last, all_of = iterate(own, spindle, axes, at, still, slope, free, force, first, numbers)
        # Each iteration leaves of an error what it left of the one before.
        most = weights.tolerance * all_of
        shrinks = last < 0.5 * before or count == 0
        if (
            last <= most
            or (count > 0 and last * last <= most * before)
            or (last <= SETTLED * all_of and not shrinks)
        ):
            solved = True
            break
        before = last
    if not solved:
        return math.inf, math.inf
    error, within = left_out(system, first, numbers, lines, force)
    # What is wrong within the span acts on f; the end alone may be right by chance.
    error, within = max(error, FED_BACK * within) / all_of, within / all_of
    if not error <= allowed:  # not a number, neither
        return error, within

    for j in range(states):
        memory[states + j] = state[j]
    for j in range(rate_at(system, n), states):
        memory[j] = slope[j]
    for q in range(ways + n):
        memory[place_of(system, first, q)[2]] = force[q]
    head[SPAN], head[SAMPLES_IN], head[TAKEN], head[BEGIN] = length, samples, 0.0, begin
    head[MOVED] = length * total(lines[SHARE] * w)
    return error, within


@numba.njit(**INLINED)
def leave(system, numbers, first, q, state, free):  # type: ignore[no-untyped-def]
    """x and v of equation q without f into ``free``, from a state, as the tables there say."""
    tables = as_lanes(numbers)
    table, x, v = place_of(system, first, q)
    k, g = numbers[table + NUMBERS, STIFFNESS], tables[table + IMPULSE]
    free[x] = state[x] + (g * state[v] - tables[table + UNIT] * (k * state[x]))
    free[v] = tables[table + IMPULSE_RATE] * state[v] - g * (k * state[x])


@numba.njit(**INLINED)
def respond(system, tables, first, q, free, force, out):  # type: ignore[no-untyped-def]
    """x and v of equation q into ``out``, from what they are without f, and f at the nodes."""
    table, x, v = place_of(system, first, q)
    out[x] = free[x] + product(tables, table + INTO_X, force[q])
    out[v] = free[v] + product(tables, table + INTO_V, force[q])


@numba.njit(**INLINED)
def iterate(plant, spindle, axes, at, still, slope, free, force, first, numbers):  # type: ignore[no-untyped-def]
    """f at the nodes anew: of the deck with the balls accelerated as before, then of the balls.

    Args:
        plant: whose table holds the balls' cosines and sines.
        spindle: its motion at the nodes.
        axes: cosine and sine of the rotor's axes on those that stand still.
        at: the balls' angles and rates at the nodes.
        still: the deck's states there, on axes that stand still; made anew.
        slope: room; afterwards the slope of what is only integrated.
        free: what the states are without f.
        force: f.
        first, numbers: the tables.

    Returns:
        How much f of the balls is from what it was, as an angle at the span's end; and what that is
        to be measured by: 1, or without a ball all that f is made of.
    """
    system, x, tables = plant.system, plant.room.acceleration, as_lanes(numbers)
    carrier, n, ways = system.carrier, ball_count(system), carrier_ways(system.carrier)
    damping, stiffness = numbers[first + NUMBERS, DAMPING], numbers[first + NUMBERS, STIFFNESS]
    change, all_of = 0.0 * spindle.speed, 0.0 * spindle.speed
    for j in range(2 * ways):
        at[j] = still[j]
    turn(carrier, axes[0], axes[1], at)
    for i in range(n):
        table, _, v = place_of(system, first, ways + i)
        slope[v] = force[ways + i] - numbers[table + NUMBERS, DAMPING] * at[v]
    carry(plant, spindle, at, slope)
    accelerations = unturned(carrier, plant, spindle, axes[0], axes[1])
    for q in range(ways):
        linear = damping * still[ways + q] + stiffness * still[q]
        new = accelerations[q] + linear
        change += abs(new - force[q])
        all_of += abs(new) + abs(linear)
        force[q] = new
        respond(system, tables, first, q, free, force, still)
        slope[q] = linear - (damping * still[ways + q] + stiffness * still[q])
    x[0] += axes[0] * slope[0] + axes[1] * slope[1]
    x[1] += axes[0] * slope[1] - axes[1] * slope[0]
    be_carried(plant, at, slope)
    book(system.ledger, plant, spindle, at, slope)
    if n == 0:
        return total(change), total(all_of) + TINY
    # Balls that friction holds say nothing of what the deck does.
    said = numbers[first + NUMBERS, LAST_UNIT] / system.balls[0, RACE_RADIUS]
    change *= said if any_sticks(plant) else 0.0
    for i in range(n):
        table, _, v = place_of(system, first, ways + i)
        new = slope[v] + numbers[table + NUMBERS, DAMPING] * at[v]
        change += abs(new - force[ways + i]) * numbers[table + NUMBERS, LAST_UNIT]
        force[ways + i] = new
    return total(change), 1.0


@numba.njit(**INLINED)
def _any_sticks(plant):  # type: ignore[no-untyped-def]
    race = race_of(plant)
    for i in range(ball_count(plant.system)):
        if sticks(race, i):
            return True
    return False


any_sticks = only_if(has_friction, _any_sticks)
"""Whether friction holds a ball; ``(plant)``."""


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
    n, ways, states = ball_count(system), carrier_ways(system.carrier), state_size(system, state)
    lines, tables, memory = as_lanes(weights.lines), as_lanes(numbers), as_lanes(work.memory)
    length, begin = head[SPAN], head[BEGIN]
    first = first_line(weights, system, length, int(head[SAMPLES_IN]), numbers)
    first = up_to_samples(system, first, group)
    integral = integral_line(system, first)
    w = segment_speed(plant.place.segment, begin + length * lines[AT])
    axes = cos_sin(product(tables, integral + INTO_V, w))
    at_first = work.memory[states : 2 * states, 0]
    for q in range(ways + n):
        table, x, v = place_of(system, first, q)
        leave(system, numbers, first, q, at_first, at)
        at[x] += product(tables, table + INTO_X, memory[v])
        at[v] += product(tables, table + INTO_V, memory[v])
    for j in range(rate_at(system, n), states):
        at[j] = at_first[j] + product(tables, integral + INTO_V, memory[j])
    turn(system.carrier, axes[0], axes[1], at)
    return begin + tables[integral + IMPULSE]
