"""One collocation step: its polynomials f found by iteration, and the motion anywhere in it.

f is a polynomial through its values at Gauss' nodes, which are the lanes of one evaluation of the
equations; what that makes of the motion is exact (``responses``), however stiff, and at any instant
of the step.
"""

import math

from ab_sim.collocation.formulas import SMALL
from ab_sim.collocation.lengths import (
    PATIENCE,
    after_refusal,
    first_size,
    next_size,
    shorter,
    turns_too_far,
)
from ab_sim.collocation.responses import lines_of_table
from ab_sim.collocation.run import (
    AHEAD,
    BEGIN,
    CHANGED,
    ERROR,
    LENGTH,
    MOVED,
    SAMPLES,
    STEP,
    STRIDE,
    TAKEN,
    TURN,
    TURNED,
    WAIT,
    WITHIN,
    CollocationRun,
    begun_of,
    head_of,
    memory_of,
)
from ab_sim.collocation.tables import carrying, spindle_table, tables_for
from ab_sim.compiling.kinds import Floats, call, scratch
from ab_sim.integrate.steppers.collocation import PARTS

MOST = 16
"""Iterations after which a step is given up."""
SETTLED = 1e-10
"""Changes [rad] below this that no longer shrink are rounding."""
FED_BACK = 1.0 / 70.0
"""Of an error within a step, what an iteration makes of it, and so the motion at its end."""
LARGEST = 1e300
"""An error [rad] that is taken where there is no choice but that of an iteration without end."""


def begin_anew(own: CollocationRun, begin: float, length: float, state: Floats) -> int:
    """Fill the memory as if f had been so far what it is now, in a step of the first length.

    Args:
        own: the Collocation.
        begin: local time [s].
        length: of the scene's steps [s].
        state: the state there.

    Returns:
        How long the first step is, in parts.
    """
    scene, memory, head, rows = own.run.scene, memory_of(own), head_of(own), own.rows
    count, force = own.method.nodes.at.size, scratch(rows + 1)
    call(own.functions.begin, scene.c, own.run.balls.branches, own.linear, state, force, begin)
    for q in range(rows):
        for j in range(count):
            memory[q * count + j] = force[q]
    size = first_size(own, length, force[rows])
    head[LENGTH] = length * (size / PARTS)
    head[MOVED] = head[WAIT] = 0.0
    return size


def solve_step(
    own: CollocationRun, begin: float, length: float, samples: int, allowed: float, state: Floats
) -> tuple[float, float]:
    """A step from a state, with so many samples in it, into the memory, which holds the one before.

    Args:
        own: the Collocation.
        begin, length: local time and s.
        samples: how many.
        allowed: error above which a step is not taken [rad].
        state: the state at its beginning.

    Returns:
        The error [rad] that is expected of the samples because f is a polynomial, infinite where
        the iterations have come to no end; if it is more than allowed, nothing has changed. And the
        error anywhere within the step.
    """
    functions, head, result = own.functions, head_of(own), own.result
    c, b, work = own.run.scene.c, own.run.balls.branches, own.buffers.work
    lines = lines_of_table(own.method.nodes.at.size)
    first = tables_for(own, length, samples)
    spindle = spindle_table(own, first)
    carry = own.tables.carry[carrying(own, length / head[LENGTH])]
    numbers, weights = own.tables.numbers, own.method.lines
    table, spindle_line = own.tables.lines[first * lines], own.tables.lines[spindle * lines]
    facts, spindle_facts = numbers[first], numbers[spindle]
    call(
        functions.start, c, b, own.linear, facts, spindle_facts, table, spindle_line, weights,
        carry, state, memory_of(own), work, begin, length, head[MOVED],
    )  # fmt: skip
    before = carried_before = turned_before = math.inf
    solved, near = False, False
    for _ in range(MOST):
        address = functions.iterate_near if near else functions.iterate
        call(address, c, b, own.linear, table, spindle_line, work, result)
        carried, turned_by = result[CHANGED], result[TURNED]
        # Each iteration leaves of an error what it left of the one before: of each kind of its own.
        left = remains(carried, carried_before) + remains(turned_by, turned_before)
        last = carried + turned_by
        if left <= own.method.tolerance or (last <= SETTLED and not last < 0.5 * before):
            solved = True
            break
        carried_before, turned_before, before = carried, turned_by, last
        near = turned_by <= SMALL
    if not solved:
        return math.inf, math.inf
    call(functions.judge, c, b, facts, spindle_facts, weights, work, result, begin, length)
    # What is wrong within the step acts on f; the end alone may be right by chance.
    error, within = max(result[ERROR], FED_BACK * result[WITHIN]), result[WITHIN]
    if error <= allowed:  # it may be no number
        keep(own, begin, length, samples, state)
    return error, within


