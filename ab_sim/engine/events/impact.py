"""Collisions of balls: velocities jump, positions do not.

Let V be the velocities (of deck and spindle, and of the balls along the race) and G their mass
matrix. Impulses P at the contacts give G dV = (0, .., P_{i-1} - P_i, .., 0), which has the same
arrowhead form as the equations of motion. Newton's law holds for all closed contacts together: the
balls part at least at e times the speed of their approach, 0 <= P _|_ u+ + e u- >= 0 (Moreau
(1988); Leine and Nijmeijer, ch. 5). The energy lost is -sum_i P_i (s_i' + ds_i' / 2).
"""

from ab_sim.engine.compiling.kinds import Floats, Table, call, scratch
from ab_sim.engine.events.balls import (
    around,
    ball_at,
    path_force_at,
    path_speed,
    put_branches,
    sign,
)
from ab_sim.engine.events.rows import CLOSED, COARSE, HOLD, HOP, SHIFT, first_open, solve_rows
from ab_sim.engine.events.rows import PATH_FORCE as ROW_PULL
from ab_sim.engine.events.run import (
    COUPLING,
    CURVE,
    INERTIA,
    PATH,
    PATH_ACCELERATION,
    PATH_FORCE,
    SPEED,
    BallEvents,
    Run,
)
from ab_sim.model.dynamics.system import DIRECTION, JOINED

ROUNDING = 1e-14
"""Bound of a momentum's rounding error, relative to the fastest ball's momentum."""
_SLOW_HOP = 3e-8
"""Separation speed [m/s] up to which touching balls stay together in an impact of other balls."""
SLOW_IMPACT = 1e-6
"""Impact speed [m/s] up to which no balls bounce or separate. Balls may reach such a speed within a
gap that counts as zero. If they bounced, the impacts would recur without end."""
_ROUNDS = 60
"""Maximum number of iterations."""


def collide(run: Run, time: float, struck: int, plastic: bool) -> bool:
    """Compute the collision at contact ``struck``, together with all other closed contacts.

    Contacts that stay closed are joined afterwards, others are not. Stuck balls start to slide if
    an impulse moves them.

    Parameters
    ----------
    run
        Run whose state changes; its table was evaluated at the state's angles.
    time
        Local time [s].
    struck
        Contact that has just closed.
    plastic
        True if no balls bounce.

    Returns
    -------
    bool
        True if impulses that satisfy Newton's law at all contacts were found.
    """
    balls, rows, state = run.balls, run.work.rows, run.state
    table, discrete, first = balls.table, balls.discrete, balls.first_rate
    call(run.scene.arrow, run.scene.c, balls.branches, state, balls.block, time)
    for i in range(balls.number):
        # An impact has no duration, so friction forces have no impulse: no ball sticks in it.
        if balls.has_friction:
            discrete[i, DIRECTION] = 1
        table[PATH, i] = path_speed(balls, state, i)
    discrete[struck, JOINED] = 1
    _shift_speeds(run, struck, plastic)
    # The same iteration as in ``complementarity``: the joined contacts give the jumps, and the
    # jumps give the contacts that stay joined, until none changes.
    collided = False
    for _ in range(_ROUNDS):
        put_branches(balls)
        solve_jumps(balls)
        for i in range(balls.number):
            rows[i, ROW_PULL] = path_force_at(balls, i, balls.x)
        if not solve_rows(balls, rows):
            collided = True
            break
    for i in range(balls.number):
        table[PATH_FORCE, i] = table[PATH_ACCELERATION, i] + rows[i, SHIFT] - table[PATH, i]
    jump(run)
    begin = first_open(balls, rows)
    for place in range(balls.number):
        k = around(balls, begin + place)
        i, j = ball_at(balls, k), ball_at(balls, k + 1)
        if rows[i, SHIFT] != rows[j, SHIFT]:
            discrete[k, JOINED] = 0
        if discrete[k, JOINED] == 1:
            # Equal path speeds to the last bit, so that rounding does not pull a row apart.
            state[first + j] = state[first + i] * (table[CURVE, i] / table[CURVE, j])
    if balls.has_friction:
        for i in range(balls.number):
            discrete[i, DIRECTION] = sign(state[first + i])
    return collided


