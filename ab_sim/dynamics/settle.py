"""What happens at an event: a law takes another branch, and the others follow.

At one instant several balls may come to rest, let go, meet or part; which do depends on all of
them through the deck. From the branches at hand, one that is violated is changed after the other
until none is: an active-set iteration on the linear complementarity problem that set-valued laws
pose (Leine and Nijmeijer, ch. 5), at O(n) a round.
"""

import numba

from ab_sim.dynamics.dispatch import APART, INLINED, only_if
from ab_sim.dynamics.impact import collide
from ab_sim.dynamics.planar import derivatives, spindle_motion
from ab_sim.dynamics.rows import moves_along, sign, sticks
from ab_sim.dynamics.scratch import PATH_ACCELERATION
from ab_sim.dynamics.switches import (
    HOLD,
    LOAD,
    MOTOR,
    ROUNDING,
    SLIDE,
    TOUCH,
    leans,
    margins,
)
from ab_sim.dynamics.system import DIRECTION, JOINED, LOADED, ball_at, has_contact, has_friction

PATIENCE = 3
"""How often one slot may change in one instant; beyond, its law is at the edge, either way."""


@numba.njit(**APART)
def settle(  # type: ignore[no-untyped-def]
    system, place, time, state, modes, slot, plastic, slope, scratch, margin, grain, changes
):
    """Change the branch of ``slot`` (-1: none), then all that this makes wrong.

    Args:
        system, place, time, state, modes, slope, scratch: as for ``derivatives``; state and modes
            are changed, and slope and scratch hold what ``derivatives`` says of them at the end.
        slot: the margin that has reached zero, or -1 to look at all of them.
        plastic: whether balls that meet no longer bounce.
        margin, grain: as for ``margins``; hold the margins at the end.
        changes: shape (2 slots,), overwritten.
    """
    n = system.balls.shape[0]
    slots = margin.size
    # changes: how often each slot changed; then, per contact, whether it closed at this instant.
    changes[:] = 0
    if has_contact(system.effects):
        for k in range(n):
            changes[slots + k] = modes[k, JOINED]
    if slot >= 0:
        change(system, place, time, state, modes, slot, plastic, scratch, changes)
    for _ in range(10 + 10 * n):
        A1, A2, al = derivatives(system, place, time, state, modes, slope, scratch)
        margins(system, place, time, state, modes, A1, A2, al, scratch, margin, grain)
        slot = wrong_branch(system, modes, margin, grain, changes)
        if slot >= 0:
            change(system, place, time, state, modes, slot, plastic, scratch, changes)
            continue
        if friction_corrects(system, state, modes, A1, A2, scratch, changes):
            continue
        if not contact_corrects(system, state, modes, A1, A2, scratch, changes):
            break


@numba.njit(**APART)
def wrong_branch(system, modes, margin, grain, changes):  # type: ignore[no-untyped-def]
    """A slot whose margin is negative beyond rounding, or -1; forces before motion."""
    n = system.balls.shape[0]
    for kind in (LOAD, TOUCH, SLIDE, HOLD, MOTOR):
        for i in range(n if kind != MOTOR else 2):
            slot = kind * n + i
            if kind == TOUCH and (not has_contact(system.effects) or modes[i, JOINED] == 0):
                continue
            if margin[slot] < -grain[slot] and changes[slot] < PATIENCE:
                return slot
    return -1


@numba.njit(**APART)
def change(system, place, time, state, modes, slot, plastic, scratch, changes):  # type: ignore[no-untyped-def]
    """Give the law behind a slot its other branch."""
    n = system.balls.shape[0]
    changes[slot] += 1
    if slot >= MOTOR * n:
        if modes[n, DIRECTION] != 0:
            modes[n, DIRECTION] = 0
        else:
            modes[n, DIRECTION] = -1 if slot == MOTOR * n else 1
        return
    kind, i = slot // n, slot % n
    if kind == TOUCH:
        touch_or_part(system, place, time, state, modes, i, plastic, scratch, changes)
    else:
        stick_or_slide(system, state, modes, kind, i)


@numba.njit(**INLINED)
def change_friction(system, state, modes, kind, i):  # type: ignore[no-untyped-def]
    """Give ball i's friction its other branch."""
    n = system.balls.shape[0]
    if kind == LOAD:
        modes[i, LOADED] = 1 - modes[i, LOADED]
        modes[i, DIRECTION] = sign(state[4 + n + i])
    elif kind == SLIDE and modes[i, DIRECTION] != 0:
        stop(system, state, modes, i)
    else:
        let_go(system, modes, i, -1 if kind == SLIDE else 1)


