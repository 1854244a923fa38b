"""Choose the branches of all set-valued laws at an event.

At one instant several balls may come to rest, start to move, meet or part. Which of them do depends
on all of them, as they are coupled by the deck. All branches are therefore chosen together, as the
solution of the complementarity problem of the set-valued laws (Leine and Nijmeijer, ch. 5).

Given the accelerations x of deck and spindle, each row of balls is a separate problem that is
solved exactly (``rows``). The branches found give a new x, from the equations of motion. This is
Newton's method for K piecewise linear equations. It ends at the exact solution as soon as no branch
changes.
"""

from ab_sim.engine.compiling.kinds import Floats, scratch
from ab_sim.engine.events.balls import (
    around,
    ball_at,
    force_rounding,
    gap,
    largest_friction,
    moves_along,
    path_force_at,
    path_force_less_friction,
    put_branches,
    put_normal_forces,
    sign,
)
from ab_sim.engine.events.event_functions import (
    MOTOR,
    RATE_ROUNDING,
    SLIDE,
    TOUCH,
    evaluate_at_start,
    motor_functions,
)
from ab_sim.engine.events.impact import collide
from ab_sim.engine.events.rows import CLOSED, COARSE, HOLD, HOP, LEVEL, PATH_FORCE, solve_rows
from ab_sim.engine.events.run import ALONG, CURVE, BallEvents, Run, evaluate
from ab_sim.model.dynamics.system import DIRECTION, JOINED, LOADED

_DIRECT = 8
"""Iterations of undamped Newton's method; later ones also choose branches at averaged x."""
_ROUNDS = 60
"""Maximum number of iterations."""
STILL = 4.0 * RATE_ROUNDING
"""Rate [rad/s] up to which a ball is set to rest at an event. Balls in contact come to rest
together, but their rates differ by rounding."""


def solve_complementarity(run: Run, time: float, slot: int, plastic: bool) -> None:
    """Apply the event of ``slot`` (-1 for none), and choose all branches that hold just after it.

    A collision changes velocities; a ball whose sliding speed reached zero is set to rest. No
    branch is changed directly: a ball at rest sticks or slides by its force along the race.
    Afterwards slope, table and event functions are those just after the instant. An instant at
    which no consistent branches are found is counted in ``counts``.

    Parameters
    ----------
    run
        Run whose state changes; its table was evaluated at the state's angles.
    time
        Local time [s].
    slot
        Event function that has reached zero, or -1.
    plastic
        True if balls that meet do not bounce.
    """
    balls, work, discrete = run.balls, run.work, run.balls.discrete
    n, between = balls.number, scratch(balls.accelerations)
    if 0 <= slot < MOTOR * n:
        kind, i = slot // n, slot % n
        if (
            balls.has_contact
            and kind == TOUCH
            and discrete[i, JOINED] == 0
            and not collide(run, time, i, plastic)
        ):
            work.counts[1] += 1
        if balls.has_friction:
            stopped = kind == SLIDE and discrete[i, DIRECTION] != 0
            _come_to_rest(balls, run.state, i if stopped else -1)
        if balls.has_contact:
            _close_gaps(balls, run.state)
    if balls.has_contact:
        # Contacts that are closed at this instant; the solution may open some of them.
        for k in range(n):
            work.rows[k, CLOSED] = float(discrete[k, JOINED])
            work.rows[k, HOP] = 0.0
    consistent = False
    # The first iteration evaluates the branches that held before the instant.
    for count in range(_ROUNDS):
        put_branches(balls)
        evaluate(run, time, run.state, work.slope)
        if not _choose_branches(run, balls.x):
            consistent = True
            break
        # Newton's method may cycle between several sets of branches. After DIRECT iterations,
        # branches are chosen at the average of this and earlier accelerations, which damps it.
        for r in range(balls.accelerations):
            between[r] = balls.x[r] if count < _DIRECT else 0.5 * (balls.x[r] + between[r])
        if count >= _DIRECT:
            _choose_branches(run, between)
    if not consistent:
        work.counts[1] += 1
        put_branches(balls)
        evaluate(run, time, run.state, work.slope)
    evaluate_at_start(run)


