"""What happens at an event: a law takes another branch, and the others follow.

At one instant several balls may come to rest, let go, meet or part; which do depends on all of
them through the deck. All of them are decided at once, as the complementarity problem that
set-valued laws pose (Leine and Nijmeijer, ch. 5). Given the accelerations x of what carries the
balls, each row is one of its own and solved exactly (``pools``); the branches found give x anew,
from the equations of motion. That is Newton's method for K piecewise linear equations, which ends,
at the exact solution, as soon as no branch changes.
"""

from typing import Any

from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import APART, holds, number_of
from ab_sim.dynamics.race.calls import evaluate
from ab_sim.dynamics.race.elimination import moves_along, sign
from ab_sim.dynamics.race.impact import collide
from ab_sim.dynamics.race.margins import (
    MOTOR,
    RATE_ROUNDING,
    SLIDE,
    TOUCH,
    capacity,
    force_rounding,
    margins,
    motor_margins,
)
from ab_sim.dynamics.race.pools import CLOSED, COARSE, HOLD, HOP, LEVEL, PULL, pool
from ab_sim.dynamics.race.race import Race, around, ball_at, gap
from ab_sim.dynamics.race.reactions import normal_forces, pull_at, rubbed_pull_at
from ab_sim.dynamics.race.table import ALONG, CURVE, FORCE
from ab_sim.dynamics.system import DIRECTION, JOINED, LOADED

DIRECT = 8
"""Rounds of Newton's method; after so many, half-way between the last two is tried as well."""
ROUNDS = 60
STILL = 4.0 * RATE_ROUNDING
"""rad/s. Balls that roll side by side come to rest together, though rounding tells them apart: a
rate as small as at the end of sliding is that of a ball at rest."""


@register_jitable(**APART)
def settle(
    calls: Any, race: Race, work: Any, time: float, state: Any, slot: int, plastic: bool
) -> None:
    """Change the branch of ``slot`` (-1: none), then all that this makes wrong.

    The table holds what the last evaluation found, at the state's angles.

    Args:
        calls: what the scene does, see ``calls``.
        race: the balls; their modes are changed.
        work: a Workspace; slopes[0], room and margins hold what the equations say at the end.
            Counts an instant for which no branches are found.
        time: local time in the speed segment [s].
        state: changed.
        slot: the margin that has reached zero, or -1.
        plastic: whether balls that meet no longer bounce.
    """
    n, modes, x = number_of(race.number), race.modes, race.room.acceleration
    if 0 <= slot < MOTOR * n:
        kind, i = slot // n, slot % n
        if kind == TOUCH and modes[i, JOINED] == 0:
            if not collide(calls, race, work, state, i, plastic):
                work.counts[1] += 1
        if holds(race.rubs):
            stopped = i if kind == SLIDE and modes[i, DIRECTION] != 0 else -1
            come_to_rest(race, state, stopped)
        if holds(race.meets):
            close_gaps(race, state)
    if holds(race.meets):
        # Which balls touch at this instant, whatever becomes of them.
        for k in range(n):
            work.pools[k, CLOSED] = modes[k, JOINED]
            work.pools[k, HOP] = 0.0
    found = False
    before = work.between
    for count in range(ROUNDS):
        evaluate(calls, time, state, work.slopes[0])
        if not branches(race, work, state, x):
            found = True
            break
        for r in range(number_of(race.all)):
            before[r] = x[r] if count < DIRECT else 0.5 * (x[r] + before[r])
        if count >= DIRECT:
            branches(race, work, state, before)
    if not found:
        work.counts[1] += 1
        evaluate(calls, time, state, work.slopes[0])
    margins(race, state, work.slopes[0], work.margin, work.rounding, work.rate)


