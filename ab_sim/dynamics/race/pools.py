"""Which balls that touch move together, at one instant: the complementarity problem of whole rows.

Along a row of balls in contact, with path accelerations g_i, or path speeds after an impact,

    mu_i g_i = p_i - phi_i + push_{i-1} - push_i,    0 <= push_k  _|_  g_{k+1} - g_k >= 0,

and phi_i in F_i Sign(g_i), the friction on a ball at rest. These are the conditions for a minimum
of sum_i (mu_i g_i^2 / 2 - p_i g_i + F_i |g_i|) over all g that do not fall along the row: an
isotonic regression. Pooling neighbours that violate the order solves it exactly, in one pass (Best,
Chakravarti and Ubhaya (2000), SIAM J. Optim. 10). A pool moves as one ball.
"""

from typing import Any

from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import APART, INLINED, holds, number_of
from ab_sim.dynamics.race.elimination import first_open
from ab_sim.dynamics.race.race import Race, around, ball_at
from ab_sim.dynamics.race.table import INERTIA
from ab_sim.dynamics.system import JOINED

PULL, HOLD = 0, 1
"""Of each ball: p_i [N], or an impulse [N s]; F_i [N], negative for a ball that does not rest. The
balls of a row all rest or all move."""
COARSE = 2
"""Of each ball: what of its PULL may be rounding."""
LEVEL = 3
"""Of each ball: the solution g_i."""
CLOSED = 4
"""Of each contact: 1 where its balls touch and neither approach nor part."""
SHIFT = 5
"""Of each ball: impact only."""
HOP = 6
"""Of each contact: where its balls would part no faster than this they stay together."""
FIRST = 7
"""Of a pool: how far along the row it begins. The same balls' sums and the common g follow."""
POOL_INERTIA, POOL_PULL, POOL_HOLD, POOL_COARSE, POOL_LEVEL = 8, 9, 10, 11, 12
POOL_WIDTH = 13
"""Columns of the array of pools: one line for each ball, contact or pool."""


@register_jitable(**INLINED)
def level(inertia: float, pull: float, hold: float, coarse: float) -> float:
    """g of balls that move as one: what friction at rest leaves of the pull, over the inertia."""
    if hold < 0.0:
        return pull / inertia
    if abs(pull) <= hold + coarse:
        return 0.0
    return (pull - hold if pull > 0.0 else pull + hold) / inertia


@register_jitable(**INLINED)
def together(pools: Any, before: int, hop: float, coarse: float) -> bool:
    """Whether pool ``before`` and the next one push each other, or would but for rounding."""
    here = before + 1
    parts = pools[here, POOL_LEVEL] - pools[before, POOL_LEVEL]
    if parts <= hop:
        return True
    rests = pools[here, POOL_HOLD] >= 0.0
    if rests and pools[here, POOL_LEVEL] * pools[before, POOL_LEVEL] <= 0.0:
        return False
    a, b = pools[before, POOL_INERTIA], pools[here, POOL_INERTIA]
    return parts * a * b / (a + b) <= coarse


@register_jitable(**APART)
def pool(race: Race, pools: Any) -> bool:
    """Fill in LEVEL, and join the balls of each pool.

    PULL, HOLD, COARSE, CLOSED and HOP say what holds at the instant. Returns whether a contact that
    was joined is not any more, or vice versa.
    """
    n, table, modes = number_of(race.number), race.room.table, race.modes
    if not holds(race.meets):
        for i in range(n):
            pools[i, LEVEL] = level(
                table[i, INERTIA], pools[i, PULL], pools[i, HOLD], pools[i, COARSE]
            )
        return False
    begin = first_open(race, pools, CLOSED)
    top = -1
    for step in range(n):
        i = ball_at(race, around(race, begin + step))
        top += 1
        pools[top, FIRST] = step
        pools[top, POOL_INERTIA] = table[i, INERTIA]
        pools[top, POOL_PULL] = pools[i, PULL]
        pools[top, POOL_HOLD] = pools[i, HOLD]
        pools[top, POOL_COARSE] = pools[i, COARSE]
        pools[top, POOL_LEVEL] = level(
            table[i, INERTIA], pools[i, PULL], pools[i, HOLD], pools[i, COARSE]
        )
        while top > 0:
            k = around(race, begin + int(pools[top, FIRST]) - 1)
            if pools[k, CLOSED] == 0.0:
                break
            coarse = (
                pools[ball_at(race, k), COARSE] + pools[ball_at(race, around(race, k + 1)), COARSE]
            )
            if not together(pools, top - 1, pools[k, HOP], coarse):
                break
            top -= 1
            for column in (POOL_INERTIA, POOL_PULL, POOL_HOLD, POOL_COARSE):
                pools[top, column] += pools[top + 1, column]
            pools[top, POOL_LEVEL] = level(
                pools[top, POOL_INERTIA],
                pools[top, POOL_PULL],
                pools[top, POOL_HOLD],
                pools[top, POOL_COARSE],
            )
    changed = False
    for p in range(top + 1):
        end = n if p == top else int(pools[p + 1, FIRST])
        for step in range(int(pools[p, FIRST]), end):
            k = around(race, begin + step)
            pools[ball_at(race, k), LEVEL] = pools[p, POOL_LEVEL]
            joined = 1 if step < end - 1 else 0
            changed = changed or modes[k, JOINED] != joined
            modes[k, JOINED] = joined
    return changed
