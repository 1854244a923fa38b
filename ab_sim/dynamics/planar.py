"""The planar model in the corotating frame: EQUATIONS.md section 1, for any number of balls.

State, a flat array: u1, u2, v1, v2, theta_0 .. theta_n-1, theta_0' .. theta_n-1'; with a motor
psi, w and the speed loop's integral; with a ledger the motor's work and the energy dissipated.

A is the deck's *specific force* on the rotating axes: its acceleration less gravity, what an
accelerometer on it reads. The race is given by its outward normal n_i = (cos theta_i, sin theta_i)
and tangent t_i at ball i, the ball's centre lies at h n_i + x t_i from the shaft, l is the race's
radius of curvature there, s' = l theta_i' and g = s'' are path speed and acceleration. Newton, and
the balls' spins, then say (a round race on the shaft axis has h = l = R and x = 0)

    u' = v - w J u                  v' = A + gravity - w J v
    M A = f + M0 e (w^2, -al) + sum_i m [ (h w^2 + 2 w s' + l theta_i'^2 + x al) n_i
                                          + (x w^2 - h al - g) t_i ]
    mu g = F - f_i N - m A.t_i - (h m - (I/a^2) a) al + m x w^2,    mu = m + I/a^2
    N = m (h w^2 + 2 w s' + l theta_i'^2 + x al - A.n_i)

with f the suspension's force, F the effects' force along the race, N the race's normal force, and
f_i the coefficient of friction, signed as theta_i'. With a motor al is unknown as well and

    (I_r + M0 e^2) al + M0 e A2 + sum_i [ (m r x ball's specific force)_i + (I/a) (a al - g) ] = T.

Each ball, or each row of balls in contact, is eliminated, which leaves two or three equations:
O(n), no linear-algebra library (the arrowhead of EQUATIONS.md).
"""

import numba

from ab_sim.dynamics.balls import (
    curvature_at,
    curve_at,
    path_acceleration,
    place_ball,
    place_from_shaft,
    rigid_lever,
    rotor_inertia,
    set_rows,
    sliding_friction,
)
from ab_sim.dynamics.dispatch import APART, INLINED, chosen_by
from ab_sim.dynamics.ledger import book
from ab_sim.dynamics.motion import Ball, Deck, Spindle
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.numbers.multiply_add import multiply_add
from ab_sim.dynamics.rows import eliminate_ball, eliminate_rows
from ab_sim.dynamics.scratch import (
    BEND,
    COS,
    GAIN0,
    GAIN1,
    GAIN2,
    GAIN3,
    LEVER,
    LOAD,
    PATH,
    PATH_ACCELERATION,
    PULL,
    ROW3,
    SIN,
)
from ab_sim.dynamics.system import (
    DIRECTION,
    MASS,
    MOMENT,
    RADIUS,
    back_torque,
    ball_count,
    ball_drag,
    deck_force,
    felt_acceleration,
    gravity,
    has_contact,
    has_drag,
    has_friction,
    has_gravity,
    has_motor,
    has_runout,
    has_space_force,
    has_spindle_angle,
    integral_rate,
    loop_torque,
    segment_acceleration,
    segment_angle,
    segment_speed,
    space_force,
    torque_limit,
)


@numba.njit(**APART)
def derivatives(system, place, time, state, modes, slope, scratch):  # type: ignore[no-untyped-def]
    """Time derivative of the state.

    Args:
        system: the System.
        place: Place along the speed profile.
        time: local time in its segment [s].
        state: the state, see the module.
        modes: the branches in force.
        slope: where the state's derivative goes, same shape.
        scratch: shape (n, WIDTH), see scratch.py, overwritten.

    Returns:
        A1, A2 [m/s^2], the deck's specific force, and al [rad/s^2], the spindle's acceleration.
    """
    effects = system.effects
    n = ball_count(system)
    spindle = spindle_motion(system, place, time, state, modes)
    w = spindle.speed
    u1, u2, v1, v2 = state[0], state[1], state[2], state[3]

    f1, f2 = suspension_force(system, state, spindle)
    p1, p2, torque = load_balls(system, spindle, state, modes, scratch)
    eliminate_rows(system, modes, scratch)
    A1, A2, al = accelerations(system, spindle.acceleration, f1 + p1, f2 + p2, torque, scratch)

    slope[0] = v1 + w * u2
    slope[1] = v2 - w * u1
    slope[2] = A1 + w * v2
    slope[3] = A2 - w * v1
    if has_gravity(effects):
        g1, g2 = gravity_on_rotating_axes(system, spindle)
        slope[2] += g1
        slope[3] += g2
    move_balls(system, A1, A2, al, state, slope, scratch)
    if has_motor(effects):
        slope[4 + 2 * n] = w
        slope[5 + 2 * n] = al
        slope[6 + 2 * n] = spindle.integral_rate
    book(system.ledger, system, spindle, A1, A2, al, state, modes, slope, scratch)
    return A1, A2, al


