"""Which tables of responses a collocation step takes, made when first asked for."""

from ab_sim.collocation.impulse import SERIES, impulse_response
from ab_sim.collocation.responses import (
    BEYOND,
    COUNT,
    DAMPING,
    LENGTH,
    STIFFNESS,
    fill,
    lines_of_table,
)
from ab_sim.collocation.run import (
    LATEST,
    LATEST_RATIO,
    NEXT,
    NEXT_RATIO,
    CollocationRun,
    ResponseTables,
    is_limited,
)
from ab_sim.compiling.kinds import Floats, Table, put_product, scratch

KEPT, RATIOS = 20, 32
"""Sets that are kept, and matrices from step to step: as many as there are lengths of steps for one
length of the scene's, and pairs of them."""


def tables_for(own: CollocationRun, length: float, samples: int) -> int:
    """The first table of the set for a step of that length [s] with so many samples."""
    first, numbers = int(own.tables.head[LATEST]), own.tables.numbers
    if numbers[first, LENGTH] == length and numbers[first, COUNT] == samples:
        return first
    return found(own, length, samples)


def found(own: CollocationRun, length: float, samples: int) -> int:
    """The same, where it is not the one asked for last."""
    head, numbers = own.tables.head, own.tables.numbers
    every = tables_in_set(own.tables.groups, own.sides)
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


def tables_in_set(groups: int, sides: int) -> int:
    """How many tables a set has room for."""
    return (1 + groups) * (sides + 1)


def doubt_tables(tables: ResponseTables, sides: int) -> None:
    """Have tables serve a scene with other numbers: each set is looked at when it is asked for."""
    every = tables_in_set(tables.groups, sides)
    for kept in range(tables.kept):
        count = tables.numbers[kept * every, COUNT]
        tables.numbers[kept * every, COUNT] = -abs(count)


def fill_set(own: CollocationRun, first: int, length: float, samples: int) -> None:
    """A set from a table on; what is there and serves stays.

    BEYOND of the tables up to the first samples is that of all samples.
    """
    numbers, sides, nodes = own.tables.numbers, own.sides, own.method.nodes
    count, lines = nodes.at.size, lines_of_table(nodes.at.size)
    groups = (samples + count - 1) // count
    chosen, values, rates = first_set(own, samples), scratch(SERIES), scratch(SERIES)
    for q in range(sides + 1):
        # The last one is of what is only integrated.
        damping = own.linear[q] if q < sides else 0.0
        stiffness = own.linear[sides + q] if q < sides else 0.0
        at = first + q
        if serves(numbers[at], length, samples, damping, stiffness):
            continue
        beyond, of = 0.0, impulse_response(length, damping, stiffness, values, rates)
        for group in range(1 + groups):
            table = at + group * (sides + 1)
            before, which = table, 0
            if group > 0:
                which = chosen + group - 1
                before = table - (sides + 1)
            fill(
                nodes,
                which,
                of,
                own.tables.lines[before * lines : (before + 1) * lines],
                own.tables.lines[table * lines : (table + 1) * lines],
                numbers[table],
            )
            if group > 0:
                beyond = max(beyond, numbers[table, BEYOND])
        numbers[at, COUNT] = float(samples)
        numbers[at + sides + 1, BEYOND] = beyond
    numbers[first, COUNT] = float(samples)


def first_set(own: CollocationRun, samples: int) -> int:
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


def spindle_table(own: CollocationRun, first: int) -> int:
    """The table of a motor's spindle, of those from one on; any without a motor.

    While the motor is at its limit, the spindle's acceleration is only integrated.
    """
    if not own.run.balls.has_motor:
        return first
    return first + own.sides if is_limited(own) else first + own.sides - 1


def carrying(own: CollocationRun, ratio: float) -> int:
    """First line of the matrix that carries polynomials on into a step so many times as long."""
    head, ratios = own.tables.head, own.tables.ratios
    count, at = own.method.nodes.at.size, int(head[LATEST_RATIO])
    if ratios[at] == ratio:
        return at * count
    at = -1
    for kept in range(ratios.size):
        if ratios[kept] == ratio:
            at = kept
    if at < 0:
        at = int(head[NEXT_RATIO])
        head[NEXT_RATIO] = float((at + 1) % ratios.size)
        put_carry(own, ratio, own.tables.carry[at * count : (at + 1) * count])
        ratios[at] = ratio
    head[LATEST_RATIO] = float(at)
    return at * count


def put_carry(own: CollocationRun, ratio: float, columns: Table) -> None:
    """The matrix column by column, shape (N, N)."""
    nodes = own.method.nodes
    count, powers = nodes.at.size, nodes.legendre.shape[1]
    values = scratch(powers + 1, count)
    for j in range(count):
        y = 1.0 + 2.0 * ratio * nodes.at[j]
        values[0, j], values[1, j] = 1.0, y
        for p in range(1, powers):
            more = (2 * p + 1) * y * values[p, j] - p * values[p - 1, j]
            values[p + 1, j] = more / (p + 1)
    for k in range(count):
        put_product(columns[k], nodes.legendre[k], values)
