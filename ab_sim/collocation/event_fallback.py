"""Where collocation leaves steps to a stepper whose steps are cut at events.

Between two events the branches of all laws stay as they are, and the motion is smooth: a step is
solved as if they did so all along. Then the event functions of these branches are looked at all
over it, as the polynomials through its nodes that they are as nearly as f is. Samples before the
first doubt that one is negative are taken. The step behind them is the other stepper's, which
locates what happens in it; after that collocation begins anew.

A step that comes to nothing is time lost. So where little has come of collocation since the other
stepper last took over, that one goes on for twice as many steps as then, up to ``MOST``: a bounded
share of the time is lost, however crowded events are.
"""

import math

from ab_sim.collocation.nodes import PIECES
from ab_sim.collocation.run import (
    AT_ONCE,
    COEFFICIENTS,
    GOOD,
    REST,
    SAMPLES,
    SINCE,
    STEP,
    STRIDE,
    TAKEN,
    CollocationRun,
    head_of,
)
from ab_sim.collocation.step import put_states
from ab_sim.compiling.kinds import Floats, Table, call, put_product, scratch
from ab_sim.events.event_functions import MOTOR, event_functions
from ab_sim.events.run import SPEED, evaluate
from ab_sim.integrate.steppers.collocation import PARTS
from ab_sim.stepping.fixed_step import EqualSteps, local_time, step_by_step

FAR = 4.0
"""A function whose values at the nodes are apart by this many times less than their mean, in sum,
is that of a polynomial which is nowhere near zero: none of Lagrange's exceeds 1.6."""
WORTH = 4.0
"""Samples that collocation has to bring between two calls of the other stepper."""
MOST = 128.0
"""Steps that the other stepper takes at once."""
REACH, REACHED, ORDER = 0.7, 3e-14, 8
"""The other stepper, rk8, leaves an error of ``REACHED`` [rad] in a run's angles where ``REACH`` is
what rates times its steps come to (drag 714 1/s in steps of 1 ms), and as its order says
elsewhere."""


def reach_of(tolerance: float) -> float:
    """Rates times steps at which the other stepper's error is what a step's may be [rad]."""
    return min(REACH * (tolerance / REACHED) ** (1.0 / ORDER), 2.0)


def before_events(own: CollocationRun) -> int:
    """How many PIECES of the step in memory come before any event function may be crossed."""
    if not own.run.has_events:
        return PIECES
    put_event_functions(own)
    values, count, end = own.buffers.values, own.method.nodes.at.size, PIECES
    balls, one = own.run.balls, scratch(count)
    first = 0 if balls.has_friction or balls.has_contact else MOTOR * balls.number
    for slot in range(first, values.shape[1]):
        mean, apart = 0.0, 0.0
        for j in range(count):
            one[j] = values[j, slot]
            mean += one[j]
        mean *= 1.0 / count
        for j in range(count):
            apart += abs(one[j] - mean)
        if not mean > FAR * apart:
            end = pieces_above(own, one, end)
    return end


def put_event_functions(own: CollocationRun) -> None:
    """Event functions at the nodes of the step in memory, into ``Buffers.values``."""
    run, buffers, count = own.run, own.buffers, own.method.nodes.at.size
    balls, states = run.balls, run.state.size
    put_states(own, -1, buffers.at_nodes)
    times = buffers.at_nodes[states * STRIDE * count : buffers.at_nodes.size]
    c, b, nodes = run.scene.c, balls.branches, buffers.nodes
    call(own.functions.evaluate, c, b, times, buffers.at_nodes, nodes)
    rounding, rate = run.work.rounding, run.work.rate_ahead
    for j in range(count):
        node = nodes[j]
        call(own.functions.take_node, node, balls.x, balls.motor, balls.table)
        state, slope = node[0:states], node[states : 2 * states]
        event_functions(balls, state, slope, buffers.values[j], rounding, rate)