def remains(change: float, before: float) -> float:
    """What the next iteration will change, after such a change and the one before."""
    return change * (change / before) if change < before < math.inf else change


def keep(own: CollocationRun, begin: float, length: float, samples: int, state: Floats) -> None:
    """Take the step that has been solved into the memory."""
    begun, head, scene = begun_of(own), head_of(own), own.run.scene
    # Not number by number: a wide load right after narrow stores would have to wait for them.
    call(own.functions.keep, scene.c, own.run.balls.branches, own.buffers.work, memory_of(own))
    for j in range(state.size):
        begun[j] = state[j]
    head[LENGTH], head[SAMPLES], head[TAKEN], head[BEGIN] = length, float(samples), 0.0, begin
    head[MOVED] = own.result[TURN]


def put_states(own: CollocationRun, group: int, out: Floats) -> None:
    """States at N samples of the step in memory, and their times.

    Args:
        own: the Collocation.
        group: which N of the samples; -1 for the nodes.
        out: where the first of them goes, in lines as of ``Buffers.states``.
    """
    head, lines = head_of(own), lines_of_table(own.method.nodes.at.size)
    first = tables_for(own, head[LENGTH], int(head[SAMPLES]))
    first += (1 + group) * (own.sides + 1)
    c, b, spindle = own.run.scene.c, own.run.balls.branches, spindle_table(own, first)
    table, spindle_line = own.tables.lines[first * lines], own.tables.lines[spindle * lines]
    call(
        own.functions.sample, c, b, own.linear, table, spindle_line, own.method.lines,
        own.run.work.bounds, begun_of(own), memory_of(own), out, head[BEGIN], head[LENGTH],
    )  # fmt: skip


def first_step_size(own: CollocationRun, begin: float, length: float, whole: float) -> int:
    """How long the next step is tried, in parts of ``length`` [s]; ``whole``: see ``take_step``."""
    head, counts = head_of(own), own.method.nodes.counts
    if head[STEP] != length:
        size = begin_anew(own, begin, length, own.run.work.trial)
        head[STEP] = length
    else:
        size = int(head[AHEAD])
    while size > PARTS and size > whole * PARTS:
        size = shorter(counts, size)
    return size


def try_step(
    own: CollocationRun, begin: float, length: float, size: int
) -> tuple[int, float, float]:
    """A step from ``trial``, as long as it may be.

    Args:
        own: the Collocation.
        begin: local time [s].
        length: of the scene's steps [s].
        size: how long it is tried, in parts.

    Returns:
        How long it is, 0 if there is none; its error, and that anywhere within it [rad].
    """
    head, method, trial = head_of(own), own.method, own.run.work.trial
    while size > 0:
        while size > 1 and turns_too_far(own, length * (size / PARTS)):
            size = shorter(method.nodes.counts, size)
        allowed = method.tolerance if size > 1 and method.steps < 1.0 else LARGEST
        share = length * (size / PARTS)
        error, within = solve_step(own, begin, share, max(1, size // PARTS), allowed, trial)
        if error <= allowed:
            return size, error, within
        if size == 1:
            break
        size = after_refusal(own, size, error)
        head[WAIT] = PATIENCE
    return 0, math.inf, math.inf


def next_after(own: CollocationRun, size: int, error: float, within: float) -> int:
    """How long the step after one is tried, in parts."""
    head = head_of(own)
    after = next_size(own, head, size, error, within)
    head[AHEAD] = float(after)
    return after


def go_to_end(own: CollocationRun) -> None:
    """The state at the end of a step with one sample into ``trial``."""
    out, trial = own.buffers.at_nodes, own.run.work.trial
    put_states(own, 0, out)
    for j in range(trial.size):
        trial[j] = out[j * STRIDE * own.method.nodes.at.size]
