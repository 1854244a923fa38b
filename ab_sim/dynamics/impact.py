"""Balls that hit each other: velocities jump, positions do not.

With V the velocities (deck, balls along the race, spindle if a motor drives it) and G their mass
matrix, an impulse P between two balls gives G dV = (0, .., -P, +P, .., 0): the arrowhead of the
equations of motion once more. Sequential impacts with restitution first; what then still
approaches, too slowly to bounce, goes on as a row. Energy lost: -sum_i P_i (s_i' + ds_i' / 2).
"""

import numba

from ab_sim.dynamics.balls import path_acceleration, place_balls, rigid_lever, set_rows
from ab_sim.dynamics.dispatch import APART
from ab_sim.dynamics.planar import accelerations
from ab_sim.dynamics.rows import eliminate, sign
from ab_sim.dynamics.scratch import (
    COS,
    GAIN0,
    GAIN1,
    GAIN2,
    GAIN3,
    INERTIA,
    LEVER,
    PATH,
    PULL,
    ROW1,
    ROW2,
    ROW3,
    SIN,
)
from ab_sim.dynamics.switches import parting_speed, path_radius, path_speed
from ab_sim.dynamics.system import (
    DIRECTION,
    JOINED,
    MASS,
    ball_at,
    has_friction,
    has_motor,
    restitution,
)


@numba.njit(**APART)
def collide(system, w, state, modes, struck, plastic, scratch):  # type: ignore[no-untyped-def]
    """Let the balls at contact ``struck`` collide, and all that touch them in turn.

    Contacts that stay closed are joined afterwards, others are not; stuck balls come loose.

    Args:
        system: the System.
        w: spindle speed [rad/s].
        state, modes: as for ``derivatives``; both are changed.
        struck: the contact that has just closed.
        plastic: whether nothing bounces any more.
        scratch: as for ``derivatives``.
    """
    n = system.contacts.shape[0]
    free_all(system, state, modes, scratch)
    speed = 0.0
    for i in range(n):
        speed = max(speed, abs(scratch[i, PATH]))
    tiny = 1e-14 * speed
    # A bounce too low to be told from rounding has ended before it began.
    rests = parting_speed(system, state, struck) > tiny
    # Bounces pass through a long row many times; what is left after this many is slow.
    for _ in range(20 * n + 20):
        k = fastest_approach(system, state, modes, struck)
        approach = -parting_speed(system, state, k)
        bounce = 0.0 if plastic else restitution(system.effects, approach)
        if bounce == 0.0 or approach <= tiny:
            break
        bounce_apart(system, w, state, k, (1.0 + bounce) * approach, scratch)
    for k in range(n):
        touches = modes[k, JOINED] == 1 or k == struck
        closes = parting_speed(system, state, k) <= tiny or (rests and k == struck)
        modes[k, JOINED] = 1 if touches and closes else 0
    # No more than n - 1 contacts can be closed.
    move_as_rows(system, w, state, modes, scratch)
    if has_friction(system.effects):
        for i in range(n):
            modes[i, DIRECTION] = sign(state[4 + n + i])


@numba.njit(**APART)
def free_all(system, state, modes, scratch):  # type: ignore[no-untyped-def]
    """Take friction out of the balls' equations: an impact is over before it could act."""
    place_balls(system, state, scratch)
    for i in range(system.balls.shape[0]):
        scratch[i, PATH] = path_speed(system, state, i)
        set_rows(system, i, 0.0, scratch)
        if has_friction(system.effects) and modes[i, DIRECTION] == 0:
            modes[i, DIRECTION] = 1


@numba.njit(**APART)
def fastest_approach(system, state, modes, struck):  # type: ignore[no-untyped-def]
    """The closed contact whose balls approach each other fastest."""
    found = struck
    for k in range(system.contacts.shape[0]):
        # Bounced ones are still closed: they may be hit again from the other side.
        if modes[k, JOINED] == 1 and parting_speed(system, state, k) < parting_speed(
            system, state, found
        ):
            found = k
    return found


@numba.njit(**APART)
def bounce_apart(system, w, state, k, change, scratch):  # type: ignore[no-untyped-def]
    """Change the speed at which the balls at contact k part by ``change`` [m/s]."""
    n = system.contacts.shape[0]
    i, j = ball_at(system, k), ball_at(system, (k + 1) % n)
    for b in range(n):
        push = 1.0 if b == j else (-1.0 if b == i else 0.0)
        mobility = 1.0 / scratch[b, INERTIA]
        scratch[b, GAIN0] = push * mobility
        scratch[b, GAIN1] = scratch[b, ROW1] * mobility
        scratch[b, GAIN2] = scratch[b, ROW2] * mobility
        scratch[b, GAIN3] = scratch[b, ROW3] * mobility
    d1, d2, dw = accelerations(system, 0.0, 0.0, 0.0, 0.0, scratch)
    parts = path_acceleration(system, j, d1, d2, dw, scratch) - path_acceleration(
        system, i, d1, d2, dw, scratch
    )
    impulse = change / parts
    for b in range(n):
        scratch[b, PULL] = impulse * path_acceleration(system, b, d1, d2, dw, scratch)
    jump(system, w, state, impulse * d1, impulse * d2, impulse * dw, scratch)


@numba.njit(**APART)
def move_as_rows(system, w, state, modes, scratch):  # type: ignore[no-untyped-def]
    """Give the balls of each row one path speed; momentum is kept."""
    n = system.contacts.shape[0]
    closed = False
    for k in range(n):
        closed = closed or modes[k, JOINED] == 1
    if not closed:
        return
    f1 = f2 = torque = 0.0
    for i in range(n):
        m, path = system.balls[i, MASS], path_speed(system, state, i)
        scratch[i, PATH] = path
        scratch[i, PULL] = scratch[i, INERTIA] * path
        f1 -= m * scratch[i, SIN] * path
        f2 += m * scratch[i, COS] * path
        torque += scratch[i, LEVER] * path
    eliminate(system, modes, scratch)
    d1, d2, dw = accelerations(system, 0.0, f1, f2, torque, scratch)
    for i in range(n):
        scratch[i, PULL] = path_acceleration(system, i, d1, d2, dw, scratch) - scratch[i, PATH]
    jump(system, w, state, d1, d2, dw, scratch)
    # Exactly one speed, so that no rounding pulls a row apart.
    for place in range(2 * n):
        k = place % n
        if modes[k, JOINED] == 1:
            i, j = ball_at(system, k), ball_at(system, (k + 1) % n)
            radius = path_radius(system, state, i) / path_radius(system, state, j)
            state[4 + n + j] = state[4 + n + i] * radius


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