def _come_to_rest(balls: BallEvents, state: Floats, stopped: int) -> None:
    """Set a ball to rest whose sliding speed is zero up to rounding, with equally slow balls.

    ``_choose_branches`` recognises rest by a rate of exactly zero. The rows of these balls are set
    to rest, too.

    Parameters
    ----------
    balls
        Balls with their rows.
    state
        State of the system, changed in place.
    stopped
        Ball that has stopped; -1 for none.
    """
    first, still = balls.first_rate, STILL
    if stopped >= 0:
        still = max(STILL, abs(state[first + stopped]))
    for i in range(balls.number):
        if 0.0 < abs(state[first + i]) <= still:
            state[first + i] = 0.0
            if balls.has_contact:
                _stop_row(balls, state, i)


def _stop_row(balls: BallEvents, state: Floats, i: int) -> None:
    """Set to rest all balls in the row of ball i."""
    ahead = 0
    while ball_at(balls, ahead) != i:
        ahead += 1
    behind = ahead
    while moves_along(balls, ahead):
        ahead = around(balls, ahead + 1)
    while moves_along(balls, around(balls, behind - 1)):
        behind = around(balls, behind - 1)
    for step in range(around(balls, ahead - behind) + 1):
        state[balls.first_rate + ball_at(balls, behind + step)] = 0.0


def _close_gaps(balls: BallEvents, state: Floats) -> None:
    """Move balls so that those in contact touch exactly and none overlap.

    This removes the drift by rounding and truncation errors. It starts after the widest gap, which
    takes up the displacements.
    """
    begin, widest = 0, 0.0
    for k in range(balls.number):
        opening = gap(balls, k)
        if opening > widest:
            begin, widest = around(balls, k + 1), opening
    for place in range(balls.number - 1):
        k = around(balls, begin + place)
        opening = gap(balls, k)
        if balls.discrete[k, JOINED] == 1 or opening < 0.0:
            j = ball_at(balls, k + 1)
            state[balls.first_angle + j] -= opening / balls.table[CURVE, j]
            balls.table[ALONG, j] -= opening


def _choose_branches(run: Run, x: Floats) -> bool:
    """Choose the branches that hold just after an instant, given the accelerations x there.

    A moving ball slides in the direction of its rate. A ball at rest sticks if the force along the
    race is within friction, up to one rounding bound; otherwise it slides in the force's direction.
    Call it right after ``evaluate``.

    Returns
    -------
    bool
        True if any branch has changed.
    """
    balls, rows, state, discrete = run.balls, run.work.rows, run.state, run.balls.discrete
    first, changed = balls.first_rate, False
    if balls.has_friction:
        put_normal_forces(balls, x)
    for i in range(balls.number):
        coarse = force_rounding(balls, i, path_force_less_friction(balls, i, x), x)
        rows[i, COARSE] = coarse
        rows[i, HOLD] = -1.0
        rows[i, PATH_FORCE] = path_force_at(balls, i, x)
        if balls.has_friction:
            # Hysteresis of one rounding bound: rounding alone cannot change this branch.
            force, was_loaded, rate = balls.force[i], discrete[i, LOADED], state[first + i]
            slack = -coarse if was_loaded == 1 else coarse
            loaded = 1 if force > slack or (force == 0.0 and was_loaded == 1) else 0
            changed = changed or loaded != was_loaded
            discrete[i, LOADED] = loaded
            if rate == 0.0:
                rows[i, HOLD] = largest_friction(balls, i)
            elif loaded == 1:
                rows[i, PATH_FORCE] -= sign(rate) * largest_friction(balls, i)
    if solve_rows(balls, rows):
        changed = True
    if balls.has_friction:
        for i in range(balls.number):
            rate = state[first + i]
            direction = sign(rows[i, LEVEL] if rate == 0.0 else rate)
            changed = changed or discrete[i, DIRECTION] != direction
            discrete[i, DIRECTION] = direction
    if balls.has_motor and _choose_motor_branch(run):
        changed = True
    return changed


def _choose_motor_branch(run: Run) -> bool:
    """Choose whether the motor is at its limit, and return whether that has changed."""
    balls, value, rounding = run.balls, run.work.value, run.work.rounding
    # Slot 0 is crossed at the lower limit, or, at a limit, when the commanded torque returns below
    # it; slot 1 is crossed at the upper limit.
    slot, before = MOTOR * balls.number, balls.discrete[balls.number, DIRECTION]
    motor_functions(balls, value, rounding)
    after = before
    if value[slot] < -rounding[slot]:
        after = -1 if before == 0 else 0
    elif before == 0 and value[slot + 1] < -rounding[slot + 1]:
        after = 1
    balls.discrete[balls.number, DIRECTION] = after
    return after != before