@numba.njit(**INLINED)
def change_contact(system, place, time, state, modes, k, plastic, scratch, changes):  # type: ignore[no-untyped-def]
    """Open contact k, or let its balls collide."""
    if modes[k, JOINED] == 1:
        modes[k, JOINED] = 0
        return
    spindle = spindle_motion(system, place, time, state, modes)
    collide(system, spindle.speed, state, modes, k, plastic, scratch)
    for other in range(system.contacts.shape[0]):
        changes[changes.size // 2 + other] = modes[other, JOINED]


stick_or_slide = only_if(has_friction, change_friction)
touch_or_part = only_if(has_contact, change_contact)


@numba.njit(**APART)
def place_of(system, i):  # type: ignore[no-untyped-def]
    """Place of ball i in the row."""
    at = 0
    for k in range(system.contacts.shape[0]):
        if ball_at(system, k) == i:
            at = k
    return at


@numba.njit(**APART)
def stop(system, state, modes, i):  # type: ignore[no-untyped-def]
    """Bring ball i, and those in a row with it, to rest on the race."""
    n = system.balls.shape[0]
    if has_contact(system.effects):
        ahead = behind = place_of(system, i)
        while moves_along(system, modes, ahead):
            ahead = (ahead + 1) % n
        while moves_along(system, modes, (behind - 1) % n):
            behind = (behind - 1) % n
        for step in range((ahead - behind) % n + 1):
            j = ball_at(system, (behind + step) % n)
            state[4 + n + j] = 0.0
            modes[j, DIRECTION] = 0
    state[4 + n + i] = 0.0
    modes[i, DIRECTION] = 0


@numba.njit(**APART)
def let_go(system, modes, i, direction):  # type: ignore[no-untyped-def]
    """Let stuck ball i slide in a direction, with the stuck balls that it pushes from behind."""
    n = system.balls.shape[0]
    if has_contact(system.effects):
        at = place_of(system, i)
        # Pushed back, ball i takes along those behind it; the one ahead is left, and vice versa.
        if direction < 0:
            if leans(system, modes, at):
                modes[at, JOINED] = 0
            while leans(system, modes, (at - 1) % n):
                modes[ball_at(system, at), DIRECTION] = direction
                at = (at - 1) % n
        else:
            if leans(system, modes, (at - 1) % n):
                modes[(at - 1) % n, JOINED] = 0
            while leans(system, modes, at):
                modes[ball_at(system, at), DIRECTION] = direction
                at = (at + 1) % n
        modes[ball_at(system, at), DIRECTION] = direction
    modes[i, DIRECTION] = direction


@numba.njit(**INLINED)
def stop_the_wrong_way(system, state, modes, A1, A2, scratch, changes):  # type: ignore[no-untyped-def]
    """Hold a ball that is at rest and would slide against the direction it was let go in."""
    n = system.balls.shape[0]
    for i in range(n):
        if modes[i, LOADED] == 0 or sticks(system, modes, i) or state[4 + n + i] != 0.0:
            continue
        along = modes[i, DIRECTION] * scratch[i, PATH_ACCELERATION]
        coarse = ROUNDING * (abs(A1) + abs(A2) + abs(scratch[i, PATH_ACCELERATION]))
        if along < -coarse and changes[SLIDE * n + i] < PATIENCE:
            changes[SLIDE * n + i] += 1
            stop(system, state, modes, i)
            return True
    return False


@numba.njit(**INLINED)
def join_approaching(system, state, modes, A1, A2, scratch, changes):  # type: ignore[no-untyped-def]
    """Join two balls that touch at one speed and whose accelerations press them together."""
    n = system.contacts.shape[0]
    for k in range(n):
        if modes[k, JOINED] == 1 or changes[changes.size // 2 + k] == 0:
            continue
        i, j = ball_at(system, k), ball_at(system, (k + 1) % n)
        parts = scratch[j, PATH_ACCELERATION] - scratch[i, PATH_ACCELERATION]
        coarse = ROUNDING * (abs(A1) + abs(A2) + abs(parts))
        if parts < -coarse and changes[TOUCH * n + k] < PATIENCE:
            changes[TOUCH * n + k] += 1
            modes[k, JOINED] = 1
            if has_friction(system.effects) and (
                sticks(system, modes, i) or sticks(system, modes, j)
            ):
                # One is at rest and is pushed by the other: both are, until that is too much.
                stop(system, state, modes, i)
                stop(system, state, modes, j)
            return True
    return False


friction_corrects = only_if(has_friction, stop_the_wrong_way)
contact_corrects = only_if(has_contact, join_approaching)
