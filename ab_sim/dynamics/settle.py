"""What happens at an event: a law takes another branch, and the others follow.

At one instant several balls may come to rest, let go, meet or part; which do depends on all of
them through the deck. All of them are decided at once, as the complementarity problem that
set-valued laws pose (Leine and Nijmeijer, ch. 5). Given the specific force A of the deck and the
spindle's acceleration, each row is one of its own and solved exactly (``pools``); the branches
found give A anew, from the equations of motion. That is Newton's method for two or three piecewise
linear equations, which ends, at the exact solution, as soon as no branch changes.
"""

import numba

from ab_sim.dynamics.dispatch import APART, INLINED, only_if
from ab_sim.dynamics.impact import collide
from ab_sim.dynamics.planar import derivatives, spindle_motion
from ab_sim.dynamics.pools import CLOSED, GRAIN, HOLD, HOP, LEVEL, PULL, pool
from ab_sim.dynamics.reactions import normal_forces, pull_at
from ab_sim.dynamics.rows import moves_along, sign
from ab_sim.dynamics.scratch import FORCE, FRICTION
from ab_sim.dynamics.switches import (
    MOTOR,
    RATE_GRAIN,
    SLIDE,
    TOUCH,
    capacity,
    coarseness,
    gap,
    margins,
    motor_margins,
    path_radius,
)
from ab_sim.dynamics.system import (
    DIRECTION,
    JOINED,
    LOADED,
    ball_at,
    ball_count,
    has_contact,
    has_friction,
    has_motor,
)

DIRECT = 8
"""Rounds of Newton's method; after so many, half-way between the last two is tried as well."""
ROUNDS = 60
STILL = 4.0 * RATE_GRAIN
"""rad/s. Balls that roll side by side come to rest together, though rounding tells them apart: a
rate as small as at the end of sliding is that of a ball at rest."""


@numba.njit(**APART)
def settle(system, place, time, state, modes, slot, plastic, work):  # type: ignore[no-untyped-def]
    """Change the branch of ``slot`` (-1: none), then all that this makes wrong.

    Args:
        system, place, time, state, modes: as for ``derivatives``; state and modes are changed.
        slot: the margin that has reached zero, or -1.
        plastic: whether balls that meet no longer bounce.
        work: a Workspace; slopes[0], scratch, margin and grain hold what ``derivatives`` and
            ``margins`` say at the end. Counts an instant for which no branches are found.

    Returns:
        The deck's specific force A1, A2 [m/s^2] at the end.
    """
    n = ball_count(system)
    if 0 <= slot < MOTOR * n:
        kind, i = slot // n, slot % n
        if kind == TOUCH:
            meet(system, place, time, state, modes, i, plastic, work)
        stopped = i if kind == SLIDE and modes[i, DIRECTION] != 0 else -1
        come_to_rest(system, state, modes, stopped)
        close_gaps(system, state, modes)
    remember_contacts(system, modes, work.pools)
    B1 = B2 = bl = 0.0
    found = False
    for count in range(ROUNDS):
        A1, A2, al = derivatives(system, place, time, state, modes, work.slopes[0], work.scratch)
        if not branches(system, place, time, state, modes, A1, A2, al, work):
            found = True
            break
        if count < DIRECT:
            B1, B2, bl = A1, A2, al
        else:
            B1, B2, bl = 0.5 * (A1 + B1), 0.5 * (A2 + B2), 0.5 * (al + bl)
            branches(system, place, time, state, modes, B1, B2, bl, work)
    if not found:
        work.counts[1] += 1
        A1, A2, al = derivatives(system, place, time, state, modes, work.slopes[0], work.scratch)
    margins(system, place, time, state, modes, A1, A2, al, work.scratch, work.margin, work.grain)
    return A1, A2


@numba.njit(**INLINED)
def _meet(system, place, time, state, modes, k, plastic, work):  # type: ignore[no-untyped-def]
    if modes[k, JOINED] == 0:
        spindle = spindle_motion(system, place, time, state, modes)
        speed, scratch, pools = spindle.speed, work.scratch, work.pools
        if not collide(system, speed, state, modes, k, plastic, scratch, pools):
            work.counts[1] += 1


@numba.njit(**APART)
def _come_to_rest(system, state, modes, stopped):  # type: ignore[no-untyped-def]
    n = ball_count(system)
    still = STILL if stopped < 0 else max(STILL, abs(state[4 + n + stopped]))
    for i in range(n):
        if 0.0 < abs(state[4 + n + i]) <= still:
            state[4 + n + i] = 0.0
            stop_row(system, state, modes, i)


