"""Where a stepper in spans leaves steps to one whose steps are cut at events.

Between two events the branches of all laws stay as they are, and the motion is smooth: a span is
solved as if they did so all along. Then the margins of these branches (dynamics/race/margins.py)
are looked at all over it, as the polynomials through the span's nodes that they are as nearly as
f is. Samples before the first doubt that one is negative are taken. The step behind them is the
other stepper's, which locates what happens in it; after that a span begins anew.

A span that comes to nothing is time lost. So where little has come of spans since events were last
handed over, the other stepper goes on for twice as many steps as then, up to ``MOST``: a bounded
share of the time is lost, however crowded events are.
"""

import math
from math import comb

import numba
import numpy as np

from ab_sim.dynamics.dispatch import APART, INLINED, chosen_by
from ab_sim.dynamics.layout import equation_count, state_count
from ab_sim.dynamics.numbers.across import product, total
from ab_sim.dynamics.numbers.lanes import as_lanes, where_less
from ab_sim.dynamics.race.margins import margins, slots
from ab_sim.dynamics.race.race import race_of
from ab_sim.dynamics.slope import evaluate
from ab_sim.dynamics.spindle_motion import spindle_motion
from ab_sim.dynamics.system import Plant, ball_count, has_events
from ab_sim.integrate.fixed_step import Run, Stretch, local_time, step_by_step
from ab_sim.integrate.left_out import COEFFICIENTS
from ab_sim.integrate.on_stack import own_array, own_room
from ab_sim.integrate.response_tables import linear_part
from ab_sim.integrate.responses import NODES
from ab_sim.integrate.span import SAMPLES_IN, STEP, TAKEN, head_at, states_in_span
from ab_sim.integrate.workspace import aligned

PIECES = 16
"""Of a span, in each of which a margin is told apart from zero or is not."""
FAR = 4.0
"""A margin whose values at the nodes are apart by this many times less than their mean, in sum, is
that of a polynomial which is nowhere near zero: none of Lagrange's exceeds 1.6."""
WORTH = 4
"""Samples that spans have to bring between two hand-overs."""
MOST = 128
"""Steps that are handed over at once."""
PARTS = 1024
"""The finest parts of a step, whichever stepper goes over it."""
REACH, ERROR, ORDER = 0.7, 3e-14, 8
"""The other stepper, rk8, leaves this ERROR [rad] of a run's angles where REACH is what rates times
its steps come to (drag 714 1/s in steps of 1 ms), and as its order says elsewhere."""

GOOD, REST, AT_ONCE, SINCE = range(4)
"""The line of the memory behind the head: how many samples of the span are before any event; how
many steps are still to be handed over; how many were, when they last were; and how many samples
spans have brought since then."""


def reach_of(tolerance: float) -> float:
    """Rates times steps at which the other stepper's error is what a span's may be [rad]."""
    return min(REACH * (tolerance / ERROR) ** (1.0 / ORDER), 2.0)


def bounds_within_pieces(nodes: np.ndarray) -> np.ndarray:
    """Matrices from values at the nodes to Bernstein's coefficients on each piece of 0 .. 1.

    A polynomial on a piece lies within its coefficients there.

    Args:
        nodes: shape (8,).

    Returns:
        Columns one behind the other, shape (PIECES * 8, 8).
    """
    most = len(nodes) - 1
    at = (np.arange(most + 1) + 0.5) / (most + 1)
    powers = np.arange(most + 1)
    basis = np.array([comb(most, b) * at**b * (1.0 - at) ** (most - b) for b in powers]).T
    found = aligned((PIECES * len(nodes), len(nodes)))
    for piece in range(PIECES):
        x = (piece + at) / PIECES
        for k in powers:
            others = np.delete(nodes, k)
            values = np.prod((x[:, None] - others) / (nodes[k] - others), axis=1)
            found[piece * len(nodes) + k] = np.linalg.solve(basis, values)
    return found


@numba.njit(**INLINED)
def line_at(system, state):  # type: ignore[no-untyped-def]
    """Which line of the memory is the one behind the head."""
    return head_at(system, state) + 1


@numba.njit(**APART)
def _before_events(plant, weights, state, work):  # type: ignore[no-untyped-def]
    system, n = plant.system, ball_count(plant.system)
    numbers = own_array(0.0, (state.size, NODES))
    at = as_lanes(numbers)
    slope = own_array(at[0], (state_count(system, state),))
    own = Plant(system, plant.place, plant.modes, own_room(system, n, at[0]))
    # As samples, the nodes are the group before the first.
    time = states_in_span(weights, own, -1, state, work, at)
    evaluate(own, time, at, slope)
    size = slots(n)
    margin, rate = own_array(at[0], (size,)), own_array(at[0], (size,))
    rounding = own_array(at[0], (size,))
    margins(race_of(own), at, slope, margin, rounding, rate)
    coefficients = own_array(0.0, (1, NODES))
    last = as_lanes(coefficients)
    lines, bounds, end = as_lanes(weights.lines), as_lanes(weights.bounds), PIECES
    for slot in range(size):
        values = margin[slot]
        mean = total(values) / NODES
        if mean > FAR * total(abs(values - mean)):
            continue
        last[0] = product(lines, COEFFICIENTS, values)
        doubt = abs(coefficients[0, 0]) + abs(coefficients[0, 1])
        for piece in range(end):
            lowest = product(bounds, NODES * piece, values)
            if total(where_less(lowest, doubt, 1.0, 0.0)) > 0.0:
                end = piece
                break
    return end


