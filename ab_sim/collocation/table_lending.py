"""Tables of responses, lent to one run at a time: a run goes on with those of the one that went.

A table depends on a left-hand side, on how long a step is, and on its samples. So what one drive
has made serves one that is made when it has gone, as far as their left-hand sides are the same. In
a loop that binds each drive to the name of the one before, two sets take turns: all but the first
two drives find their tables made, if nothing changes a left-hand side.
"""

import weakref
from collections import deque

from ab_sim.collocation.nodes import CollocationNodes
from ab_sim.collocation.responses import NUMBERS, lines_of_table
from ab_sim.collocation.run import ResponseTables
from ab_sim.collocation.tables import KEPT, RATIOS, doubt_tables, tables_in_set
from ab_sim.compiling.kinds import aligned

LARGEST = 4_000_000
"""Bytes of the lines that are kept for whoever comes next: those of two balls in the plane have a
twelfth of it, those of 64 balls of different drag twice as much."""

_returned: deque[tuple[CollocationNodes, int, ResponseTables]] = deque(maxlen=1)
"""Those of the run that went last, if no other one has them by now. Only taken out and put in, in
one go each, as other threads do the same."""


def borrowed_tables(nodes: CollocationNodes, sides: int) -> ResponseTables:
    """Tables for a run, which has them for itself as long as anything has their ``lines``.

    Args:
        nodes: of its method, the same object for all runs that go on with each other's tables.
        sides: how many left-hand sides it has.
    """
    tables = _returned_by(nodes, sides) or _made(nodes, sides)
    # Whoever has the lines has this view of them, and not the array itself.
    lent = tables._replace(lines=tables.lines[:])
    if tables.lines.nbytes <= LARGEST:
        given_back = weakref.finalize(lent.lines, _returned.append, (nodes, sides, tables))
        given_back.atexit = False
    return lent


def _returned_by(nodes: CollocationNodes, sides: int) -> ResponseTables | None:
    try:
        found = _returned.pop()
    except IndexError:
        return None
    if found[0] is not nodes or found[1] != sides:
        _returned.append(found)
        return None
    doubt_tables(found[2], sides)
    return found[2]


def _made(nodes: CollocationNodes, sides: int) -> ResponseTables:
    count = nodes.at.size
    groups = -(-int(nodes.counts[-1]) // count)
    tables = KEPT * tables_in_set(groups, sides)
    return ResponseTables(
        aligned((tables * lines_of_table(count), count)),
        aligned((tables, NUMBERS)),
        aligned((4,)),
        aligned((RATIOS * count, count)),
        aligned((RATIOS,)),
        groups,
        KEPT,
    )
