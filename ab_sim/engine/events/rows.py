"""Decide which touching balls move together at one instant, as an isotonic regression.

In a row of balls in contact, with path accelerations g_i, or path speeds after an impact,

    mu_i g_i = p_i - phi_i + push_{i-1} - push_i,    0 <= push_k  _|_  g_{k+1} - g_k >= 0,

and phi_i in F_i Sign(g_i), the friction on a ball at rest. These are the optimality conditions for
a minimum of sum_i (mu_i g_i^2 / 2 - p_i g_i + F_i |g_i|) over all g that do not fall along the row:
an isotonic regression. Pooling neighbours that violate the order solves it exactly in one pass
(Best, Chakravarti and Ubhaya (2000), SIAM J. Optim. 10). A pool moves as one ball.
"""

from ab_sim.engine.compiling.kinds import Table
from ab_sim.engine.events.balls import around, ball_at
from ab_sim.engine.events.run import BallEvents
from ab_sim.model.dynamics.system import JOINED, ROLLING_MASS

PATH_FORCE, HOLD = 0, 1
"""Columns per ball: force p_i [N], or an impulse [N s]; largest friction F_i [N], negative for a
ball that is not at rest. In a row, all balls are at rest or all move."""
COARSE = 2
"""Column per ball: bound of the rounding error of its PATH_FORCE."""
LEVEL = 3
"""Column per ball: solution g_i [m/s^2]; in impacts a speed [m/s]."""
CLOSED = 4
"""Column per contact: 1 if its balls touch and neither approach nor part."""
SHIFT = 5
"""Column per ball: speed by which its bounce shifts it, in impacts only."""
HOP = 6
"""Column per contact: largest difference of LEVEL at which the two balls stay together."""
FIRST = 7
"""Column per pool: place of its first ball in the row."""
_POOL_INERTIA, _POOL_PULL, _POOL_HOLD, _POOL_COARSE, _POOL_LEVEL = 8, 9, 10, 11, 12
"""Columns per pool: sums over its balls, and their common g."""
WIDTH = 13
"""Number of columns of the array of rows, which has one line for each ball, contact or pool."""


def level(inertia: float, pull: float, hold: float, coarse: float) -> float:
    """Return g of balls that move as one: the pull in excess of friction at rest, per inertia.

    Parameters
    ----------
    inertia
        Sum of the balls' mu [kg].
    pull
        Sum of the forces on them [N].
    hold
        Sum of their largest static friction [N]; negative if they are not at rest.
    coarse
        Bound of the rounding error of ``pull`` [N].
    """
    if hold < 0.0:
        return pull / inertia
    if abs(pull) <= hold + coarse:
        return 0.0
    return (pull - hold if pull > 0.0 else pull + hold) / inertia


def _put_level(rows: Table, pool: int) -> None:
    """Compute the common acceleration g of a pool's balls from the pool's sums."""
    rows[pool, _POOL_LEVEL] = level(
        rows[pool, _POOL_INERTIA],
        rows[pool, _POOL_PULL],
        rows[pool, _POOL_HOLD],
        rows[pool, _POOL_COARSE],
    )


def _are_together(rows: Table, before: int, hop: float, coarse: float) -> bool:
    """Return whether pool ``before`` and the next one push each other, up to rounding.

    Parameters
    ----------
    rows
        Rows of touching balls.
    before
        Number of the first of the two pools.
    hop
        Largest difference of their g at which they stay together.
    coarse
        Bound of the rounding error of a force on them [N].
    """
    here = before + 1
    parts = rows[here, _POOL_LEVEL] - rows[before, _POOL_LEVEL]
    if parts <= hop:
        return True
    rests = rows[here, _POOL_HOLD] >= 0.0
    if rests and rows[here, _POOL_LEVEL] * rows[before, _POOL_LEVEL] <= 0.0:
        return False
    a, b = rows[before, _POOL_INERTIA], rows[here, _POOL_INERTIA]
    return parts * a * b / (a + b) <= coarse


def first_open(balls: BallEvents, rows: Table) -> int:
    """Return a place at which a row of touching balls begins."""
    for k in range(balls.number):
        if rows[around(balls, k - 1), CLOSED] == 0.0:
            return k
    return 0


def solve_rows(balls: BallEvents, rows: Table) -> bool:
    """Compute LEVEL from the other columns, and join the balls of each pool.

    Returns
    -------
    bool
        True if a contact was joined or separated.
    """
    n, top, changed = balls.number, -1, False
    begin = first_open(balls, rows) if balls.has_contact else 0
    for place in range(n):
        i = ball_at(balls, begin + place) if balls.has_contact else place
        top += 1
        rows[top, FIRST] = float(place)
        rows[top, _POOL_INERTIA] = balls.constants[i, ROLLING_MASS]
        for column in (PATH_FORCE, HOLD, COARSE):
            rows[top, _POOL_PULL + column] = rows[i, column]
        _put_level(rows, top)
        if not balls.has_contact:
            rows[i, LEVEL] = rows[top, _POOL_LEVEL]
            continue
        # Pool adjacent violators: merge the new ball with the pool before it as long as the two
        # push each other. A merged pool may violate the order with its predecessor, hence the
        # loop; each merge removes a pool, so there are fewer than n of them.
        while top > 0:
            k = around(balls, begin + int(rows[top, FIRST]) - 1)
            coarse = rows[ball_at(balls, k), COARSE] + rows[ball_at(balls, k + 1), COARSE]
            if rows[k, CLOSED] == 0.0 or not _are_together(rows, top - 1, rows[k, HOP], coarse):
                break
            top -= 1
            for column in (_POOL_INERTIA, _POOL_PULL, _POOL_HOLD, _POOL_COARSE):
                rows[top, column] += rows[top + 1, column]
            _put_level(rows, top)
    if not balls.has_contact:
        return False
    for pool in range(top + 1):
        end = n if pool == top else int(rows[pool + 1, FIRST])
        for place in range(int(rows[pool, FIRST]), end):
            k = around(balls, begin + place)
            rows[ball_at(balls, k), LEVEL] = rows[pool, _POOL_LEVEL]
            joined = 1 if place < end - 1 else 0
            changed = changed or balls.discrete[k, JOINED] != joined
            balls.discrete[k, JOINED] = joined
    return changed