def _shift_speeds(run: Run, struck: int, plastic: bool) -> None:
    """Set up the equations for the path speeds after an impact, reduced by the bounce (SHIFT).

    SHIFT of a ball is the sum of e times the speed of approach over the contacts before it in its
    row. For speeds reduced by it, u+ + e u- >= 0 means that they do not fall along the row. This is
    the condition that ``rows`` solves for accelerations. The right-hand sides of deck and spindle
    are the corresponding momenta.
    """
    balls, rows = run.balls, run.work.rows
    table, block, every = balls.table, balls.block, balls.accelerations
    hit = table[PATH, ball_at(balls, struck)] - table[PATH, ball_at(balls, struck + 1)]
    fastest, shift = 0.0, 0.0
    for k in range(balls.number):
        fastest = max(fastest, abs(table[PATH, k]))
        rows[k, CLOSED] = float(balls.discrete[k, JOINED])
        rows[k, HOP] = hit if 0.0 < hit <= SLOW_IMPACT else _SLOW_HOP
    rows[struck, HOP] = 0.0
    for r in range(every):
        block[r, every] = balls.x[r] = 0.0
    parting = scratch(1)
    begin = first_open(balls, rows)
    for place in range(balls.number):
        k = around(balls, begin + place)
        i, j = ball_at(balls, k), ball_at(balls, k + 1)
        path = table[PATH, i] - shift
        table[PATH_FORCE, i] = table[INERTIA, i] * path
        for r in range(every):
            block[r, every] -= table[COUPLING + r, i] * path
        rows[i, SHIFT] = shift
        rows[i, HOLD] = -1.0
        rows[i, COARSE] = ROUNDING * table[INERTIA, i] * fastest
        approach = table[PATH, i] - table[PATH, j]
        if rows[k, CLOSED] == 0.0:
            shift = 0.0
        elif approach > SLOW_IMPACT and not plastic:
            call(run.scene.restitution, run.scene.c, balls.branches, parting, approach)
            shift += parting[0] * approach


def solve_jumps(balls: BallEvents) -> None:
    """Solve the equations in ``block`` and PATH_FORCE, without friction.

    The balls' rows are eliminated with their mobility (Schur complement of the arrowhead), which
    leaves a dense system for the jumps x of deck and spindle. The balls' jumps are written to
    PATH_ACCELERATION. A prescribed spindle speed does not jump.
    """
    n, free, table, b = balls.number, balls.free, balls.table, balls.branches
    gain, matrix = scratch(free + 1, n), scratch(free, free + 1)
    for i in range(n):
        for r in range(free + 1):
            line, total = PATH_FORCE if r == free else COUPLING + r, 0.0
            for j in range(n):
                total += b[n + n * i + j] * table[line, j]
            gain[r, i] = total
    for r in range(free):
        for q in range(free):
            matrix[r, q] = balls.block[min(r, q), max(r, q)]
        matrix[r, free] = balls.block[r, balls.accelerations]
        for i in range(n):
            for q in range(free):
                matrix[r, q] -= table[COUPLING + r, i] * gain[q, i]
            matrix[r, free] += table[COUPLING + r, i] * gain[free, i]
    _solve_dense(matrix, balls.x, free)
    for i in range(n):
        g = gain[free, i]
        for r in range(free):
            g += gain[r, i] * balls.x[r]
        table[PATH_ACCELERATION, i] = g


def _solve_dense(matrix: Table, x: Floats, size: int) -> None:
    """Solve ``size`` linear equations by Gaussian elimination, right sides in the last column.

    The matrix is one of masses and inertias, positive definite, so no pivoting is needed.
    """
    for p in range(size):
        for r in range(p + 1, size):
            factor = matrix[r, p] / matrix[p, p]
            for q in range(p + 1, size + 1):
                matrix[r, q] -= factor * matrix[p, q]
    for p in range(size - 1, -1, -1):
        rest = matrix[p, size]
        for q in range(p + 1, size):
            rest -= matrix[p, q] * x[q]
        x[p] = rest / matrix[p, p]


def jump(run: Run) -> None:
    """Add the jumps of velocity to the state; PATH_FORCE holds those of the balls' path speeds."""
    balls, state, x = run.balls, run.state, run.balls.x
    table, spindle = balls.table, balls.accelerations - 1
    # The residual of the spindle's equation is the impulse of the motor. The energy lost is that of
    # the module's docstring, with the mean of the speeds before and after the impact.
    turned = lost = 0.0
    for r in range(balls.accelerations):
        turned += balls.block[r, spindle] * x[r]
    for i in range(balls.number):
        gain = table[PATH_FORCE, i]
        impulse = table[INERTIA, i] * gain
        for r in range(balls.accelerations):
            impulse -= table[COUPLING + r, i] * x[r]
        lost -= impulse * (table[PATH, i] + 0.5 * gain)
        turned -= table[COUPLING + spindle, i] * gain
        state[balls.first_rate + i] += gain / table[CURVE, i]
    call(run.scene.apply_impulse, run.scene.c, balls.branches, state, x, state)
    if balls.has_motor:
        state[balls.spindle + 1] += x[spindle]
    if balls.has_energy_balance:
        # A motor that keeps the prescribed speed does work during the impact.
        if not balls.has_motor:
            state[state.size - 2] += balls.motor[SPEED] * turned
        state[state.size - 1] += lost