def _prescribed(system, place, time, state, modes):  # type: ignore[no-untyped-def]
    speed = segment_speed(place.segment, time)
    acceleration = felt_acceleration(system.effects, segment_acceleration(place.segment, time))
    c, s = 1.0, 0.0
    if has_spindle_angle(system.effects):
        c, s = cos_sin(place.phase + segment_angle(place.segment, time))
    return Spindle(speed, acceleration, c, s, 0.0, 0.0)


def _driven(system, place, time, state, modes):  # type: ignore[no-untyped-def]
    effects = system.effects
    n = ball_count(system)
    psi, speed, integral = state[4 + 2 * n], state[5 + 2 * n], state[6 + 2 * n]
    error = segment_speed(place.segment, time) - speed
    asked = given = loop_torque(effects, error, integral)
    if modes[n, DIRECTION] != 0:
        given = modes[n, DIRECTION] * torque_limit(effects)
    rate = integral_rate(effects, error, asked - given)
    torque = given - back_torque(effects, speed)
    c, s = 1.0, 0.0
    if has_spindle_angle(effects):
        c, s = cos_sin(psi)
    return Spindle(speed, 0.0, c, s, torque, rate)


spindle_motion = chosen_by(has_motor, _driven, _prescribed)
"""The Spindle at a state; ``(system, place, time, state, modes)``."""


@numba.njit(**INLINED)
def gravity_on_rotating_axes(system, spindle):  # type: ignore[no-untyped-def]
    """Gravity across the shaft [m/s^2], (0, 0) without the effect."""
    if has_gravity(system.effects):
        gx, gy = gravity(system.effects)
        c, s = spindle.cos, spindle.sin
        return c * gx + s * gy, c * gy - s * gx
    return 0.0, 0.0


@numba.njit(**INLINED)
def suspension_force(system, state, spindle):  # type: ignore[no-untyped-def]
    """Force of the suspension on the deck, on the rotating axes [N]."""
    body, effects = system.body, system.effects
    u1, u2, v1, v2 = state[0], state[1], state[2], state[3]
    c, s = spindle.cos, spindle.sin
    if has_gravity(effects):
        # The state counts from where the deck hangs at rest, the springs from their free length.
        u1 += c * body.sag_x + s * body.sag_y
        u2 += c * body.sag_y - s * body.sag_x
    f1, f2 = deck_force(effects, Deck(u1, u2, v1, v2))
    if has_space_force(effects):
        fixed = Deck(c * u1 - s * u2, s * u1 + c * u2, c * v1 - s * v2, s * v1 + c * v2)
        fx, fy = space_force(effects, fixed)
        f1 += c * fx + s * fy
        f2 += c * fy - s * fx
    return f1, f2


