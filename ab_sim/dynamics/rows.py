"""Elimination of the balls: one by one, or as rows of balls in contact.

Along the race the pushes between the balls of a row cancel out of the sum of their equations, and
all have one path acceleration; so a row is eliminated as if it were one ball.
"""

from typing import Any

from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import INLINED, chosen_by, only_if
from ab_sim.dynamics.scratch import (
    GAIN0,
    GAIN1,
    GAIN2,
    GAIN3,
    INERTIA,
    LEADER,
    PULL,
    ROW1,
    ROW2,
    ROW3,
    TOTAL,
)
from ab_sim.dynamics.system import (
    DIRECTION,
    JOINED,
    MOBILITY,
    ball_at,
    ball_count,
    has_contact,
    has_friction,
    has_motor,
)


def _sticks(system: Any, modes: Any, i: int) -> bool:
    return bool(modes[i, DIRECTION] == 0)


sticks = chosen_by(has_friction, _sticks, lambda system, modes, i: False)
"""Whether ball i is held on the race, by friction or between others; ``(system, modes, i)``."""


@register_jitable(**INLINED)
def eliminate_ball(system: Any, modes: Any, scratch: Any, i: int) -> None:
    """Solve the equation of a ball that no other touches for its path acceleration."""
    if sticks(system, modes, i):
        _set_gain(system, scratch, i, 0.0, 0.0, 0.0, 0.0)
    else:
        mobility = system.balls[i, MOBILITY]
        scratch[i, GAIN0] = scratch[i, PULL] * mobility
        scratch[i, GAIN1] = scratch[i, ROW1] * mobility
        scratch[i, GAIN2] = scratch[i, ROW2] * mobility
        if has_motor(system.effects):
            scratch[i, GAIN3] = scratch[i, ROW3] * mobility


@register_jitable(**INLINED)
def _rows_lead(system: Any, modes: Any, scratch: Any) -> None:
    n = system.contacts.shape[0]
    begin = row_start(system, modes)
    leader = -1
    for place in range(n):
        k = (begin + place) % n
        i = ball_at(system, k)
        behind = (k - 1) % n
        if sticks(system, modes, i):
            leader = -1
        elif place == 0 or not moves_along(system, modes, behind):
            leader = i
        scratch[i, LEADER] = leader


@register_jitable(**INLINED)
def _each_leads(system: Any, modes: Any, scratch: Any) -> None:
    for i in range(ball_count(system)):
        scratch[i, LEADER] = -1 if sticks(system, modes, i) else i


lead = chosen_by(has_contact, _rows_lead, _each_leads)
"""Fill in LEADER; ``(system, modes, scratch)``."""


@register_jitable(**INLINED)
def _row_by_row(system: Any, modes: Any, scratch: Any) -> None:
    n = system.contacts.shape[0]
    lead(system, modes, scratch)
    for i in range(n):
        scratch[i, TOTAL] = 0.0
        _set_gain(system, scratch, i, 0.0, 0.0, 0.0, 0.0)
    for i in range(n):
        at = int(scratch[i, LEADER])
        if at >= 0:
            scratch[at, TOTAL] += scratch[i, INERTIA]
            scratch[at, GAIN0] += scratch[i, PULL]
            scratch[at, GAIN1] += scratch[i, ROW1]
            scratch[at, GAIN2] += scratch[i, ROW2]
            if has_motor(system.effects):
                scratch[at, GAIN3] += scratch[i, ROW3]
    for i in range(n):
        if int(scratch[i, LEADER]) == i:
            mobility = 1.0 / scratch[i, TOTAL]
            scratch[i, GAIN0] *= mobility
            scratch[i, GAIN1] *= mobility
            scratch[i, GAIN2] *= mobility
            if has_motor(system.effects):
                scratch[i, GAIN3] *= mobility
    for i in range(n):
        at = int(scratch[i, LEADER])
        if at >= 0 and at != i:
            scratch[i, GAIN0] = scratch[at, GAIN0]
            scratch[i, GAIN1] = scratch[at, GAIN1]
            scratch[i, GAIN2] = scratch[at, GAIN2]
            if has_motor(system.effects):
                scratch[i, GAIN3] = scratch[at, GAIN3]


def _one_by_one(system: Any, modes: Any, scratch: Any) -> None:
    for i in range(ball_count(system)):
        eliminate_ball(system, modes, scratch, i)


eliminate = chosen_by(has_contact, _row_by_row, _one_by_one)
"""Solve each ball's or row's equation for its path acceleration; ``(system, modes, scratch)``."""
eliminate_rows = only_if(has_contact, _row_by_row)
"""The same, where ``eliminate_ball`` has done it for balls that cannot touch."""


@register_jitable(**INLINED)
def _set_gain(
    system: Any, scratch: Any, i: int, gain0: float, gain1: float, gain2: float, gain3: float
) -> None:
    scratch[i, GAIN0] = gain0
    scratch[i, GAIN1] = gain1
    scratch[i, GAIN2] = gain2
    if has_motor(system.effects):
        scratch[i, GAIN3] = gain3


@register_jitable(**INLINED)
def row_start(system: Any, modes: Any) -> int:
    """A place in the order of balls at which a row begins."""
    return int(first_open(system, modes, JOINED))


@register_jitable(**INLINED)
def first_open(system: Any, table: Any, column: int) -> int:
    """The place behind a contact for which the column says 0: no more than n - 1 can be closed."""
    n = system.contacts.shape[0]
    for k in range(n):
        if table[(k - 1) % n, column] == 0:
            return k
    return 0


@register_jitable(**INLINED)
def moves_along(system: Any, modes: Any, k: int) -> bool:
    """Whether the balls at contact k touch and move together (a stuck ball does not move)."""
    if modes[k, JOINED] == 0:
        return False
    return not (
        sticks(system, modes, ball_at(system, k))
        or sticks(system, modes, ball_at(system, (k + 1) % system.contacts.shape[0]))
    )


@register_jitable(**INLINED)
def sign(x: float) -> int:
    """-1, 0 or 1: the direction in which a ball with this speed slides."""
    return 1 if x > 0.0 else (-1 if x < 0.0 else 0)
