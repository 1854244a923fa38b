"""One ball on the race: where it is, and its equation along the race before it is solved."""

import numba

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.motion import Ball
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.numbers.multiply_add import multiply_add
from ab_sim.dynamics.scratch import (
    ACROSS,
    BEND,
    COS,
    CURVE,
    FRICTION,
    GAIN0,
    GAIN1,
    GAIN2,
    GAIN3,
    INERTIA,
    LEVER,
    NORMAL,
    ROW1,
    ROW2,
    ROW3,
    SIN,
)
from ab_sim.dynamics.system import (
    DIRECTION,
    LOADED,
    MASS,
    MOMENT,
    RADIUS,
    ROLLING_MASS,
    ROUND_LEVER,
    ball_count,
    ball_inertia,
    friction_coefficient,
    has_friction,
    has_motor,
    has_runout,
    has_spin,
    race_shape,
    rotor_moment,
)


@numba.njit(**INLINED)
def place_balls(system, state, scratch):  # type: ignore[no-untyped-def]
    """What follows from the balls' angles alone: normals, the race's shape, inertias."""
    for i in range(ball_count(system)):
        place_ball(system, i, state, scratch)


@numba.njit(**INLINED)
def place_ball(system, i, state, scratch):  # type: ignore[no-untyped-def]
    """``place_balls`` for ball i."""
    effects, R = system.effects, system.body.race_radius
    c, s = cos_sin(state[4 + i])
    scratch[i, COS] = c
    scratch[i, SIN] = s
    scratch[i, INERTIA] = system.balls[i, ROLLING_MASS]
    lever = system.balls[i, ROUND_LEVER]
    if has_runout(effects):
        beyond, across, curve, bend = race_shape(effects, c, s)
        scratch[i, NORMAL] = R + beyond
        scratch[i, ACROSS] = across
        scratch[i, CURVE] = R + curve
        scratch[i, BEND] = bend
        lever += system.balls[i, MASS] * beyond
    scratch[i, LEVER] = lever


@numba.njit(**INLINED)
def place_from_shaft(system, i, scratch):  # type: ignore[no-untyped-def]
    """Place of ball i from the shaft, along the race's normal and across it [m]."""
    if has_runout(system.effects):
        return scratch[i, NORMAL], scratch[i, ACROSS]
    return system.body.race_radius, 0.0


@numba.njit(**INLINED)
def curve_at(system, i, scratch):  # type: ignore[no-untyped-def]
    """Radius of curvature of the race at ball i [m]."""
    if has_runout(system.effects):
        return scratch[i, CURVE]
    return system.body.race_radius


@numba.njit(**INLINED)
def curvature_at(system, i, scratch):  # type: ignore[no-untyped-def]
    """1 / ``curve_at`` [1/m]."""
    if has_runout(system.effects):
        return 1.0 / scratch[i, CURVE]
    return system.body.race_curvature


@numba.njit(**INLINED)
def rigid_lever(system, i, scratch):  # type: ignore[no-untyped-def]
    """m J r of ball i on the rotating axes [kg m], r its place from the shaft."""
    m, c, s = system.balls[i, MASS], scratch[i, COS], scratch[i, SIN]
    if has_runout(system.effects):
        h, x = place_from_shaft(system, i, scratch)
        return -m * (h * s + x * c), m * (h * c - x * s)
    return -system.balls[i, MOMENT] * s, system.balls[i, MOMENT] * c


@numba.njit(**INLINED)
def rotor_inertia(system, scratch):  # type: ignore[no-untyped-def]
    """Inertia of rotor and balls about the shaft, the balls at rest on the race [kg m^2]."""
    effects = system.effects
    total = rotor_moment(effects) + system.body.unbalance * system.body.eccentricity
    for i in range(ball_count(system)):
        ball = Ball(system.balls[i, MASS], system.balls[i, RADIUS])
        h, x = place_from_shaft(system, i, scratch)
        total += ball.mass * (h * h + x * x)
        if has_spin(effects):
            total += ball_inertia(effects, ball) * ball.radius * ball.radius
    return total


@numba.njit(**INLINED)
def sliding_friction(system, i, modes):  # type: ignore[no-untyped-def]
    """Coefficient of friction of ball i, signed as it slides; 0 where it sticks or is unloaded."""
    if has_friction(system.effects):
        ball = Ball(system.balls[i, MASS], system.balls[i, RADIUS])
        coefficient = friction_coefficient(system.effects, ball)
        return modes[i, DIRECTION] * modes[i, LOADED] * coefficient
    return 0.0


@numba.njit(**INLINED)
def set_rows(system, i, friction, scratch):  # type: ignore[no-untyped-def]
    """What A and al do to ball i along the race (ROW), its normal force's friction included."""
    m, c, s = system.balls[i, MASS], scratch[i, COS], scratch[i, SIN]
    scratch[i, ROW1] = m * s
    scratch[i, ROW2] = -m * c
    scratch[i, ROW3] = -scratch[i, LEVER]
    if has_friction(system.effects):
        scratch[i, FRICTION] = friction
        scratch[i, ROW1] += friction * m * c
        scratch[i, ROW2] += friction * m * s
        if has_runout(system.effects):
            scratch[i, ROW3] -= friction * m * scratch[i, ACROSS]


@numba.njit(**INLINED)
def path_acceleration(system, i, A1, A2, al, scratch):  # type: ignore[no-untyped-def]
    """g of ball i [m/s^2], or its path speed after an impact, from the eliminated equations."""
    g = multiply_add(scratch[i, GAIN1], A1, scratch[i, GAIN0])
    g = multiply_add(scratch[i, GAIN2], A2, g)
    if has_motor(system.effects):
        g += scratch[i, GAIN3] * al
    return g
