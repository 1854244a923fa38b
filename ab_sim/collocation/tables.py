"""Which tables of responses a collocation step takes, made when first asked for."""

from ab_sim.collocation.responses import (
    BEYOND,
    COUNT,
    DAMPING,
    LENGTH,
    STIFFNESS,
    fill,
    lines_of_table,
)
from ab_sim.collocation.run import COEFFICIENTS, LATEST, NEXT, RATIO, Collocation, is_limited
from ab_sim.compiling.kinds import Floats, scratch

KEPT = 20
"""Sets that are kept: more than there are lengths of steps beside each other."""


def tables_for(own: Collocation, length: float, samples: int) -> int:
    """The first table of the set for a step of that length [s] with so many samples."""
    first, numbers = int(own.tables.head[LATEST]), own.tables.numbers
    if numbers[first, LENGTH] == length and numbers[first, COUNT] == samples:
        return first
    return found(own, length, samples)


def found(own: Collocation, length: float, samples: int) -> int:
    """The same, where it is not the one asked for last."""
    head, numbers, every = own.tables.head, own.tables.numbers, tables_in_set(own)
    first = -1
    for kept in range(own.tables.kept):
        has = numbers[kept * every, COUNT]
        if numbers[kept * every, LENGTH] == length and abs(has) == samples:
            first = kept * every
            if has < 0.0:
                fill_set(own, first, length, samples)
            break
    if first < 0:
        kept = int(head[NEXT])
        head[NEXT] = float((kept + 1) % own.tables.kept)
        first = kept * every
        fill_set(own, first, length, samples)
    head[LATEST] = float(first)
    return first


def tables_in_set(own: Collocation) -> int:
    """How many tables a set has room for."""
    return (1 + own.tables.groups) * (own.equations + 1)


def doubt_tables(own: Collocation) -> None:
    """Have tables serve a scene with other numbers: each set is looked at when it is asked for."""
    every = tables_in_set(own)
    for kept in range(own.tables.kept):
        count = own.tables.numbers[kept * every, COUNT]
        own.tables.numbers[kept * every, COUNT] = -abs(count)


def fill_set(own: Collocation, first: int, length: float, samples: int) -> None:
    """A set from a table on; what is there and serves stays.

    BEYOND of the tables up to the first samples is that of all samples.
    """
    numbers, equations, nodes = own.tables.numbers, own.equations, own.method.nodes
    count, lines = nodes.at.size, lines_of_table(nodes.at.size)
    groups = (samples + count - 1) // count
    chosen = first_set(own, samples)
    for q in range(equations + 1):
        # The last one is of what is only integrated.
        damping = own.own[q] if q < equations else 0.0
        stiffness = own.own[equations + q] if q < equations else 0.0
        at = first + q
        if serves(numbers[at], length, samples, damping, stiffness):
            continue
        alike = q > 0 and serves(numbers[at - 1], length, samples, damping, stiffness)
        beyond = 0.0
        for group in range(1 + groups):
            table = at + group * (equations + 1)
            if alike:
                copy_table(own, table - 1, table)
                continue
            before, which = table, 0
            if group > 0:
                which = chosen + group - 1
                before = table - (equations + 1)
            fill(
                nodes,
                which,
                length,
                damping,
                stiffness,
                own.tables.lines[before * lines : (before + 1) * lines],
                own.tables.lines[table * lines : (table + 1) * lines],
                numbers[table],
            )
            if group > 0:
                beyond = max(beyond, numbers[table, BEYOND])
        if not alike:
            numbers[at, COUNT] = float(samples)
            numbers[at + equations + 1, BEYOND] = beyond
    numbers[first, COUNT] = float(samples)


def first_set(own: Collocation, samples: int) -> int:
    """Which of the Nodes' sets is the first with so many samples."""
    nodes = own.method.nodes
    for k in range(nodes.counts.size):
        if nodes.counts[k] == samples:
            return nodes.first_sets[k]
    return 1


def serves(numbers: Floats, length: float, samples: int, damping: float, stiffness: float) -> bool:
    """Whether a table with these numbers is the one for such a step."""
    same = numbers[LENGTH] == length and abs(numbers[COUNT]) == samples
    return same and numbers[DAMPING] == damping and numbers[STIFFNESS] == stiffness


def copy_table(own: Collocation, of: int, to: int) -> None:
    """One table is like another."""
    nodes, numbers = own.method.nodes, own.tables.numbers
    lines = lines_of_table(nodes.at.size)
    for line in range(lines):
        for j in range(nodes.at.size):
            own.tables.lines[to * lines + line, j] = own.tables.lines[of * lines + line, j]
    for k in range(numbers.shape[1]):
        numbers[to, k] = numbers[of, k]


def spindle_table(own: Collocation, first: int) -> int:
    """The table of a motor's spindle, of those from one on: its acceleration is only integrated
    while the motor is at its limit. Any without a motor.
    """
    if not own.run.balls.has_motor:
        return first
    return first + own.equations if is_limited(own) else first + own.equations - 1


def carry_on(own: Collocation, ratio: float) -> None:
    """Make the method's lines carry polynomials on into a step so many times as long."""
    nodes, lines = own.method.nodes, own.method.lines
    count = nodes.at.size
    begin = COEFFICIENTS + count
    y, this, before = scratch(count), scratch(count), scratch(count)
    for j in range(count):
        y[j], this[j], before[j] = 1.0 + 2.0 * ratio * nodes.at[j], 1.0, 0.0
        for k in range(count):
            lines[begin + k, j] = 0.0
    for p in range(nodes.legendre.shape[0]):
        for k in range(count):
            weight = nodes.legendre[p, k]
            for j in range(count):
                lines[begin + k, j] += weight * this[j]
        for j in range(count):
            after = ((2 * p + 1) * y[j] * this[j] - p * before[j]) / (p + 1)
            before[j], this[j] = this[j], after
    own.tables.head[RATIO] = ratio