def pieces_above(own: CollocationRun, values: Floats, most: int) -> int:
    """In how many first pieces a polynomial is surely more than its last coefficients.

    Args:
        own: the Collocation.
        values: of the polynomial at the nodes.
        most: pieces that are looked at.
    """
    count, doubt = values.size, 0.0
    coefficients = scratch(count)
    put_product(coefficients, values, own.method.lines[COEFFICIENTS : COEFFICIENTS + count])
    for back in range(2):
        doubt += abs(coefficients[back])
    if is_above(own, values, PIECES, doubt):
        return most
    for piece in range(most):
        if not is_above(own, values, piece, doubt):
            return piece
    return most


def is_above(own: CollocationRun, values: Floats, piece: int, least: float) -> bool:
    """Whether no one of Bernstein's coefficients on a piece, or on all of them, is less."""
    count = values.size
    bounds = scratch(count)
    put_product(bounds, values, own.method.bounds[piece])
    for line in range(count):
        if bounds[line] < least:
            return False
    return True


def keep_good(own: CollocationRun, good: int) -> None:
    """Take so many samples of the step in memory to be good."""
    head = head_of(own)
    head[GOOD] = float(good)
    head[SINCE] += good


def steps_due(own: CollocationRun, length: float) -> int:
    """How many steps [s] are the other stepper's where a step's good samples have been taken."""
    if not own.run.has_events:
        return 0
    head = head_of(own)
    if head[STEP] == length and head[GOOD] < head[SAMPLES]:
        at_once = 1.0
        if head[SINCE] < WORTH:
            at_once = min(max(2.0 * head[AT_ONCE], 1.0), MOST)
        head[AT_ONCE] = head[REST] = at_once
        head[SINCE] = head[STEP] = head[SAMPLES] = head[TAKEN] = head[GOOD] = 0.0
    return int(head[REST])


def give_up(own: CollocationRun) -> bool:
    """Leave a step for which there is no solution to the other stepper: whether there is one."""
    head = head_of(own)
    if own.run.has_events:
        head[SAMPLES], head[TAKEN], head[GOOD] = 1.0, 0.0, 0.0
    return own.run.has_events


def look_at_branches(own: CollocationRun, step_range: EqualSteps, samples: Table) -> None:
    """See to the branches where collocation begins anew."""
    if own.run.has_events:
        step_by_step(own.run, step_range, samples[0:0], 0)


def take_steps(own: CollocationRun, step_range: EqualSteps, samples: Table, steps: int) -> int:
    """Steps of the other stepper, all of them due.

    Args:
        own: the Collocation.
        step_range: from the present on.
        samples: of which the rows are recorded.
        steps: how many.

    Returns:
        How many were taken; fewer if the state left its bounds.
    """
    parts, done = parts_of_step(own, step_range), 0
    if parts == 1:
        done = step_by_step(own.run, step_range, samples[0:steps], steps)
    part = step_range.length / parts
    while done < steps and parts > 1:
        for p in range(parts):
            offset = step_range.offset + p * part
            at = EqualSteps(step_range.start, step_range.first + done, offset, part)
            if step_by_step(own.run, at, samples[done : done + 1], 1) == 0:
                return done
        done += 1
    head_of(own)[REST] -= done
    return done


def parts_of_step(own: CollocationRun, step_range: EqualSteps) -> int:
    """Into how many parts a step of the other stepper is cut: a power of two."""
    run, decay, turns, parts = own.run, 0.0, 0.0, 1
    for q in range(own.sides):
        decay, turns = max(decay, own.linear[q]), max(turns, own.linear[own.sides + q])
    evaluate(run, local_time(run, step_range, 0), run.state, run.work.slope)
    rate = max(decay, math.sqrt(turns) + abs(run.balls.motor[SPEED]))
    while parts < PARTS and rate * step_range.length > own.method.reach * parts:
        parts *= 2
    return parts
