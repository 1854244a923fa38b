"""Elimination of the balls: one by one, or as rows of balls in contact.

Along the race the pushes between the balls of a row cancel out of the sum of their equations, and
all have one path acceleration; so a row is eliminated as if it were one ball. What is left are the
equations of what carries the balls, K or K - 1 of them: O(n), the arrowhead of
docs/equations.md, 2.
"""

from typing import Any

from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import INLINED, holds, number_of
from ab_sim.dynamics.numbers.across import whole
from ab_sim.dynamics.numbers.multiply_add import multiply_add
from ab_sim.dynamics.race.race import Race, around, ball_at
from ab_sim.dynamics.race.table import (
    FREE,
    FRICTION,
    INERTIA,
    LEADER,
    LOAD,
    PATH_ACCELERATION,
    PULL,
    REACH,
    TOTAL,
)
from ab_sim.dynamics.system import DIRECTION, JOINED, MOBILITY


@register_jitable(**INLINED)
def sticks(race: Race, i: int) -> bool:
    """Whether ball i is held on the race, by friction or between others."""
    return holds(race.rubs) and race.modes[i, DIRECTION] == 0


@register_jitable(**INLINED)
def pull_on(race: Race, i: int) -> Any:
    """Force along the race on ball i but for the accelerations that are solved for [N]."""
    table = race.room.table
    pull = table[i, PULL]
    if holds(race.rubs):
        pull -= table[i, FRICTION] * table[i, LOAD]
    if not holds(race.driven):
        spindle = number_of(race.all) - 1
        pull += row_at(race, i, spindle) * race.room.acceleration[spindle]
    return pull


@register_jitable(**INLINED)
def row_at(race: Race, i: int, r: int) -> Any:
    """What acceleration r does to ball i along the race, its normal force's friction included."""
    table = race.room.table
    row = table[i, REACH + r]
    if holds(race.rubs):
        row -= table[i, FRICTION] * table[i, REACH + number_of(race.all) + r]
    return row


@register_jitable(**INLINED)
def eliminate_ball(race: Race, i: int) -> None:
    """Solve the equation of a ball that nothing holds for its path acceleration."""
    table, gain = race.room.table, REACH + 2 * number_of(race.all)
    mobility = race.balls[i, MOBILITY]
    table[i, FREE] = pull_on(race, i) * mobility
    for r in range(number_of(race.free)):
        table[i, gain + r] = row_at(race, i, r) * mobility


@register_jitable(**INLINED)
def accelerate_ball(race: Race, i: int) -> None:
    """Path acceleration of a ball that nothing holds, from the accelerations in the room."""
    g = pull_on(race, i)
    for r in range(number_of(race.free)):
        g = multiply_add(row_at(race, i, r), race.room.acceleration[r], g)
    race.room.table[i, PATH_ACCELERATION] = g * race.balls[i, MOBILITY]


@register_jitable(**INLINED)
def accelerate(race: Race) -> None:
    """Path accelerations of all balls, from the accelerations in the room: no matrix is solved."""
    for i in range(number_of(race.number)):
        if sticks(race, i):
            race.room.table[i, PATH_ACCELERATION] = 0.0
        else:
            accelerate_ball(race, i)
    if holds(race.meets):
        accelerate_rows(race)


@register_jitable(**INLINED)
def accelerate_rows(race: Race) -> None:
    """What pushes, which cancel in its sum of forces, make of the accelerations in each row."""
    table, n = race.room.table, number_of(race.number)
    lead(race)
    for i in range(n):
        table[i, TOTAL] = table[i, FREE] = 0.0
    for i in range(n):
        at = whole(table[i, LEADER])
        if at >= 0:
            table[at, TOTAL] += table[i, INERTIA]
            table[at, FREE] += table[i, INERTIA] * table[i, PATH_ACCELERATION]
    for i in range(n):
        at = whole(table[i, LEADER])
        if at >= 0:
            table[i, PATH_ACCELERATION] = table[at, FREE] / table[at, TOTAL]


@register_jitable(**INLINED)
def hold_ball(race: Race, i: int) -> None:
    """Say that ball i does not move along the race."""
    table, gain = race.room.table, REACH + 2 * number_of(race.all)
    table[i, FREE] = 0.0
    for r in range(number_of(race.free)):
        table[i, gain + r] = 0.0


@register_jitable(**INLINED)
def lead(race: Race) -> None:
    """Fill in LEADER."""
    table, n = race.room.table, number_of(race.number)
    if not holds(race.meets):
        for i in range(n):
            table[i, LEADER] = -1 if sticks(race, i) else i
        return
    k = row_start(race)
    leader, joined = -1, False
    for _ in range(n):
        i = ball_at(race, k)
        if sticks(race, i):
            leader = -1
        elif leader < 0 or not joined:
            leader = i
        table[i, LEADER] = leader
        joined = race.modes[k, JOINED] != 0
        k = around(race, k + 1)


@register_jitable(**INLINED)
def eliminate_rows(race: Race) -> None:
    """Solve each row's equation for its path acceleration."""
    table, n, gain = race.room.table, number_of(race.number), REACH + 2 * number_of(race.all)
    lead(race)
    for i in range(n):
        table[i, TOTAL] = 0.0
        hold_ball(race, i)
    for i in range(n):
        at = whole(table[i, LEADER])
        if at >= 0:
            table[at, TOTAL] += table[i, INERTIA]
            table[at, FREE] += pull_on(race, i)
            for r in range(number_of(race.free)):
                table[at, gain + r] += row_at(race, i, r)
    for i in range(n):
        if whole(table[i, LEADER]) == i:
            mobility = 1.0 / table[i, TOTAL]
            table[i, FREE] *= mobility
            for r in range(number_of(race.free)):
                table[i, gain + r] *= mobility
    for i in range(n):
        at = whole(table[i, LEADER])
        if at >= 0 and at != i:
            table[i, FREE] = table[at, FREE]
            for r in range(number_of(race.free)):
                table[i, gain + r] = table[at, gain + r]