@register_jitable(**APART)
def come_to_rest(race: Race, state: Any, stopped: int) -> None:
    """Bring to rest the ball that has ``stopped`` (-1: none), others as slow as it, their rows."""
    first = race.first_rate
    still = STILL if stopped < 0 else max(STILL, abs(state[first + stopped]))
    for i in range(number_of(race.number)):
        if 0.0 < abs(state[first + i]) <= still:
            state[first + i] = 0.0
            if holds(race.meets):
                stop_row(race, state, i)


@register_jitable(**APART)
def stop_row(race: Race, state: Any, i: int) -> None:
    """Bring those in a row with ball i to rest."""
    n = number_of(race.number)
    ahead = 0
    for k in range(n):
        if ball_at(race, k) == i:
            ahead = k
    behind = ahead
    while moves_along(race, ahead):
        ahead = around(race, ahead + 1)
    while moves_along(race, around(race, behind - 1)):
        behind = around(race, behind - 1)
    for step in range(around(race, ahead - behind) + 1):
        state[race.first_rate + ball_at(race, around(race, behind + step))] = 0.0


@register_jitable(**APART)
def close_gaps(race: Race, state: Any) -> None:
    """Take out what rounding and truncation have done to balls in contact, and any overlap."""
    n, table = number_of(race.number), race.room.table
    begin, widest = 0, 0.0
    for k in range(n):
        room = gap(race, k)
        if room > widest:
            begin, widest = around(race, k + 1), room
    for step in range(n - 1):
        k = around(race, begin + step)
        moved = gap(race, k)
        if race.modes[k, JOINED] == 1 or moved < 0.0:
            j = ball_at(race, around(race, k + 1))
            state[race.first_angle + j] -= moved / table[j, CURVE]
            table[j, ALONG] -= moved


@register_jitable(**APART)
def branches(race: Race, work: Any, state: Any, x: Any) -> bool:
    """The branches that hold just after an instant if x are the accelerations there.

    Right after an evaluation. Returns whether any was not in force.
    """
    changed = False
    n, table, pools, modes = number_of(race.number), race.room.table, work.pools, race.modes
    first = race.first_rate
    if holds(race.rubs):
        normal_forces(race, x)
    for i in range(n):
        pools[i, COARSE] = force_rounding(race, i, x, rubbed_pull_at(race, i, x))
        pools[i, HOLD] = -1.0
        pull = pull_at(race, i, x)
        if holds(race.rubs):
            force = table[i, FORCE]
            slack = -pools[i, COARSE] if modes[i, LOADED] == 1 else pools[i, COARSE]
            loaded = 1 if force > slack or (force == 0.0 and modes[i, LOADED] == 1) else 0
            changed = changed or modes[i, LOADED] != loaded
            modes[i, LOADED] = loaded
            if state[first + i] == 0.0:
                pools[i, HOLD] = capacity(race, i)
            elif loaded == 1:
                pull -= sign(state[first + i]) * capacity(race, i)
        pools[i, PULL] = pull
    changed = pool(race, pools) or changed
    if holds(race.rubs):
        for i in range(n):
            rate = state[first + i]
            direction = sign(pools[i, LEVEL] if rate == 0.0 else rate)
            changed = changed or modes[i, DIRECTION] != direction
            modes[i, DIRECTION] = direction
    if holds(race.driven):
        changed = motor_branch(race, work) or changed
    return changed


@register_jitable(**APART)
def motor_branch(race: Race, work: Any) -> bool:
    """Whether the motor begins or ceases to give all it can."""
    n, margin, rounding = number_of(race.number), work.margin, work.rounding
    motor_margins(race, margin, rounding)
    before = race.modes[n, DIRECTION]
    if margin[MOTOR * n] < -rounding[MOTOR * n]:
        race.modes[n, DIRECTION] = -1 if before == 0 else 0
    elif before == 0 and margin[MOTOR * n + 1] < -rounding[MOTOR * n + 1]:
        race.modes[n, DIRECTION] = 1
    return bool(race.modes[n, DIRECTION] != before)
