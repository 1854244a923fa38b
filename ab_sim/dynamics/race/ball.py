"""One ball on the race: where it is, and its equation along the race before it is solved."""

import numba
from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.layout import angle_at, rate_at
from ab_sim.dynamics.motion import Ball
from ab_sim.dynamics.race.table import (
    ACROSS,
    ALONG,
    BEND,
    COS,
    CURVE,
    FRICTION,
    GRIP,
    INERTIA,
    NORMAL,
    PATH,
    SIN,
)
from ab_sim.dynamics.system import (
    DIRECTION,
    LOADED,
    MASS,
    MOMENT,
    RACE_CURVATURE,
    RACE_RADIUS,
    RADIUS,
    ROLLING_MASS,
    ROUND_LEVER,
    System,
    ball_drag,
    friction_coefficient,
    has_contact,
    has_drag,
    has_friction,
    has_runout,
    race_arc,
    race_shape,
)


@register_jitable(**INLINED)
def ball_of(system: System, i: int) -> Ball:
    """Constants of ball i, as effects see it."""
    return Ball(system.balls[i, MASS], system.balls[i, RADIUS])


@numba.njit(**INLINED)
def place_ball(plant, i, state):  # type: ignore[no-untyped-def]
    """What follows from the ball's angle alone: its inertia, the race's shape there.

    COS and SIN hold those of the angle.

    Returns:
        (cos theta, sin theta), the race's outward normal on the rotor's axes.
    """
    system, table = plant.system, plant.room.table
    c, s = table[i, COS], table[i, SIN]
    table[i, INERTIA] = system.balls[i, ROLLING_MASS]
    if has_runout(system.effects):
        beyond, across, curve, bend = race_shape(system.effects, c, s)
        R = system.balls[i, RACE_RADIUS]
        table[i, NORMAL] = R + beyond
        table[i, ACROSS] = across
        table[i, CURVE] = R + curve
        table[i, BEND] = bend
    elif has_contact(system.effects):
        table[i, CURVE] = system.balls[i, RACE_RADIUS]
    if has_contact(system.effects):
        R = system.balls[i, RACE_RADIUS]
        theta = state[angle_at(system, i)]
        table[i, ALONG] = R * theta + race_arc(system.effects, theta)
    return c, s


@numba.njit(**INLINED)
def place_from_shaft(plant, i):  # type: ignore[no-untyped-def]
    """Place of ball i from the shaft, along the race's normal and across it [m]."""
    if has_runout(plant.system.effects):
        return plant.room.table[i, NORMAL], plant.room.table[i, ACROSS]
    return plant.system.balls[i, RACE_RADIUS], 0.0


@numba.njit(**INLINED)
def moment_from_shaft(plant, i):  # type: ignore[no-untyped-def]
    """The ball's mass times its place from the shaft, along the normal and across it [kg m]."""
    if has_runout(plant.system.effects):
        m = plant.system.balls[i, MASS]
        return m * plant.room.table[i, NORMAL], m * plant.room.table[i, ACROSS]
    return plant.system.balls[i, MOMENT], 0.0


@numba.njit(**INLINED)
def spindle_lever(plant, i):  # type: ignore[no-untyped-def]
    """What the spindle's acceleration asks of ball i along the race [kg m]."""
    if has_runout(plant.system.effects):
        beyond = plant.room.table[i, NORMAL] - plant.system.balls[i, RACE_RADIUS]
        return plant.system.balls[i, ROUND_LEVER] + plant.system.balls[i, MASS] * beyond
    return plant.system.balls[i, ROUND_LEVER]


@numba.njit(**INLINED)
def curve_at(plant, i):  # type: ignore[no-untyped-def]
    """Radius of curvature of the race at ball i [m]."""
    if has_runout(plant.system.effects):
        return plant.room.table[i, CURVE]
    return plant.system.balls[i, RACE_RADIUS]


@numba.njit(**INLINED)
def curvature_at(plant, i):  # type: ignore[no-untyped-def]
    """1 / ``curve_at`` [1/m]."""
    if has_runout(plant.system.effects):
        return 1.0 / plant.room.table[i, CURVE]
    return plant.system.balls[i, RACE_CURVATURE]


@numba.njit(**INLINED)
def rate_change(plant, i, rate, path):  # type: ignore[no-untyped-def]
    """theta'' of ball i [rad/s^2], from theta' and the path acceleration [m/s^2]."""
    if has_runout(plant.system.effects):
        path -= plant.room.table[i, BEND] * rate * rate
    return path * curvature_at(plant, i)


@numba.njit(**INLINED)
def path_change(plant, i, rate, change):  # type: ignore[no-untyped-def]
    """Path acceleration of ball i [m/s^2], from theta' and theta''."""
    path = curve_at(plant, i) * change
    if has_runout(plant.system.effects):
        path += plant.room.table[i, BEND] * rate * rate
    return path


@numba.njit(**INLINED)
def relative_load(plant, w, rate, i):  # type: ignore[no-untyped-def]
    """-m times the ball's acceleration on axes that do not turn with rotor and race [N].

    Returns:
        Along the normal and along the race, as far as the path and spindle accelerations are not
        in it: m (h w^2 + 2 w s' + l theta'^2), m x w^2.
    """
    system, m = plant.system, plant.system.balls[i, MASS]
    if has_runout(system.effects):
        h, x = place_from_shaft(plant, i)
        path = curve_at(plant, i) * rate
        return m * (w * w * h + (2.0 * w + rate) * path), m * x * w * w
    return system.balls[i, MOMENT] * (w + rate) * (w + rate), 0.0


@numba.njit(**INLINED)
def resist_ball(plant, i, state):  # type: ignore[no-untyped-def]
    """PATH, and friction's coefficients; returns the drag on the ball along the race [N]."""
    system, table, modes = plant.system, plant.room.table, plant.modes
    path = curve_at(plant, i) * state[rate_at(system, i)]
    table[i, PATH] = path
    if has_friction(system.effects):
        grip = friction_coefficient(system.effects, ball_of(system, i))
        table[i, GRIP] = grip
        table[i, FRICTION] = modes[i, DIRECTION] * modes[i, LOADED] * grip
    if has_drag(system.effects):
        return -ball_drag(system.effects, ball_of(system, i)) * path
    return 0.0