before_events = chosen_by(has_events, _before_events, lambda plant, *_: PIECES)
"""How many of the PIECES of the span in memory come before any margin may be crossed; ``(plant,
weights, state, work)``."""


@numba.njit(**INLINED)
def keep_good(system, good, state, work):  # type: ignore[no-untyped-def]
    """Take so many samples of the span in memory to be good."""
    line = work.memory[line_at(system, state)]
    line[GOOD] = good
    line[SINCE] += good


@numba.njit(**INLINED)
def _due(plant, length, state, work):  # type: ignore[no-untyped-def]
    head, line = (
        work.memory[head_at(plant.system, state)],
        work.memory[line_at(plant.system, state)],
    )
    if head[STEP] == length and line[GOOD] < head[SAMPLES_IN]:
        line[AT_ONCE] = 1.0 if line[SINCE] >= WORTH else min(max(2.0 * line[AT_ONCE], 1.0), MOST)
        line[REST], line[SINCE] = line[AT_ONCE], 0.0
        head[STEP] = head[SAMPLES_IN] = head[TAKEN] = line[GOOD] = 0.0
    return int(line[REST])


due = chosen_by(has_events, _due, lambda plant, *_: 0)
"""How many steps are to be handed over where a span's good samples have been taken; ``(plant,
length, state, work)``, the length of steps [s]."""


@numba.njit(**INLINED)
def _given_up(plant, state, work):  # type: ignore[no-untyped-def]
    head, line = (
        work.memory[head_at(plant.system, state)],
        work.memory[line_at(plant.system, state)],
    )
    head[SAMPLES_IN], head[TAKEN], line[GOOD] = 1.0, 0.0, 0.0
    return True


given_up = chosen_by(has_events, _given_up, lambda plant, *_: False)
"""Hand over a step for which no span was found, if there is whom to: whether so; ``(plant, state,
work)``."""

_apart = numba.njit(**APART)(step_by_step.py_func)


@numba.njit(**INLINED)
def _others(run):  # type: ignore[no-untyped-def]
    """The Run with the other stepper."""
    own = run.weights.over_events
    return Run(run.system, run.place, own, run.step, run.state, run.modes, run.work, run.events)


@numba.njit(**APART)
def _look(plant, run, stretch, rows):  # type: ignore[no-untyped-def]
    _apart(_others(run), stretch, rows[:0], 0)


look = chosen_by(has_events, _look, lambda plant, *_: None)
"""See to the branches where a span begins anew: arguments as of ``hand_over``, without steps."""


@numba.njit(**APART)
def _hand_over(plant, run, stretch, rows, steps):  # type: ignore[no-untyped-def]
    others, length = _others(run), stretch.length
    parts, done = parts_of(plant, run, stretch), 0
    if parts == 1:
        done = _apart(others, stretch, rows, steps)
    part = length / parts
    while done < steps and parts > 1:
        row = rows[done : done + 1]
        for p in range(parts):
            offset = stretch.offset + p * part
            at = Stretch(stretch.place, stretch.start, stretch.first + done, offset, part)
            if _apart(others, at, row, 1) == 0:
                return done
        done += 1
    run.work.memory[line_at(run.system, run.state)][REST] -= done
    return done


hand_over = chosen_by(has_events, _hand_over, lambda plant, *_: 0)
"""Steps of the other stepper, all of them due.

``(plant, run, stretch, rows, steps)``, as of ``fixed_step.step_by_step``, and a Plant. Returns how
many were taken; fewer if the state left its bounds.
"""


@numba.njit(**INLINED)
def parts_of(plant, run, stretch):  # type: ignore[no-untyped-def]
    """Into how many parts a step is cut that is handed over: a power of two."""
    system, decay, turns = plant.system, 0.0, 0.0
    for q in range(equation_count(system)):
        c, k = linear_part(system, run.work.tables, q)
        decay, turns = max(decay, c), max(turns, k)
    spindle = spindle_motion(plant, local_time(run, stretch, 0), run.state)
    rate, parts = max(decay, math.sqrt(turns) + abs(spindle.speed)), 1
    while parts < PARTS and rate * stretch.length > run.weights.reach * parts:
        parts *= 2
    return parts
