"""Balls that hit each other: velocities jump, positions do not.

With V the velocities (of what carries the balls, of the balls along the race) and G their mass
matrix, impulses P at the contacts give G dV = (0, .., P_{i-1} - P_i, .., 0): the arrowhead of the
equations of motion once more. Newton's law holds for all contacts that touch at once: the balls
part at least at e times the speed at which they approached, 0 <= P _|_ u+ + e u- >= 0 (Moreau
(1988); Leine and Nijmeijer, ch. 5). Energy lost: -sum_i P_i (s_i' + ds_i' / 2).
"""

from typing import Any

from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import APART, holds, number_of
from ab_sim.dynamics.race.calls import kick, restitution
from ab_sim.dynamics.race.elimination import eliminate, first_open, sign, solve
from ab_sim.dynamics.race.margins import SPEED
from ab_sim.dynamics.race.pools import CLOSED, COARSE, HOLD, HOP, SHIFT, pool
from ab_sim.dynamics.race.pools import PULL as POOLED
from ab_sim.dynamics.race.race import Race, around, ball_at, path_speed
from ab_sim.dynamics.race.reactions import pull_at
from ab_sim.dynamics.race.table import (
    CURVE,
    FRICTION,
    INERTIA,
    PATH,
    PATH_ACCELERATION,
    PULL,
    REACH,
)
from ab_sim.dynamics.system import DIRECTION, JOINED

ROUNDING = 1e-14
"""Part of the fastest ball's momentum that may be rounding."""
SLOW_HOP = 3e-8
"""m/s. Balls at rest against each other that an impact elsewhere would part more slowly stay so."""
SLOW_IMPACT = 1e-6
"""m/s. An impact slower than this bounces nothing and parts none: it may come of the distance that
counts as none, which balls fall through between two events, and would go on for ever."""
ROUNDS = 60


@register_jitable(**APART)
def collide(calls: Any, race: Race, work: Any, state: Any, struck: int, plastic: bool) -> bool:
    """Let the balls at contact ``struck`` collide, and with them all that touch.

    Contacts that stay closed are joined afterwards, others are not; stuck balls come loose where
    something moves them. The table holds what the last evaluation found, at the state's angles.

    Args:
        calls: what the scene does, see ``calls``.
        race: the balls; their modes and room are changed.
        work: a Workspace; its pools are overwritten.
        state: changed.
        struck: the contact that has just closed.
        plastic: whether nothing bounces any more.

    Returns:
        Whether impulses that agree with Newton's law at all contacts were found.
    """
    n, table, modes, pools = number_of(race.number), race.room.table, race.modes, work.pools
    x, first = race.room.acceleration, race.first_rate
    fastest = 0.0
    for i in range(n):
        # An impact is over before friction could act.
        table[i, FRICTION] = 0.0
        if holds(race.rubs):
            modes[i, DIRECTION] = 1
        table[i, PATH] = path_speed(race, state, i)
        fastest = max(fastest, abs(table[i, PATH]))
    modes[struck, JOINED] = 1
    if not holds(race.driven):
        x[number_of(race.all) - 1] = 0.0
    bounce(calls, race, work, fastest, struck, plastic)
    found = False
    for _ in range(ROUNDS):
        eliminate(race)
        solve(race)
        for i in range(n):
            pools[i, POOLED] = pull_at(race, i, x)
        if not pool(race, pools):
            found = True
            break
    for i in range(n):
        table[i, PULL] = table[i, PATH_ACCELERATION] + pools[i, SHIFT] - table[i, PATH]
    jump(calls, race, state)
    begin = first_open(race, pools, CLOSED)
    for step in range(n):
        k = around(race, begin + step)
        i, j = ball_at(race, k), ball_at(race, around(race, k + 1))
        if pools[i, SHIFT] != pools[j, SHIFT]:
            modes[k, JOINED] = 0
        if modes[k, JOINED] == 1:
            # Exactly one speed, so that no rounding pulls a row apart.
            state[first + j] = state[first + i] * (table[i, CURVE] / table[j, CURVE])
    if holds(race.rubs):
        for i in range(n):
            modes[i, DIRECTION] = sign(state[first + i])
    return found


@register_jitable(**APART)
def bounce(calls: Any, race: Race, work: Any, fastest: float, struck: int, plastic: bool) -> None:
    """The equations for the speeds after an impact, less what the balls bounce (SHIFT).

    So shifted, u+ + e u- >= 0 says that speeds do not fall along the row, as for accelerations.
    What carries the balls has the momentum that these speeds are short of.
    """
    n, table, block, pools = number_of(race.number), race.room.table, race.room.block, work.pools
    hit = table[ball_at(race, struck), PATH] - table[ball_at(race, around(race, struck + 1)), PATH]
    for k in range(n):
        pools[k, CLOSED] = race.modes[k, JOINED]
        pools[k, HOP] = hit if 0.0 < hit <= SLOW_IMPACT else SLOW_HOP
    pools[struck, HOP] = 0.0
    for r in range(number_of(race.free)):
        block[r, number_of(race.all)] = 0.0
    begin = first_open(race, pools, CLOSED)
    shift = 0.0
    for step in range(n):
        k = around(race, begin + step)
        i, j = ball_at(race, k), ball_at(race, around(race, k + 1))
        path = table[i, PATH] - shift
        table[i, PULL] = table[i, INERTIA] * path
        for r in range(number_of(race.free)):
            block[r, number_of(race.all)] -= table[i, REACH + r] * path
        pools[i, SHIFT] = shift
        pools[i, HOLD] = -1.0
        pools[i, COARSE] = ROUNDING * table[i, INERTIA] * fastest
        approach = table[i, PATH] - table[j, PATH]
        if pools[k, CLOSED] == 0.0:
            shift = 0.0
        elif approach > SLOW_IMPACT and not plastic:
            shift += restitution(calls, approach) * approach


@register_jitable(**APART)
def jump(calls: Any, race: Race, state: Any) -> None:
    """Add the jumps of velocity to the state: of ball i's path speed, what PULL holds."""
    table, x, spindle = race.room.table, race.room.acceleration, number_of(race.all) - 1
    turned = lost = 0.0
    for r in range(number_of(race.all)):
        turned += race.room.block[r, spindle] * x[r]
    for i in range(number_of(race.number)):
        gain = table[i, PULL]
        impulse = table[i, INERTIA] * gain
        for r in range(number_of(race.all)):
            impulse -= table[i, REACH + r] * x[r]
        lost -= impulse * (path_speed(race, state, i) + 0.5 * gain)
        turned -= table[i, REACH + spindle] * gain
        state[race.first_rate + i] += gain / table[i, CURVE]
    kick(calls, state, x)
    if holds(race.driven):
        state[race.spindle + 1] += x[spindle]
    if holds(race.booked):
        # A prescribed speed is kept by the motor, which does work on the impact.
        if not holds(race.driven):
            state[state.size - 2] += race.room.motor[SPEED] * turned
        state[state.size - 1] += lost
