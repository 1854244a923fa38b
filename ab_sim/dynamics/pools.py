"""Which balls that touch move together, at one instant: the complementarity problem of whole rows.

Along a row of balls in contact, with path accelerations g_i, or path speeds after an impact,

    mu_i g_i = p_i - phi_i + push_{i-1} - push_i,    0 <= push_k  _|_  g_{k+1} - g_k >= 0,

and phi_i in F_i Sign(g_i), the friction on a ball at rest. These are the conditions for a minimum
of sum_i (mu_i g_i^2 / 2 - p_i g_i + F_i |g_i|) over all g that do not fall along the row: an
isotonic regression. Pooling neighbours that violate the order solves it exactly, in one pass (Best,
Chakravarti and Ubhaya (2000), SIAM J. Optim. 10). A pool moves as one ball.
"""

import numba

from ab_sim.dynamics.dispatch import APART, INLINED, chosen_by
from ab_sim.dynamics.rows import first_open
from ab_sim.dynamics.scratch import INERTIA
from ab_sim.dynamics.system import JOINED, ball_at, ball_count, has_contact

PULL, HOLD = 0, 1
"""Of each ball: p_i [N], or an impulse [N s]; F_i [N], negative for a ball that does not rest. The
balls of a row all rest or all move."""
GRAIN = 2
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
POOL_INERTIA, POOL_PULL, POOL_HOLD, POOL_GRAIN, POOL_LEVEL = 8, 9, 10, 11, 12
POOL_WIDTH = 13
"""Columns of the array of pools: one line for each ball, contact or pool."""


@numba.njit(**INLINED)
def level(inertia, pull, hold, grain):  # type: ignore[no-untyped-def]
    """g of balls that move as one: what friction at rest leaves of the pull, over the inertia."""
    if hold < 0.0:
        return pull / inertia
    if abs(pull) <= hold + grain:
        return 0.0
    return (pull - hold if pull > 0.0 else pull + hold) / inertia


@numba.njit(**INLINED)
def together(pools, before, hop, grain):  # type: ignore[no-untyped-def]
    """Whether pool ``before`` and the next one push each other, or would but for rounding."""
    here = before + 1
    parts = pools[here, POOL_LEVEL] - pools[before, POOL_LEVEL]
    if parts <= hop:
        return True
    rests = pools[here, POOL_HOLD] >= 0.0
    if rests and pools[here, POOL_LEVEL] * pools[before, POOL_LEVEL] <= 0.0:
        return False
    a, b = pools[before, POOL_INERTIA], pools[here, POOL_INERTIA]
    return parts * a * b / (a + b) <= grain


@numba.njit(**APART)
def _pool(system, modes, scratch, pools):  # type: ignore[no-untyped-def]
    n = system.contacts.shape[0]
    begin = first_open(system, pools, CLOSED)
    top = -1
    for step in range(n):
        i = ball_at(system, (begin + step) % n)
        top += 1
        pools[top, FIRST] = step
        pools[top, POOL_INERTIA] = scratch[i, INERTIA]
        pools[top, POOL_PULL] = pools[i, PULL]
        pools[top, POOL_HOLD] = pools[i, HOLD]
        pools[top, POOL_GRAIN] = pools[i, GRAIN]
        pools[top, POOL_LEVEL] = level(
            scratch[i, INERTIA], pools[i, PULL], pools[i, HOLD], pools[i, GRAIN]
        )
        while top > 0:
            k = (begin + int(pools[top, FIRST]) - 1) % n
            if pools[k, CLOSED] == 0.0:
                break
            grain = pools[ball_at(system, k), GRAIN] + pools[ball_at(system, (k + 1) % n), GRAIN]
            if not together(pools, top - 1, pools[k, HOP], grain):
                break
            top -= 1
            for column in (POOL_INERTIA, POOL_PULL, POOL_HOLD, POOL_GRAIN):
                pools[top, column] += pools[top + 1, column]
            pools[top, POOL_LEVEL] = level(
                pools[top, POOL_INERTIA],
                pools[top, POOL_PULL],
                pools[top, POOL_HOLD],
                pools[top, POOL_GRAIN],
            )
    changed = False
    for p in range(top + 1):
        end = n if p == top else int(pools[p + 1, FIRST])
        for step in range(int(pools[p, FIRST]), end):
            k = (begin + step) % n
            pools[ball_at(system, k), LEVEL] = pools[p, POOL_LEVEL]
            joined = 1 if step < end - 1 else 0
            changed = changed or modes[k, JOINED] != joined
            modes[k, JOINED] = joined
    return changed


@numba.njit(**APART)
def _each_alone(system, modes, scratch, pools):  # type: ignore[no-untyped-def]
    for i in range(ball_count(system)):
        pools[i, LEVEL] = level(
            scratch[i, INERTIA], pools[i, PULL], pools[i, HOLD], pools[i, GRAIN]
        )
    return False


pool = chosen_by(has_contact, _pool, _each_alone)
"""Fill in LEVEL, and join the balls of each pool; ``(system, modes, scratch, pools)``.

PULL, HOLD, GRAIN, CLOSED and HOP say what holds at the instant. Returns whether a contact that was
joined is not any more, or vice versa.
"""