@numba.njit(**INLINED)
def _stop_row(system, state, modes, i):  # type: ignore[no-untyped-def]
    n = ball_count(system)
    ahead = behind = place_of(system, i)
    while moves_along(system, modes, ahead):
        ahead = (ahead + 1) % n
    while moves_along(system, modes, (behind - 1) % n):
        behind = (behind - 1) % n
    for step in range((ahead - behind) % n + 1):
        state[4 + n + ball_at(system, (behind + step) % n)] = 0.0


@numba.njit(**APART)
def place_of(system, i):  # type: ignore[no-untyped-def]
    """Place of ball i in the row."""
    at = 0
    for k in range(system.contacts.shape[0]):
        if ball_at(system, k) == i:
            at = k
    return at


@numba.njit(**APART)
def _close_gaps(system, state, modes):  # type: ignore[no-untyped-def]
    n = system.contacts.shape[0]
    begin, widest = 0, 0.0
    for k in range(n):
        room = gap(system, state, modes, k)
        if room > widest:
            begin, widest = (k + 1) % n, room
    for step in range(n - 1):
        k = (begin + step) % n
        moved = gap(system, state, modes, k)
        if modes[k, JOINED] == 1 or moved < 0.0:
            j = ball_at(system, (k + 1) % n)
            state[4 + j] -= moved / path_radius(system, state, j)


@numba.njit(**INLINED)
def _remember_contacts(system, modes, pools):  # type: ignore[no-untyped-def]
    for k in range(system.contacts.shape[0]):
        pools[k, CLOSED] = modes[k, JOINED]
        pools[k, HOP] = 0.0


meet = only_if(has_contact, _meet)
"""Contact k has closed: an impact."""
come_to_rest = only_if(has_friction, _come_to_rest)
"""Bring to rest the ball that has ``stopped`` (-1: none), others as slow as it, and their rows."""
stop_row = only_if(has_contact, _stop_row)
"""Bring those in a row with ball i to rest."""
close_gaps = only_if(has_contact, _close_gaps)
"""Take out what rounding and truncation have done to balls in contact, and any overlap."""
remember_contacts = only_if(has_contact, _remember_contacts)
"""Which balls touch at this instant, whatever becomes of them."""


@numba.njit(**APART)
def branches(system, place, time, state, modes, A1, A2, al, work):  # type: ignore[no-untyped-def]
    """The branches that hold just after an instant if A and al are the accelerations there.

    Right after ``derivatives``. Returns whether any was not in force.
    """
    changed = False
    n, scratch, pools = ball_count(system), work.scratch, work.pools
    normal_forces(system, A1, A2, al, scratch)
    for i in range(n):
        pull = pull_at(system, i, A1, A2, al, scratch)
        pools[i, GRAIN] = coarseness(system, i, A1, A2, pull, scratch)
        pools[i, HOLD] = -1.0
        if has_friction(system.effects):
            force = scratch[i, FORCE]
            pull += scratch[i, FRICTION] * force
            slack = -pools[i, GRAIN] if modes[i, LOADED] == 1 else pools[i, GRAIN]
            loaded = 1 if force > slack or (force == 0.0 and modes[i, LOADED] == 1) else 0
            changed = changed or modes[i, LOADED] != loaded
            modes[i, LOADED] = loaded
            if state[4 + n + i] == 0.0:
                pools[i, HOLD] = capacity(system, i, scratch)
            elif loaded == 1:
                pull -= sign(state[4 + n + i]) * capacity(system, i, scratch)
        pools[i, PULL] = pull
    changed = pool(system, modes, scratch, pools) or changed
    if has_friction(system.effects):
        for i in range(n):
            rate = state[4 + n + i]
            direction = sign(pools[i, LEVEL] if rate == 0.0 else rate)
            changed = changed or modes[i, DIRECTION] != direction
            modes[i, DIRECTION] = direction
    return motor_branch(system, place, time, state, modes, work) or changed


@numba.njit(**INLINED)
def _motor_branch(system, place, time, state, modes, work):  # type: ignore[no-untyped-def]
    n = ball_count(system)
    motor_margins(system, place, time, state, modes, work.margin, work.grain)
    before = modes[n, DIRECTION]
    if work.margin[MOTOR * n] < -work.grain[MOTOR * n]:
        modes[n, DIRECTION] = -1 if before == 0 else 0
    elif before == 0 and work.margin[MOTOR * n + 1] < -work.grain[MOTOR * n + 1]:
        modes[n, DIRECTION] = 1
    return modes[n, DIRECTION] != before


motor_branch = only_if(has_motor, _motor_branch)
"""Whether the motor gives all it can; ``(system, place, time, state, modes, work)``."""