@numba.njit(**INLINED)
def load_balls(system, spindle, state, modes, scratch):  # type: ignore[no-untyped-def]
    """Each ball's equation; the balls' pull on the deck and their torque on the spindle."""
    body, effects = system.body, system.effects
    n = ball_count(system)
    w, al = spindle.speed, spindle.acceleration
    f1 = body.unbalance * w * w
    f2 = -body.unbalance * al
    torque = spindle.torque
    for i in range(n):
        place_ball(system, i, state, scratch)
        ball = Ball(system.balls[i, MASS], system.balls[i, RADIUS])
        m, rate = ball.mass, state[4 + n + i]
        c, s = scratch[i, COS], scratch[i, SIN]
        r1, r2 = rigid_lever(system, i, scratch)
        path = curve_at(system, i, scratch) * rate
        if has_runout(effects):
            h, x = place_from_shaft(system, i, scratch)
            relative = (2.0 * w + rate) * path
            load = m * (w * w * h + relative)
            pull = m * x * w * w
            torque -= m * x * relative
            f1 -= pull * s
            f2 += pull * c
        else:
            load = system.balls[i, MOMENT] * (w + rate) * (w + rate)
            pull = 0.0
        f1 += load * c - r1 * al
        f2 += load * s - r2 * al
        if has_drag(effects):
            pull -= ball_drag(effects, ball) * path
        friction = sliding_friction(system, i, modes)
        set_rows(system, i, friction, scratch)
        scratch[i, LOAD] = load
        scratch[i, PATH] = path
        scratch[i, PULL] = pull + scratch[i, ROW3] * al
        if has_friction(effects):
            scratch[i, PULL] -= friction * load
        if not has_contact(effects):
            eliminate_ball(system, modes, scratch, i)
    return f1, f2, torque


@numba.njit(**INLINED)
def accelerations(system, al, f1, f2, torque, scratch):  # type: ignore[no-untyped-def]
    """Specific force A of the deck [m/s^2] and acceleration of the spindle [rad/s^2].

    Args:
        system: the System.
        al: the spindle's acceleration where it is prescribed; else of no account.
        f1, f2: force on the deck [N], all that does not depend on what is solved for.
        torque: torque on the spindle [N m], likewise.
        scratch: eliminated balls (GAIN).
    """
    effects = system.effects
    d11 = d22 = system.body.total_mass
    d12 = d21 = 0.0
    d13 = d31 = 0.0
    d23 = d32 = system.body.unbalance
    d33 = rotor_inertia(system, scratch) if has_motor(effects) else 1.0
    for i in range(ball_count(system)):
        m = system.balls[i, MASS]
        ms, mc = m * scratch[i, SIN], m * scratch[i, COS]
        d11 = multiply_add(-ms, scratch[i, GAIN1], d11)
        d12 = multiply_add(-ms, scratch[i, GAIN2], d12)
        d21 = multiply_add(mc, scratch[i, GAIN1], d21)
        d22 = multiply_add(mc, scratch[i, GAIN2], d22)
        f1 = multiply_add(ms, scratch[i, GAIN0], f1)
        f2 = multiply_add(-mc, scratch[i, GAIN0], f2)
        if has_motor(effects):
            r1, r2 = rigid_lever(system, i, scratch)
            lever = scratch[i, LEVER]
            d13 += r1 - ms * scratch[i, GAIN3]
            d23 += r2 + mc * scratch[i, GAIN3]
            d31 += r1 + lever * scratch[i, GAIN1]
            d32 += r2 + lever * scratch[i, GAIN2]
            d33 += lever * scratch[i, GAIN3]
            torque -= lever * scratch[i, GAIN0]
    if has_motor(effects):
        # The spindle's row is eliminated first.
        d11 -= d13 * d31 / d33
        d12 -= d13 * d32 / d33
        d21 -= d23 * d31 / d33
        d22 -= d23 * d32 / d33
        f1 -= d13 * torque / d33
        f2 -= d23 * torque / d33
    inverse = 1.0 / (d11 * d22 - d12 * d21)
    A1 = (f1 * d22 - f2 * d12) * inverse
    A2 = (f2 * d11 - f1 * d21) * inverse
    if has_motor(effects):
        al = (torque - d31 * A1 - d32 * A2) / d33
    return A1, A2, al


@numba.njit(**INLINED)
def move_balls(system, A1, A2, al, state, slope, scratch):  # type: ignore[no-untyped-def]
    """The balls' part of the state's derivative, once A and al are known."""
    effects = system.effects
    n = ball_count(system)
    for i in range(n):
        rate = state[4 + n + i]
        g = path_acceleration(system, i, A1, A2, al, scratch)
        scratch[i, PATH_ACCELERATION] = g
        slope[4 + i] = rate
        if has_runout(effects):
            g -= scratch[i, BEND] * rate * rate
        slope[4 + n + i] = g * curvature_at(system, i, scratch)
