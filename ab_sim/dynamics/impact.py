"""Balls that hit each other: velocities jump, positions do not.

With V the velocities (deck, balls along the race, spindle if a motor drives it) and G their mass
matrix, impulses P at the contacts give G dV = (0, .., P_{i-1} - P_i, .., 0): the arrowhead of the
equations of motion once more. Newton's law holds for all contacts that touch at once: the balls
part at least at e times the speed at which they approached, 0 <= P _|_ u+ + e u- >= 0 (Moreau
(1988); Leine and Nijmeijer, ch. 5). Energy lost: -sum_i P_i (s_i' + ds_i' / 2).
"""

import numba

from ab_sim.dynamics.balls import path_acceleration, place_balls, rigid_lever, set_rows
from ab_sim.dynamics.dispatch import APART
from ab_sim.dynamics.planar import accelerations
from ab_sim.dynamics.pools import CLOSED, GRAIN, HOLD, HOP, SHIFT, pool
from ab_sim.dynamics.pools import PULL as POOLED
from ab_sim.dynamics.reactions import pull_at
from ab_sim.dynamics.rows import eliminate, first_open, sign
from ab_sim.dynamics.scratch import COS, INERTIA, LEVER, PATH, PULL, ROW1, ROW2, ROW3, SIN
from ab_sim.dynamics.switches import path_radius, path_speed
from ab_sim.dynamics.system import (
    DIRECTION,
    JOINED,
    MASS,
    ball_at,
    has_friction,
    has_motor,
    restitution,
)

ROUNDING = 1e-14
"""Part of the fastest ball's momentum that may be rounding."""
SLOW_HOP = 3e-8
"""m/s. Balls at rest against each other that an impact elsewhere would part more slowly stay so."""
SLOW_IMPACT = 1e-6
"""m/s. An impact slower than this bounces nothing and parts none: it may come of the distance that
counts as none, which balls fall through between two events, and would go on for ever."""
ROUNDS = 60


@numba.njit(**APART)
def collide(system, w, state, modes, struck, plastic, scratch, pools):  # type: ignore[no-untyped-def]
    """Let the balls at contact ``struck`` collide, and with them all that touch.

    Contacts that stay closed are joined afterwards, others are not; stuck balls come loose where
    something moves them.

    Args:
        system: the System.
        w: spindle speed [rad/s].
        state, modes: as for ``derivatives``; both are changed.
        struck: the contact that has just closed.
        plastic: whether nothing bounces any more.
        scratch: as for ``derivatives``.
        pools: shape (n, POOL_WIDTH), see ``pools``; overwritten.

    Returns:
        Whether impulses that agree with Newton's law at all contacts were found.
    """
    n = system.contacts.shape[0]
    place_balls(system, state, scratch)
    fastest = 0.0
    for i in range(n):
        # An impact is over before friction could act.
        set_rows(system, i, 0.0, scratch)
        if has_friction(system.effects):
            modes[i, DIRECTION] = 1
        scratch[i, PATH] = path_speed(system, state, i)
        fastest = max(fastest, abs(scratch[i, PATH]))
    modes[struck, JOINED] = 1
    f1, f2, torque = bounce(system, fastest, modes, struck, plastic, scratch, pools)
    d1 = d2 = dw = 0.0
    found = False
    for _ in range(ROUNDS):
        eliminate(system, modes, scratch)
        d1, d2, dw = accelerations(system, 0.0, f1, f2, torque, scratch)
        for i in range(n):
            pools[i, POOLED] = pull_at(system, i, d1, d2, dw, scratch)
        if not pool(system, modes, scratch, pools):
            found = True
            break
    for i in range(n):
        speed = path_acceleration(system, i, d1, d2, dw, scratch) + pools[i, SHIFT]
        scratch[i, PULL] = speed - scratch[i, PATH]
    jump(system, w, state, d1, d2, dw, scratch)
    begin = first_open(system, pools, CLOSED)
    for step in range(n):
        k = (begin + step) % n
        i, j = ball_at(system, k), ball_at(system, (k + 1) % n)
        if pools[i, SHIFT] != pools[j, SHIFT]:
            modes[k, JOINED] = 0
        if modes[k, JOINED] == 1:
            # Exactly one speed, so that no rounding pulls a row apart.
            radius = path_radius(system, state, i) / path_radius(system, state, j)
            state[4 + n + j] = state[4 + n + i] * radius
    if has_friction(system.effects):
        for i in range(n):
            modes[i, DIRECTION] = sign(state[4 + n + i])
    return found


@numba.njit(**APART)
def bounce(system, fastest, modes, struck, plastic, scratch, pools):  # type: ignore[no-untyped-def]
    """The balls' equations for their speeds after an impact, less what they bounce (SHIFT).

    So shifted, u+ + e u- >= 0 says that speeds do not fall along the row, as for accelerations.

    Returns:
        Momentum [N s] and angular momentum [N m s] that these speeds are short of.
    """
    n = system.contacts.shape[0]
    hit = scratch[ball_at(system, struck), PATH] - scratch[ball_at(system, (struck + 1) % n), PATH]
    for k in range(n):
        pools[k, CLOSED] = modes[k, JOINED]
        pools[k, HOP] = hit if 0.0 < hit <= SLOW_IMPACT else SLOW_HOP
    pools[struck, HOP] = 0.0
    begin = first_open(system, pools, CLOSED)
    shift = f1 = f2 = torque = 0.0
    for step in range(n):
        k = (begin + step) % n
        i, j = ball_at(system, k), ball_at(system, (k + 1) % n)
        path, m = scratch[i, PATH] - shift, system.balls[i, MASS]
        scratch[i, PULL] = scratch[i, INERTIA] * path
        f1 -= m * scratch[i, SIN] * path
        f2 += m * scratch[i, COS] * path
        torque += scratch[i, LEVER] * path
        pools[i, SHIFT] = shift
        pools[i, HOLD] = -1.0
        pools[i, GRAIN] = ROUNDING * scratch[i, INERTIA] * fastest
        approach = scratch[i, PATH] - scratch[j, PATH]
        if pools[k, CLOSED] == 0.0:
            shift = 0.0
        elif approach > SLOW_IMPACT and not plastic:
            shift += restitution(system.effects, approach) * approach
    return f1, f2, torque


@numba.njit(**APART)
def jump(system, w, state, d1, d2, dw, scratch):  # type: ignore[no-untyped-def]
    """Add the jumps of velocity to the state: of ball i's path speed, what PULL holds."""
    n = system.balls.shape[0]
    turned = system.body.unbalance * d2
    lost = 0.0
    for i in range(n):
        gain = scratch[i, PULL]
        impulse = scratch[i, INERTIA] * gain - scratch[i, ROW1] * d1 - scratch[i, ROW2] * d2
        if has_motor(system.effects):
            impulse -= scratch[i, ROW3] * dw
        lost -= impulse * (path_speed(system, state, i) + 0.5 * gain)
        r1, r2 = rigid_lever(system, i, scratch)
        turned += r1 * d1 + r2 * d2 + scratch[i, LEVER] * gain
        state[4 + n + i] += gain / path_radius(system, state, i)
    state[2] += d1
    state[3] += d2
    if has_motor(system.effects):
        state[5 + 2 * n] += dw
    if len(system.ledger):
        # A prescribed speed is kept by the motor, which does work on the impact.
        if not has_motor(system.effects):
            state[state.size - 2] += w * turned
        state[state.size - 1] += lost