@register_jitable(**INLINED)
def eliminate(race: Race) -> None:
    """Solve each ball's or row's equation for its path acceleration."""
    if holds(race.meets):
        eliminate_rows(race)
    else:
        for i in range(number_of(race.number)):
            if sticks(race, i):
                hold_ball(race, i)
            else:
                eliminate_ball(race, i)


@register_jitable(**INLINED)
def eliminate_free(race: Race) -> None:
    """``eliminate`` of balls that never stick nor touch: no branch, so it can be done in lanes."""
    for i in range(number_of(race.number)):
        eliminate_ball(race, i)


@register_jitable(**INLINED)
def solve(race: Race) -> None:
    """The accelerations of what carries the balls, once these are eliminated, and g of each."""
    table, reduced, x = race.room.table, race.room.reduced, race.room.acceleration
    free, every, gain = number_of(race.free), number_of(race.all), REACH + 2 * number_of(race.all)
    block = race.room.block
    # Loops of constant length, which the compiler unrolls. Symmetric but for friction.
    for r in range(free):
        for q in range(free):
            if q >= r:
                reduced[r, q] = block[r, q]
            elif holds(race.rubs):
                reduced[r, q] = block[q, r]
        reduced[r, every] = block[r, every]
        if not holds(race.driven):
            reduced[r, every] -= block[r, every - 1] * x[every - 1]
    for i in range(number_of(race.number)):
        for r in range(free):
            reach = table[i, REACH + r]
            for q in range(free):
                if q >= r or holds(race.rubs):
                    reduced[r, q] = multiply_add(-reach, table[i, gain + q], reduced[r, q])
            reduced[r, every] = multiply_add(reach, table[i, FREE], reduced[r, every])
    if not holds(race.rubs):
        for r in range(free):
            for q in range(free):
                if q < r:
                    reduced[r, q] = reduced[q, r]
    _solve_reduced(race)
    for i in range(number_of(race.number)):
        g = table[i, FREE]
        for r in range(free):
            g = multiply_add(table[i, gain + r], x[r], g)
        table[i, PATH_ACCELERATION] = g


@register_jitable(**INLINED)
def solve_with_balls(race: Race) -> None:
    """The accelerations of what carries the balls, these accelerating as the table says."""
    table, block, reduced = race.room.table, race.room.block, race.room.reduced
    free, every, x = number_of(race.free), number_of(race.all), race.room.acceleration
    for r in range(free):
        for q in range(r, free):
            reduced[r, q] = reduced[q, r] = block[r, q]
        force = block[r, every]
        if not holds(race.driven):
            force -= block[r, every - 1] * x[every - 1]
        for i in range(number_of(race.number)):
            force = multiply_add(table[i, REACH + r], table[i, PATH_ACCELERATION], force)
        reduced[r, every] = force
    _solve_reduced(race)


@register_jitable(**INLINED)
def _solve_reduced(race: Race) -> None:
    """Solve the equations in ``room.reduced``."""
    reduced, x = race.room.reduced, race.room.acceleration
    free, every = number_of(race.free), number_of(race.all)
    # From the last one up, until two are left; masses and inertias need no pivoting.
    for p in range(free - 1, 1, -1):
        pivot = 1.0 / reduced[p, p]
        for r in range(p):
            factor = reduced[r, p] * pivot
            for q in range(p):
                reduced[r, q] = multiply_add(-factor, reduced[p, q], reduced[r, q])
            reduced[r, every] = multiply_add(-factor, reduced[p, every], reduced[r, every])
    d11, d12, d21, d22 = reduced[0, 0], reduced[0, 1], reduced[1, 0], reduced[1, 1]
    f1, f2 = reduced[0, every], reduced[1, every]
    inverse = 1.0 / (d11 * d22 - d12 * d21)
    x[0] = (f1 * d22 - f2 * d12) * inverse
    x[1] = (f2 * d11 - f1 * d21) * inverse
    for p in range(2, free):
        rest = reduced[p, every]
        for q in range(p):
            rest = multiply_add(-reduced[p, q], x[q], rest)
        x[p] = rest / reduced[p, p]


@register_jitable(**INLINED)
def row_start(race: Race) -> int:
    """A place in the order of balls at which a row begins."""
    return int(first_open(race, race.modes, JOINED))


@register_jitable(**INLINED)
def first_open(race: Race, lines: Any, column: int) -> int:
    """The place behind a contact for which the column says 0: no more than n - 1 can be closed."""
    n = number_of(race.number)
    for k in range(n):
        if lines[around(race, k - 1), column] == 0:
            return k
    return 0


@register_jitable(**INLINED)
def moves_along(race: Race, k: int) -> bool:
    """Whether the balls at contact k touch and move together (a stuck ball does not move)."""
    if not holds(race.meets) or race.modes[k, JOINED] == 0:
        return False
    return not (sticks(race, ball_at(race, k)) or sticks(race, ball_at(race, around(race, k + 1))))


@register_jitable(**INLINED)
def sign(x: float) -> int:
    """-1, 0 or 1: the direction in which a ball with this speed slides."""
    return 1 if x > 0.0 else (-1 if x < 0.0 else 0)
