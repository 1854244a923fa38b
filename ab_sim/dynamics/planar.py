"""The planar model in the corotating frame: EQUATIONS.md section 1, for any number of balls.

State, a flat array: u1, u2, v1, v2, theta_0 .. theta_n-1, theta_0' .. theta_n-1', and, only if
the system keeps a ledger, the motor's work and the energy dissipated so far.

    u' = v - w J u                  v' = A - w J v
    M A = f + M0 e (w^2, -al) + sum_i m R [ p_i^2 r_i - q_i t_i ]
    mu_i R q_i + m A.t_i = F_i - f_i N_i,     N_i = m (R p_i^2 - A.r_i)

with q_i = al + theta_i'', mu_i = m + I/a^2, f the effects' force on the deck, F_i theirs on ball
i and f_i their coefficient of friction, signed against theta_i'. Each ball is eliminated, which
leaves two equations for A: O(n), no linear-algebra library (the arrowhead of EQUATIONS.md).
"""

from math import cos, sin
from typing import Any, NamedTuple

import numba
import numpy as np

from ab_sim.dynamics.dispatch import COMPILED, forward, sum_over_effects
from ab_sim.dynamics.ledger import book, has_friction
from ab_sim.dynamics.motion import Ball, BallMotion, Body, Deck
from ab_sim.dynamics.scratch import ACCELERATION, COS, FORCE, FRICTION, INERTIA, LOAD, SIN

deck_force = sum_over_effects("deck_force", (0.0, 0.0))
ball_inertia = sum_over_effects("ball_inertia", 0.0)
ball_force = sum_over_effects("ball_force", 0.0)
friction_coefficient = sum_over_effects("friction_coefficient", 0.0)
felt_acceleration = sum_over_effects("spindle_acceleration", 0.0)
segment_speed = forward("speed")
segment_acceleration = forward("acceleration")


class System(NamedTuple):
    """What a kernel is compiled for (its types) and runs with (its values)."""

    body: Body
    ball_masses: np.ndarray
    """m_i [kg], shape (n,)."""
    ball_radii: np.ndarray
    """a_i [m], shape (n,)."""
    effects: tuple[Any, ...]
    ledger: tuple[Any, ...]
    """(Ledger(),) to keep one, else empty."""


@numba.njit(**COMPILED)
def derivatives(system, segment, time, state, slope, scratch):  # type: ignore[no-untyped-def]
    """Time derivative of the state.

    Args:
        system: the System.
        segment: spindle-speed segment in force.
        time: local time in the segment [s].
        state: the state, see the module.
        slope: where its derivative goes, same shape.
        scratch: shape (n, WIDTH), see scratch.py, overwritten.
    """
    body, effects = system.body, system.effects
    n = system.ball_masses.size
    w = segment_speed(segment, time)
    al = felt_acceleration(effects, segment_acceleration(segment, time))
    deck = Deck(state[0], state[1], state[2], state[3], w, al)
    R = body.race_radius

    f1, f2 = deck_force(effects, body, deck)
    f1 += body.unbalance * w * w
    f2 -= body.unbalance * al

    for i in range(n):
        ball = Ball(system.ball_masses[i], system.ball_radii[i])
        theta, rate = state[4 + i], state[4 + n + i]
        c, s, p = cos(theta), sin(theta), w + rate
        motion = BallMotion(c, s, rate, p)
        scratch[i, COS] = c
        scratch[i, SIN] = s
        scratch[i, LOAD] = ball.mass * R * p * p
        scratch[i, FORCE] = ball_force(effects, body, ball, motion, deck)
        scratch[i, INERTIA] = ball.mass + ball_inertia(effects, ball)
        if has_friction(effects):
            scratch[i, FRICTION] = np.sign(rate) * friction_coefficient(effects, ball)
        f1 += scratch[i, LOAD] * c
        f2 += scratch[i, LOAD] * s

    A1, A2 = deck_acceleration(system, f1, f2, scratch)
    if has_friction(effects):
        # The race cannot pull: drop friction where the normal force would be negative, and solve
        # again. Each round drops at least one ball's, so n rounds are enough.
        for _ in range(n):
            if not drop_unloaded(system, A1, A2, scratch):
                break
            A1, A2 = deck_acceleration(system, f1, f2, scratch)

    slope[0] = deck.v1 + w * deck.u2
    slope[1] = deck.v2 - w * deck.u1
    slope[2] = A1 + w * deck.v2
    slope[3] = A2 - w * deck.v1
    for i in range(n):
        m, c, s = system.ball_masses[i], scratch[i, COS], scratch[i, SIN]
        force = scratch[i, FORCE] - m * (A2 * c - A1 * s)
        if has_friction(effects):
            normal = scratch[i, LOAD] - m * (A1 * c + A2 * s)
            force -= scratch[i, FRICTION] * normal
        q = force / (scratch[i, INERTIA] * R)
        scratch[i, ACCELERATION] = q
        slope[4 + i] = state[4 + n + i]
        slope[4 + n + i] = q - al
    book(system.ledger, system, deck, A1, A2, state, slope, scratch)


@numba.njit(**COMPILED)
def deck_acceleration(system, f1, f2, scratch):  # type: ignore[no-untyped-def]
    """A [m/s^2] on the rotating axes, the balls' accelerations eliminated.

    D A = b with D = M 1 + sum_i (m/mu) t_i (m f_i r_i - m t_i)^T: symmetric but for friction.
    """
    d11 = d22 = system.body.total_mass
    d12 = d21 = 0.0
    for i in range(system.ball_masses.size):
        m, c, s = system.ball_masses[i], scratch[i, COS], scratch[i, SIN]
        share = m / scratch[i, INERTIA]
        drive = share * scratch[i, FORCE]
        g1, g2 = share * m * s, -share * m * c
        if has_friction(system.effects):
            friction = scratch[i, FRICTION]
            drive -= share * friction * scratch[i, LOAD]
            g1 += share * m * friction * c
            g2 += share * m * friction * s
        f1 += drive * s
        f2 -= drive * c
        d11 -= s * g1
        d12 -= s * g2
        d21 += c * g1
        d22 += c * g2
    determinant = d11 * d22 - d12 * d21
    return (f1 * d22 - f2 * d12) / determinant, (f2 * d11 - f1 * d21) / determinant


@numba.njit(**COMPILED)
def drop_unloaded(system, A1, A2, scratch):  # type: ignore[no-untyped-def]
    """Take the friction off balls whose normal force is negative; whether there was one."""
    dropped = False
    for i in range(system.ball_masses.size):
        pull = system.ball_masses[i] * (A1 * scratch[i, COS] + A2 * scratch[i, SIN])
        if scratch[i, FRICTION] != 0.0 and scratch[i, LOAD] < pull:
            scratch[i, FRICTION] = 0.0
            dropped = True
    return dropped


@numba.njit(**COMPILED)
def deck_acceleration_of(segment, time, state, slope):  # type: ignore[no-untyped-def]
    """A [m/s^2] on the rotating axes, read back from the state's derivative: A = v' + w J v."""
    w = segment_speed(segment, time)
    return slope[2] - w * state[3], slope[3] + w * state[2]
